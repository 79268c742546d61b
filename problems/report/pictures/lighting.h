// SPDX-License-Identifier: GPL-3.0-or-later
// The light at every vertex of a scene, summed once per picture over a few dozen lights. Each light
// has a depth map of the surfaces nearest to it, which gives soft shadows.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <span>
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

// The lights of a picture. The sky is kSkyLights lights whose directions are fixed in the world, so
// that its shadows serve every picture of a scene.
struct LightRig {
  std::vector<Light> lights;  // these move with the camera
  // The irradiance of each light of the sky, with the unit direction d to it, is
  // sky_colour (sky_level + sky_slope . d).
  Rgb sky_colour = Rgb::Zero();
  float sky_level = 0;
  Eigen::Vector3f sky_slope = Eigen::Vector3f::Zero();

  Rgb FromSky(const Vec3& direction) const {
    return sky_colour * (sky_level + sky_slope.dot(direction.cast<float>()));
  }
};

// A surface that faces the viewer outside all shadows receives exactly 1 under kEven, and a little
// less under kStudio, which leaves room for highlights.
LightRig MakeLightRig(Lighting lighting, const Mat3& view_from_world);

// Trades smooth shadows against time: each light costs a depth map, which all pictures share.
inline constexpr int kSkyLights = 26;
std::array<Vec3, kSkyLights> SkyDirections();  // unit; spread evenly over the sphere

// Red, green, blue and an unused fourth number, which make one register.
using Rgb4 = Eigen::Array4f;

// The shares of the sky's lights that a vertex receives, with their cosines: summed, and summed
// times the direction along x, y and z. They give its light under any rig.
struct SkyShare {
  Rgb4 sum = Rgb4::Constant(static_cast<float>(kNaN));  // NaN: not computed yet
  std::array<Rgb4, 3> along = {Rgb4::Zero(), Rgb4::Zero(), Rgb4::Zero()};
};

struct SceneVertex {
  Vec3 position;                                     // mm
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  // unit, or zero
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
  std::vector<char> is_seen;  // one per vertex; empty: all are seen
  std::vector<SkyShare> sky;  // one per vertex; empty: none is computed
};

// The depth of the nearest surface as seen from a light, on a square grid of texels.
struct ShadowMap {
  Eigen::Vector3f to_light = Eigen::Vector3f::Zero();      // unit
  Eigen::Matrix3f grid_from_mm = Eigen::Matrix3f::Zero();  // column, row and depth of a place
                                                           // relative to the middle of the box
  DepthGrid grid;
};

// The shadow maps that several pictures of the same opaque meshes share.
struct ShadowMaps {
  // Texels along a side. Light is computed at vertices and interpolated between them, so a mesh
  // with few vertices needs few texels.
  int texels = 320;
  std::map<std::array<double, 3>, ShadowMap> of_direction;  // to the light
  Box3 box;                                                 // of the opaque vertices
  TriMesh casters;  // the opaque meshes, those that are fine thinned to a few texels

  double Texel_mm() const { return std::max(box.diagonal().norm(), 1e-9) / (texels - 4); }
};

// Sets light and key of every vertex that is seen, and its share of the sky if that is missing.
// Only opaque objects cast shadows. Adds missing maps to `maps`. Throws std::logic_error if `maps`
// belongs to other meshes. materials: one per object, in place of its own.
void LightVertices(const Scene& scene, std::span<const Material> materials, const LightRig& rig,
                   int threads, ShadowMaps& maps, FlatScene& flat);

}  // namespace semblance::problems
