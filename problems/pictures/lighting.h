// SPDX-License-Identifier: GPL-3.0-or-later
// The light at every vertex of a scene: a few dozen lights, each with a depth map of what is in its
// way, summed up once per picture.
#pragma once

#include <vector>

#include "problems/pictures/render.h"

namespace semblance {

using Rgb = Eigen::Array3f;  // linear light

struct Light {
  Vec3 to_light = Vec3::Zero();  // unit
  Rgb irradiance = Rgb::Zero();  // of a surface that faces it
  bool is_key = false;           // its highlight is drawn
};

// Lights placed relative to the camera. Under kEven a surface that faces the viewer and lies in no
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
};

// Sets light and key of every vertex. Only opaque objects cast shadows.
void LightVertices(const Scene& scene, const std::vector<Light>& lights, int threads,
                   FlatScene& flat);

}  // namespace semblance
