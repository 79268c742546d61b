// SPDX-License-Identifier: GPL-3.0-or-later
// The light at every vertex of a scene, summed once per picture over a few dozen lights. Each light
// has a depth map of the surfaces nearest to it, which gives soft shadows.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "problems/report/pictures/raster.h"
#include "problems/report/pictures/render.h"

namespace semblance::problems {

using Rgb = Eigen::Array3f;  // linear light

struct Light {
  Vec3 to_light = Vec3::Zero();  // unit
  Rgb irradiance = Rgb::Zero();  // on a surface that faces the light
  bool is_key = false;           // only key lights cause highlights
};

// The lights of a picture. They move with the camera, except for a sky whose directions are fixed
// in the world. A surface that faces the viewer outside all shadows receives exactly 1 under kEven,
// and a little less under kStudio, which leaves room for highlights.
std::vector<Light> LightRig(Lighting lighting, const Mat3& view_from_world);

struct SceneVertex {
  Vec3 position;  // mm
  Vec3 normal;    // unit, or zero
  Rgb albedo = Rgb::Zero();
  Rgb light = Rgb::Zero();  // all lights, with shadows
  float key = 0;            // 0..1, the share of the key light that arrives
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
  std::vector<bool> is_seen;  // one per vertex; empty: all are seen
};

// The depth of the nearest surface as seen from a light.
struct ShadowMap {
  Projection projection;
  int texels = 0;            // along a side
  std::vector<float> depth;  // row by row; infinite where there is no surface
};

// The shadow maps that several pictures of the same opaque meshes share.
struct ShadowMaps {
  // Texels along a side. Light is computed at vertices and interpolated between them, so a mesh
  // with few vertices needs few texels.
  int texels = 512;
  std::map<std::array<double, 3>, ShadowMap> of_direction;  // to the light
  Box3 box;                                                 // of the opaque vertices
};

// Sets light and key of every vertex that is seen. Only opaque objects cast shadows. Adds missing
// maps to `maps`. Throws std::logic_error if `maps` belongs to other meshes.
void LightVertices(const Scene& scene, const std::vector<Light>& lights, int threads,
                   ShadowMaps& maps, FlatScene& flat);

}  // namespace semblance::problems
