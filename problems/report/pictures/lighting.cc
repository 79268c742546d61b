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
  const Projection projection = {.view_from_world = ViewTowards(to_light),
                                 .centre = all.box.center(),
                                 .samples_per_mm = 1 / all.Texel_mm(),
                                 .width = static_cast<double>(size),
                                 .height = static_cast<double>(size)};
  const Vec3 scale(projection.samples_per_mm, -projection.samples_per_mm, -1);
  ShadowMap map{.to_light = to_light.cast<float>(),
                .grid_from_mm = (scale.asDiagonal() * projection.view_from_world).cast<float>(),
                .grid = DepthGrid(size, size)};
  std::vector<RasterPoint> points(all.casters.points.size());
  std::ranges::transform(all.casters.points, points.begin(),
                         [&](const Vec3& p) { return projection * p; });
  for (const auto& [a, b, c] : all.casters.triangles) {
    VisitFours(points[a], points[b], points[c], {0, size, 0, size},
               [&](int x, int y, const FourFloats& depth, const FourInts& inside) {
                 TakeNearer(depth, inside, &map.grid.depth[map.grid.Index(x, y)]);
               });
  }
  return map;
}

// The properties of a material on which the light at its vertices depends.
struct Matter {
  float wrap;
  Rgb4 per_mm2;  // 1 / scatter_mm^2 of red, green and blue

  explicit Matter(const Material& material)
      : wrap(static_cast<float>(material.wrap)), per_mm2(Rgb4::Zero()) {
    per_mm2.head<3>() = material.scatter_mm.cast<float>().array().square().inverse();
  }

  // The share of each colour that passes `thickness_mm`: half at scatter_mm, falling with the
  // square of the thickness. A smooth stand-in for scattering below the skin.
  Rgb4 Transmitted(float thickness_mm) const {
    return 1 / (1 + thickness_mm * thickness_mm * per_mm2);
  }
};

// A vertex as the lights meet it.
struct LitPlace {
  Eigen::Vector3f above = Eigen::Vector3f::Zero();  // mm, relative to the middle of the box
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  float texel_mm = 0;

  // Lies 1.5 texels above the surface, so that the surface does not shade itself.
  LitPlace(const SceneVertex& vertex, const Vec3& middle, double texel)
      : above((vertex.position - middle).cast<float>() +
              static_cast<float>(1.5 * texel) * vertex.normal),
        normal(vertex.normal),
        texel_mm(static_cast<float>(texel)) {}
};

// The share of light that arrives, interpolated between the four texels around the place: 1 in the
// open, towards 0 behind matter.
Rgb4 LightThrough(const ShadowMap& map, const LitPlace& place, const Matter& matter) {
  const DepthGrid& grid = map.grid;
  const Eigen::Vector3f at = map.grid_from_mm * place.above;
  const float last_column = static_cast<float>(grid.columns - 1);
  const float last_row = static_cast<float>(grid.rows - 1);
  const float column = at[0] + 0.5F * last_column, row = at[1] + 0.5F * last_row;
  if (!(column >= 0 && row >= 0 && column < last_column && row < last_row)) {
    return Rgb4::Ones();
  }
  const int x = static_cast<int>(column), y = static_cast<int>(row);
  const float fx = column - static_cast<float>(x), fy = row - static_cast<float>(y);
  const float depth = at[2] - place.texel_mm;
  const float *const upper = &grid.depth[grid.Index(x, y)], *const lower = upper + grid.stride;
  const std::array<float, 4> thickness = {depth - upper[0], depth - upper[1], depth - lower[0],
                                          depth - lower[1]};
  if (std::max({thickness[0], thickness[1], thickness[2], thickness[3]}) <= 0) {
    return Rgb4::Ones();
  }
  const std::array<float, 4> weight = {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy};
  Rgb4 sum = Rgb4::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    sum += weight[k] * matter.Transmitted(std::max(thickness[k], 0.0F));
  }
  return sum;
}

// The share of one light that reaches the place, times its wrapped cosine. Leaves `through` as it
// is if the surface faces away.
Rgb4 ShareOfLight(const Matter& matter, const LitPlace& place, const ShadowMap& map,
                  Rgb4& through) {
  const float wrapped = (place.normal.dot(map.to_light) + matter.wrap) / (1 + matter.wrap);
  if (wrapped <= 0) {
    return Rgb4::Zero();
  }
  through = LightThrough(map, place, matter);
  return wrapped * through;
}

using MapList = std::vector<const ShadowMap*>;

SkyShare FindSkyShare(const Matter& matter, const MapList& maps, const LitPlace& place) {
  SkyShare share{.sum = Rgb4::Zero()};
  for (const ShadowMap* map : maps) {
    Rgb4 through;
    const Rgb4 part = ShareOfLight(matter, place, *map, through);
    share.sum += part;
    for (int axis = 0; axis < 3; ++axis) {
      share.along[axis] += map->to_light[axis] * part;
    }
  }
  return share;
}

void LightVertex(const Matter& matter, const LightRig& rig, const MapList& maps,
                 const LitPlace& place, const SkyShare& sky, SceneVertex& vertex) {
  Rgb4 of_sky = rig.sky_level * sky.sum;
  for (int axis = 0; axis < 3; ++axis) {
    of_sky += rig.sky_slope[axis] * sky.along[axis];
  }
  vertex.light = of_sky.head<3>() * rig.sky_colour;
  float key_all = 0, key_seen = 0;
  for (std::size_t i = 0; i < rig.lights.size(); ++i) {
    const Light& light = rig.lights[i];
    Rgb4 through = Rgb4::Constant(-1);  // stays: the surface faces away
    const Rgb4 share = ShareOfLight(matter, place, *maps[i], through);
    vertex.light += share.head<3>() * light.irradiance;
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

void LightVertices(const Scene& scene, std::span<const Material> materials, const LightRig& rig,
                   int threads, ShadowMaps& maps, FlatScene& flat) {
  const Box3 box = BoundCasters(scene);
  if (maps.of_direction.empty()) {
    maps.box = box;
    maps.casters = MakeCasters(scene, maps.Texel_mm());
  } else if (maps.box.min() != box.min() || maps.box.max() != box.max()) {
    throw std::logic_error("shadows of a scene with other meshes");
  }
  const std::vector<Matter> matter(materials.begin(), materials.end());
  std::vector<Vec3> moving(rig.lights.size());
  std::ranges::transform(rig.lights, moving.begin(), &Light::to_light);
  const MapList of_sky = FindMaps(SkyDirections(), threads, maps);
  const MapList of_lights = FindMaps(moving, threads, maps);
  const Vec3 middle = maps.box.center();
  const double texel_mm = maps.Texel_mm();
  flat.sky.resize(flat.vertices.size());
  ParallelFor(flat.vertices.size(), threads, 1024, [&](std::size_t v) {
    if (!flat.is_seen.empty() && !flat.is_seen[v]) {
      return;
    }
    const Matter& of_vertex = matter[flat.object_of_vertex[v]];
    const LitPlace place(flat.vertices[v], middle, texel_mm);
    if (std::isnan(flat.sky[v].sum[0])) {
      flat.sky[v] = FindSkyShare(of_vertex, of_sky, place);
    }
    LightVertex(of_vertex, rig, of_lights, place, flat.sky[v], flat.vertices[v]);
  });
}

}  // namespace semblance::problems
