// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/pictures/lighting.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <stdexcept>

#include "problems/report/pictures/raster.h"
#include "surfaces/base/parallel.h"
#include "surfaces/mesh/mesh_primitives.h"

namespace semblance::problems {
namespace {

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

// `top` and `bottom` are the relative radiances above and below the view.
void SetSky(double strength, double top, double bottom, const Mat3& view, LightRig& rig) {
  const double share = strength / kSkyLights;
  rig.sky_colour = Rgb::Ones();
  rig.sky_level = static_cast<float>(share * (bottom + top) / 2);
  rig.sky_slope = (share * (top - bottom) / 2 * view.row(1).transpose()).cast<float>();
}

// The strengths of the studio lights are a matter of taste: key from the upper left, a weak fill
// from the right, a rim light from behind.
LightRig PlaceLights(Lighting lighting, const Mat3& view) {
  LightRig rig;
  if (lighting == Lighting::kEven) {
    AddSoftBox({.towards = {0, 0, 1}, .strength = 0.55}, view, rig.lights);
    SetSky(2.0, 1, 1, view, rig);
    return rig;
  }
  AddSoftBox({.towards = {-0.62, 0.62, 0.62},
              .radius = 0.28,
              .lights = 9,
              .strength = 1.0,
              .colour = {1.0F, 0.965F, 0.91F},
              .is_key = true},
             view, rig.lights);
  AddSoftBox({.towards = {0.8, 0.05, 0.6},
              .radius = 0.2,
              .lights = 3,
              .strength = 0.22,
              .colour = {0.90F, 0.95F, 1.0F}},
             view, rig.lights);
  AddSoftBox({.towards = {0.75, 0.45, -0.55},
              .radius = 0.1,
              .lights = 2,
              .strength = 0.55,
              .colour = {0.95F, 0.97F, 1.0F}},
             view, rig.lights);
  SetSky(1.3, 1.0, 0.4, view, rig);
  return rig;
}

Mat3 ViewTowards(const Vec3& to_viewer) {
  Mat3 view;
  view.row(2) = to_viewer.transpose();
  view.row(0) = to_viewer.unitOrthogonal().transpose();
  view.row(1) = view.row(2).cross(view.row(0));
  return view;
}

ShadowMap RenderShadowMap(const ShadowMaps& all, const Vec3& to_light) {
  const int size = all.texels;
  ShadowMap map{.projection = {.view_from_world = ViewTowards(to_light),
                               .centre = all.box.center(),
                               .samples_per_mm = 1 / all.Texel_mm(),
                               .width = static_cast<double>(size),
                               .height = static_cast<double>(size)},
                .texels = size,
                .depth = std::vector<float>(static_cast<std::size_t>(size) * size,
                                            std::numeric_limits<float>::infinity())};
  std::vector<RasterPoint> points(all.casters.points.size());
  std::ranges::transform(all.casters.points, points.begin(),
                         [&](const Vec3& p) { return map.projection * p; });
  for (const auto& [a, b, c] : all.casters.triangles) {
    VisitSamples(points[a], points[b], points[c], {0, size, 0, size}, [&](const Coverage& s) {
      float& depth = map.depth[static_cast<std::size_t>(s.y) * size + s.x];
      depth = std::min(depth, s.depth);
    });
  }
  return map;
}

// The properties of a material on which the light at its vertices depends.
struct Matter {
  float wrap;
  Eigen::Array4f per_mm2;  // 1 / scatter_mm^2 of red, green and blue

  explicit Matter(const Material& material)
      : wrap(static_cast<float>(material.wrap)), per_mm2(Eigen::Array4f::Zero()) {
    per_mm2.head<3>() = material.scatter_mm.cast<float>().array().square().inverse();
  }

  // The share of each colour that passes `thickness_mm`: half at scatter_mm, falling with the
  // square of the thickness. A smooth stand-in for scattering below the skin.
  Eigen::Array4f Transmitted(float thickness_mm) const {
    return 1 / (1 + thickness_mm * thickness_mm * per_mm2);
  }
};

// The share of light that arrives, interpolated between the four texels around the point: 1 in the
// open, towards 0 behind matter.
Rgb LightThrough(const ShadowMap& map, const Vec3& p, const Matter& matter) {
  const RasterPoint at = map.projection * p;
  const float texel_mm = static_cast<float>(1 / map.projection.samples_per_mm);
  const std::int32_t half = kSubsamples / 2;
  const int x = (at.x - half) >> 8, y = (at.y - half) >> 8;
  if (x < 0 || y < 0 || x + 1 >= map.texels || y + 1 >= map.texels) {
    return Rgb::Ones();
  }
  const float fx = static_cast<float>((at.x - half) & 255) / kSubsamples;
  const float fy = static_cast<float>((at.y - half) & 255) / kSubsamples;
  Eigen::Array4f sum = Eigen::Array4f::Zero();
  for (int k = 0; k < 4; ++k) {
    const int dx = k & 1, dy = k >> 1;
    const float weight = (dx != 0 ? fx : 1 - fx) * (dy != 0 ? fy : 1 - fy);
    const float thickness = at.depth - map.depth[(y + dy) * map.texels + x + dx] - texel_mm;
    sum += weight * (thickness > 0 ? matter.Transmitted(thickness) : Eigen::Array4f::Ones());
  }
  return sum.head<3>();
}

// The share of one light that reaches the vertex, times its wrapped cosine.
Rgb ShareOfLight(const Matter& matter, const SceneVertex& vertex, const Vec3& to_light,
                 const ShadowMap& map, Rgb& through) {
  const float wrapped =
      (static_cast<float>(vertex.normal.dot(to_light)) + matter.wrap) / (1 + matter.wrap);
  if (wrapped <= 0) {
    return Rgb::Zero();
  }
  // Starts 1.5 texels above the surface, so that the surface does not shade itself.
  const Vec3 above = vertex.position + 1.5 / map.projection.samples_per_mm * vertex.normal;
  through = LightThrough(map, above, matter);
  return wrapped * through;
}

using MapList = std::vector<const ShadowMap*>;

SkyShare FindSkyShare(const Matter& matter, std::span<const Vec3> sky, const MapList& maps,
                      const SceneVertex& vertex) {
  SkyShare share{.sum = Rgb::Zero()};
  for (std::size_t light = 0; light < sky.size(); ++light) {
    const Vec3& direction = sky[light];
    Rgb through;
    const Rgb part = ShareOfLight(matter, vertex, direction, *maps[light], through);
    share.sum += part;
    for (int axis = 0; axis < 3; ++axis) {
      share.along[axis] += static_cast<float>(direction[axis]) * part;
    }
  }
  return share;
}

void LightVertex(const Matter& matter, const LightRig& rig, const MapList& maps,
                 const SkyShare& sky, SceneVertex& vertex) {
  vertex.light = rig.sky_level * sky.sum;
  for (int axis = 0; axis < 3; ++axis) {
    vertex.light += rig.sky_slope[axis] * sky.along[axis];
  }
  vertex.light *= rig.sky_colour;
  float key_all = 0, key_seen = 0;
  for (std::size_t i = 0; i < rig.lights.size(); ++i) {
    const Light& light = rig.lights[i];
    Rgb through = Rgb::Constant(-1);  // stays: the surface faces away
    vertex.light +=
        ShareOfLight(matter, vertex, light.to_light, *maps[i], through) * light.irradiance;
    if (light.is_key && through[1] >= 0) {
      key_all += 1;
      key_seen += through[1];
    }
  }
  vertex.key = key_all > 0 ? key_seen / key_all : 0;
}

// The box of the vertices that cast shadows, or the origin if there are none.
Box3 BoundCasters(const Scene& scene) {
  Box3 box;
  for (const SceneObject& object : scene.objects) {
    if (object.opacity >= 1) {
      box.extend(Bounds(object.mesh));
    }
  }
  return box.isEmpty() ? Box3(Vec3::Zero(), Vec3::Zero()) : box;
}

// The opaque surfaces as they are drawn into shadow maps: with one vertex per cell of kCellTexels
// texels, about as far as a point lies above its surface before it looks for shadows. On a skull of
// 394 thousand triangles 120 thousand remain. A colour of the picture changes by 0.1 of 255 steps
// on average, by 10 steps in one of a thousand, and by twice as much with twice the cell. A surface
// that would lose much of its area, as a small marker would, stays as it is.
TriMesh MakeCasters(const Scene& scene, double texel_mm) {
  constexpr double kCellTexels = 3;
  constexpr double kLeastArea = 0.6;  // the skulls and skins of two scans keep all of theirs
  TriMesh all;
  for (const SceneObject& object : scene.objects) {
    if (object.opacity < 1) {
      continue;
    }
    const TriMesh thin = ClusterVertices(object.mesh, kCellTexels * texel_mm);
    Append(all, Area(thin) < kLeastArea * Area(object.mesh) ? object.mesh : thin);
  }
  return all;
}

}  // namespace

// Fibonacci's lattice; z is up.
std::array<Vec3, kSkyLights> SkyDirections() {
  std::array<Vec3, kSkyLights> directions;
  for (int k = 0; k < kSkyLights; ++k) {
    const double z = 1 - (2 * k + 1.0) / kSkyLights;
    const double phi = k * std::numbers::pi * (3 - std::sqrt(5.0));
    const double r = std::sqrt(1 - z * z);
    directions[k] = {r * std::cos(phi), r * std::sin(phi), z};
  }
  return directions;
}

LightRig MakeLightRig(Lighting lighting, const Mat3& view_from_world) {
  LightRig rig = PlaceLights(lighting, view_from_world);
  Rgb facing = Rgb::Zero();
  const auto add = [&](const Vec3& to_light, const Rgb& irradiance) {
    const double cosine = view_from_world.row(2).dot(to_light);
    facing += static_cast<float>(std::max(0.0, cosine)) * irradiance;
  };
  for (const Light& light : rig.lights) {
    add(light.to_light, light.irradiance);
  }
  for (const Vec3& direction : SkyDirections()) {
    add(direction, rig.FromSky(direction));
  }
  // 0.86 leaves room for highlights below white.
  const float exposure = lighting == Lighting::kEven ? 1.0F : 0.86F;
  for (Light& light : rig.lights) {
    light.irradiance *= exposure / facing;
  }
  rig.sky_colour *= exposure / facing;
  return rig;
}

namespace {

// The maps of the lights in these directions. Renders those that are missing.
MapList FindMaps(std::span<const Vec3> to_light, int threads, ShadowMaps& maps) {
  MapList found;
  std::vector<std::pair<Vec3, ShadowMap*>> missing;
  for (const Vec3& d : to_light) {
    const auto [map, is_new] = maps.of_direction.try_emplace({d.x(), d.y(), d.z()});
    found.push_back(&map->second);
    if (is_new) {
      missing.emplace_back(d, &map->second);
    }
  }
  ParallelFor(missing.size(), threads, 1,
              [&](std::size_t i) { *missing[i].second = RenderShadowMap(maps, missing[i].first); });
  return found;
}

}  // namespace

void LightVertices(const Scene& scene, const LightRig& rig, int threads, ShadowMaps& maps,
                   FlatScene& flat) {
  const Box3 box = BoundCasters(scene);
  if (maps.of_direction.empty()) {
    maps.box = box;
    maps.casters = MakeCasters(scene, maps.Texel_mm());
  } else if (maps.box.min() != box.min() || maps.box.max() != box.max()) {
    throw std::logic_error("shadows of a scene with other meshes");
  }
  std::vector<Matter> matter;
  for (const SceneObject& object : scene.objects) {
    matter.emplace_back(object.material);
  }
  const std::array<Vec3, kSkyLights> sky = SkyDirections();
  std::vector<Vec3> moving(rig.lights.size());
  std::ranges::transform(rig.lights, moving.begin(), &Light::to_light);
  const MapList of_sky = FindMaps(sky, threads, maps);
  const MapList of_lights = FindMaps(moving, threads, maps);
  flat.sky.resize(flat.vertices.size());
  ParallelFor(flat.vertices.size(), threads, 1024, [&](std::size_t v) {
    if (!flat.is_seen.empty() && !flat.is_seen[v]) {
      return;
    }
    const Matter& of_vertex = matter[flat.object_of_vertex[v]];
    if (std::isnan(flat.sky[v].sum[0])) {
      flat.sky[v] = FindSkyShare(of_vertex, sky, of_sky, flat.vertices[v]);
    }
    LightVertex(of_vertex, rig, of_lights, flat.sky[v], flat.vertices[v]);
  });
}

}  // namespace semblance::problems
