// SPDX-License-Identifier: GPL-3.0-or-later
// The light at every vertex of a scene: a few dozen lights, each with a depth map of what is in its
// way, summed up once per picture.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "problems/pictures/raster.h"
#include "problems/pictures/render.h"

namespace semblance {

using Rgb = Eigen::Array3f;  // linear light

struct Light {
  Vec3 to_light = Vec3::Zero();  // unit
  Rgb irradiance = Rgb::Zero();  // of a surface that faces it
  bool is_key = false;           // its highlight is drawn
};

// Lights placed relative to the camera, but for a sky all round, whose directions are those of the
// world in every picture. Under kEven a surface that faces the viewer and lies in no
// shadow receives exactly 1, under kStudio a little less, which leaves room for highlights.
std::vector<Light> LightRig(Lighting lighting, const Mat3& view_from_world);

struct SceneVertex {
  Vec3 position;  // mm
  Vec3 normal;    // unit, or zero
  Rgb albedo = Rgb::Zero();
  Rgb light = Rgb::Zero();  // all lights, with shadows
  float key = 0;            // 0..1, how much of the key light arrives
};

struct SceneTriangle {
  std::array<std::int32_t, 3> corners;  // into the vertices of the whole scene
  int object = 0;
};

// All objects of a scene in one list, in order.
struct FlatScene {
  std::vector<SceneVertex> vertices;
  std::vector<SceneTriangle> triangles;
  std::vector<int> object_of_vertex;
  std::vector<bool> is_seen;  // one per vertex; none: all are
};

// What is nearest to a light, seen from it.
struct ShadowMap {
  Projection projection;
  int texels = 0;            // along a side
  std::vector<float> depth;  // row by row; infinite where nothing is
};

// Those that several pictures of the same opaque meshes have in common.
struct ShadowMaps {
  // Along a side of each. Light is known at vertices and spread between them, so few vertices need
  // few texels.
  int texels = 512;
  std::map<std::array<double, 3>, ShadowMap> of_direction;  // to the light
  Box3 box;                                                 // of what casts these shadows
};

// Sets light and key of every vertex that is seen. Only opaque objects cast shadows. maps: of the
// same opaque meshes; those that are missing are added. Throws std::logic_error if they are of
// others.
void LightVertices(const Scene& scene, const std::vector<Light>& lights, int threads,
                   ShadowMaps& maps, FlatScene& flat);

}  // namespace semblance
