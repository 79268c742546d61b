// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/pictures/lighting.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "problems/report/pictures/raster.h"
#include "surfaces/base/parallel.h"

namespace semblance::problems {
namespace {

// Trades smooth shadows against time: each light costs a depth map, which all pictures share.
constexpr int kSkyLights = 26;

// Directions spread evenly over the sphere (Fibonacci lattice); z is up.
Vec3 SphereDirection(int i, int count) {
  const double z = 1 - (2 * i + 1.0) / count;
  const double phi = i * std::numbers::pi * (3 - std::sqrt(5.0));
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(phi), r * std::sin(phi), z};
}

struct SoftBox {
  Vec3 towards;  // in the view: right, up, towards the viewer
  double radius = 0;
  int lights = 1;
  double strength = 0;
  Rgb colour = Rgb::Ones();
  bool is_key = false;
};

// Adds lights on a spiral over a disc around the direction. The radius is relative to the distance.
void AddSoftBox(const SoftBox& box, const Mat3& view, std::vector<Light>& lights) {
  const Vec3 towards = box.towards.normalized();
  const Vec3 u = towards.unitOrthogonal(), v = towards.cross(u);
  for (int i = 0; i < box.lights; ++i) {
    const double r = box.radius * std::sqrt((i + 0.5) / box.lights);
    const double phi = i * std::numbers::pi * (3 - std::sqrt(5.0));
    const Vec3 direction = towards + r * (std::cos(phi) * u + std::sin(phi) * v);
    lights.push_back({.to_light = view.transpose() * direction.normalized(),
                      .irradiance = static_cast<float>(box.strength / box.lights) * box.colour,
                      .is_key = box.is_key});
  }
}

// Adds a sky on all sides. `top` and `bottom` are the relative radiances above and below the view.
void AddDome(int count, double strength, double top, double bottom, const Mat3& view,
             std::vector<Light>& lights) {
  for (int i = 0; i < count; ++i) {
    const Vec3 direction = SphereDirection(i, count);
    const double radiance = bottom + (top - bottom) * 0.5 * (1 + view.row(1).dot(direction));
    lights.push_back({.to_light = direction,
                      .irradiance = Rgb::Constant(static_cast<float>(strength * radiance / count)),
                      .is_key = false});
  }
}

// The strengths of the studio lights are a matter of taste: key from the upper left, a weak fill
// from the right, a rim light from behind.
std::vector<Light> PlaceLights(Lighting lighting, const Mat3& view) {
  std::vector<Light> lights;
  if (lighting == Lighting::kEven) {
    AddSoftBox({.towards = {0, 0, 1}, .strength = 0.55}, view, lights);
    AddDome(kSkyLights, 2.0, 1, 1, view, lights);
    return lights;
  }
  AddSoftBox({.towards = {-0.62, 0.62, 0.62},
              .radius = 0.28,
              .lights = 9,
              .strength = 1.0,
              .colour = {1.0F, 0.965F, 0.91F},
              .is_key = true},
             view, lights);
  AddSoftBox({.towards = {0.8, 0.05, 0.6},
              .radius = 0.2,
              .lights = 3,
              .strength = 0.22,
              .colour = {0.90F, 0.95F, 1.0F}},
             view, lights);
  AddSoftBox({.towards = {0.75, 0.45, -0.55},
              .radius = 0.1,
              .lights = 2,
              .strength = 0.55,
              .colour = {0.95F, 0.97F, 1.0F}},
             view, lights);
  AddDome(kSkyLights, 1.3, 1.0, 0.4, view, lights);
  return lights;
}

Mat3 ViewTowards(const Vec3& to_viewer) {
  Mat3 view;
  view.row(2) = to_viewer.transpose();
  view.row(0) = to_viewer.unitOrthogonal().transpose();
  view.row(1) = view.row(2).cross(view.row(0));
  return view;
}

ShadowMap RenderShadowMap(const FlatScene& flat, const std::vector<bool>& casts,
                          const ShadowMaps& all, const Vec3& to_light) {
  const double diameter = std::max(all.box.diagonal().norm(), 1e-9);
  const int size = all.texels;
  ShadowMap map{.projection = {.view_from_world = ViewTowards(to_light),
                               .centre = all.box.center(),
                               .samples_per_mm = (size - 4) / diameter,
                               .width = static_cast<double>(size),
                               .height = static_cast<double>(size)},
                .texels = size,
                .depth = std::vector<float>(static_cast<std::size_t>(size) * size,
                                            std::numeric_limits<float>::infinity())};
  std::vector<RasterPoint> points(flat.vertices.size());
  for (std::size_t v = 0; v < points.size(); ++v) {
    if (casts[flat.object_of_vertex[v]]) {
      points[v] = map.projection * flat.vertices[v].position;
    }
  }
  for (const SceneTriangle& t : flat.triangles) {
    if (casts[t.object]) {
      VisitSamples(points[t.corners[0]], points[t.corners[1]], points[t.corners[2]],
                   {0, size, 0, size}, [&](const Coverage& s) {
                     float& depth = map.depth[static_cast<std::size_t>(s.y) * size + s.x];
                     depth = std::min(depth, s.depth);
                   });
    }
  }
  return map;
}

// The share of each colour that passes `thickness_mm` of matter: half at scatter_mm, falling with
// the square of the thickness. A smooth stand-in for scattering below the skin.
Rgb TransmittedShare(float thickness_mm, const Rgb& scatter_mm) {
  const Rgb ratio = thickness_mm / scatter_mm;
  return 1 / (1 + ratio * ratio);
}

// The share of light that arrives, interpolated between the four texels around the point: 1 in the
// open, towards 0 behind matter.
Rgb LightThrough(const ShadowMap& map, const Vec3& p, const Rgb& scatter_mm) {
  const RasterPoint at = map.projection * p;
  const float texel_mm = static_cast<float>(1 / map.projection.samples_per_mm);
  const std::int32_t half = kSubsamples / 2;
  const int x = (at.x - half) >> 8, y = (at.y - half) >> 8;
  if (x < 0 || y < 0 || x + 1 >= map.texels || y + 1 >= map.texels) {
    return Rgb::Ones();
  }
  const float fx = static_cast<float>((at.x - half) & 255) / kSubsamples;
  const float fy = static_cast<float>((at.y - half) & 255) / kSubsamples;
  Rgb sum = Rgb::Zero();
  for (int k = 0; k < 4; ++k) {
    const int dx = k & 1, dy = k >> 1;
    const float weight = (dx != 0 ? fx : 1 - fx) * (dy != 0 ? fy : 1 - fy);
    const float thickness = at.depth - map.depth[(y + dy) * map.texels + x + dx] - texel_mm;
    sum += thickness > 0 ? Rgb(weight * TransmittedShare(thickness, scatter_mm))
                         : Rgb::Constant(weight);
  }
  return sum;
}

void LightVertex(const Material& material, const std::vector<Light>& lights,
                 const std::vector<const ShadowMap*>& maps, SceneVertex& vertex) {
  const Rgb scatter = material.scatter_mm.cast<float>().array();
  const auto wrap = static_cast<float>(material.wrap);
  float key_all = 0, key_seen = 0;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const auto cosine = static_cast<float>(vertex.normal.dot(lights[i].to_light));
    const float wrapped = (cosine + wrap) / (1 + wrap);
    if (wrapped <= 0) {
      continue;
    }
    // Starts 1.5 texels above the surface, so that the surface does not shade itself.
    const Vec3 above = vertex.position + 1.5 / maps[i]->projection.samples_per_mm * vertex.normal;
    const Rgb through = LightThrough(*maps[i], above, scatter);
    vertex.light += wrapped * through * lights[i].irradiance;
    key_all += lights[i].is_key ? 1.0F : 0.0F;
    key_seen += lights[i].is_key ? through[1] : 0.0F;
  }
  vertex.key = key_all > 0 ? key_seen / key_all : 0;
}

// The box of the vertices that cast shadows, or the origin if there are none.
Box3 BoundCasters(const FlatScene& flat, const std::vector<bool>& casts) {
  Box3 box;
  for (std::size_t v = 0; v < flat.vertices.size(); ++v) {
    if (casts[flat.object_of_vertex[v]]) {
      box.extend(flat.vertices[v].position);
    }
  }
  return box.isEmpty() ? Box3(Vec3::Zero(), Vec3::Zero()) : box;
}

}  // namespace

std::vector<Light> LightRig(Lighting lighting, const Mat3& view_from_world) {
  std::vector<Light> lights = PlaceLights(lighting, view_from_world);
  Rgb facing = Rgb::Zero();
  for (const Light& light : lights) {
    const double cosine = view_from_world.row(2).dot(light.to_light);
    facing += static_cast<float>(std::max(0.0, cosine)) * light.irradiance;
  }
  // 0.86 leaves room for highlights below white.
  const float exposure = lighting == Lighting::kEven ? 1.0F : 0.86F;
  for (Light& light : lights) {
    light.irradiance *= exposure / facing;
  }
  return lights;
}

void LightVertices(const Scene& scene, const std::vector<Light>& lights, int threads,
                   ShadowMaps& maps, FlatScene& flat) {
  std::vector<bool> casts;
  for (const SceneObject& object : scene.objects) {
    casts.push_back(object.opacity >= 1);
  }
  const Box3 box = BoundCasters(flat, casts);
  if (!maps.of_direction.empty() && (maps.box.min() != box.min() || maps.box.max() != box.max())) {
    throw std::logic_error("shadows of a scene with other meshes");
  }
  maps.box = box;
  std::vector<const ShadowMap*> map_of_light;
  std::vector<std::pair<Vec3, ShadowMap*>> missing;
  for (const Light& light : lights) {
    const Vec3& d = light.to_light;
    const auto [map, is_new] = maps.of_direction.try_emplace({d.x(), d.y(), d.z()});
    map_of_light.push_back(&map->second);
    if (is_new) {
      missing.emplace_back(d, &map->second);
    }
  }
  ParallelFor(missing.size(), threads, 1, [&](std::size_t i) {
    *missing[i].second = RenderShadowMap(flat, casts, maps, missing[i].first);
  });
  ParallelFor(flat.vertices.size(), threads, 1024, [&](std::size_t v) {
    if (!flat.is_seen.empty() && !flat.is_seen[v]) {
      return;
    }
    LightVertex(scene.objects[flat.object_of_vertex[v]].material, lights, map_of_light,
                flat.vertices[v]);
  });
}

}  // namespace semblance::problems
