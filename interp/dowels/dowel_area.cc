// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/dowels/dowel_area.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "surfaces/base/error.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::interp {
namespace {

// Relative tolerance against round-off. A vertex on a shared cutting plane must belong to one of
// its areas, and a plane closer to degeneracy than this has no reliable direction.
constexpr double kTolerance = 1e-9;

std::string Title(const std::array<const Dowel*, 3>& dowels) {
  return fmt::format("dowel network: area {} {} {}", dowels[0]->site, dowels[1]->site,
                     dowels[2]->site);
}

// The cutting plane of d[i] and d[j], scaled to the value 1 at d[k].
Vec3 CuttingPlane(const std::array<const Dowel*, 3>& d, int i, int j, int k) {
  const Vec3 edge = d[j]->base - d[i]->base;
  const Vec3 normal = (d[i]->direction + d[j]->direction).cross(edge);
  if (normal.norm() <= kTolerance * edge.norm()) {
    throw InputError(
        fmt::format("{}: the directions of {} and {} cancel or run along their edge, which leaves "
                    "no cutting plane; correct a direction or leave the area out",
                    Title(d), d[i]->site, d[j]->site));
  }
  const Vec3 to_third = d[k]->base - d[i]->base;
  const double height = normal.dot(to_third);
  if (std::abs(height) <= kTolerance * normal.norm() * to_third.norm()) {
    throw InputError(
        fmt::format("{}: the cutting plane of {} and {} runs through {}, which leaves no inside; "
                    "correct a direction or leave the area out",
                    Title(d), d[i]->site, d[j]->site, d[k]->site));
  }
  return normal / height;
}

// A normal of twice the triangle's area as length.
Vec3 TriangleNormal(const std::array<const Dowel*, 3>& d) {
  const Vec3 a = d[1]->base - d[0]->base, b = d[2]->base - d[0]->base, c = b - a;
  const Vec3 normal = a.cross(b);
  const double longest2 = std::max({a.squaredNorm(), b.squaredNorm(), c.squaredNorm()});
  if (normal.norm() <= kTolerance * longest2) {
    throw InputError(fmt::format(
        "{}: the three bases lie on one line; move a base or leave the area out", Title(d)));
  }
  return normal;
}

DowelArea MakeArea(const std::array<int, 3>& corners, std::span<const Dowel> dowels) {
  const std::array<const Dowel*, 3> d = {&dowels[corners[0]], &dowels[corners[1]],
                                         &dowels[corners[2]]};
  DowelArea area;
  area.dowels = corners;
  area.unit_normal = TriangleNormal(d).normalized();
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    const Vec3 plane = CuttingPlane(d, i, j, k);
    area.base[k] = d[k]->base;
    area.inside.row(k) = plane;
    area.offset[k] = -plane.dot(d[i]->base);
  }
  const Vec3 sum = d[0]->direction + d[1]->direction + d[2]->direction;
  if (sum.norm() <= kTolerance) {
    throw InputError(fmt::format(
        "{}: the three directions cancel; correct a direction or leave the area out", Title(d)));
  }
  area.mean_direction = sum.normalized();
  return area;
}

// The barycentric coordinates of p's projection if p is inside the three cutting planes.
std::optional<Vec3> Projection(const DowelArea& area, const Vec3& p) {
  Vec3 inside;
  for (int k = 0; k < 3; ++k) {
    inside[k] = area.inside.row(k).dot(p) + area.offset[k];
    if (inside[k] < -kTolerance) {
      return std::nullopt;
    }
  }
  inside = inside.cwiseMax(0);
  const double sum = inside.sum();
  if (sum <= kTolerance) {
    return std::nullopt;  // p is p_c, which has no projection
  }
  return inside / sum;
}

double Distance(const DowelArea& area, AreaDistance distance, const Vec3& p) {
  if (distance == AreaDistance::kPlane) {
    return std::abs(area.unit_normal.dot(p - area.base[0]));
  }
  return (p - ClosestPointOnTriangle(p, area.base[0], area.base[1], area.base[2]).position).norm();
}

}  // namespace

std::vector<DowelArea> DowelAreas(std::string_view scheme, const DepthInput& input) {
  if (input.network.areas.empty()) {
    throw InputError(
        fmt::format("dowel network: there is no area, but {} depth needs at least one; place the "
                    "dowels of an area, or use the scheme nearest or mean",
                    scheme));
  }
  std::vector<DowelArea> areas;
  for (const std::array<int, 3>& corners : input.network.areas) {
    areas.push_back(MakeArea(corners, input.dowels));
  }
  return areas;
}

AreaPoint FindArea(const std::vector<DowelArea>& areas, AreaDistance distance, const Vec3& p) {
  AreaPoint found;
  double nearest = std::numeric_limits<double>::infinity();
  for (const DowelArea& area : areas) {
    const std::optional<Vec3> weights = Projection(area, p);
    if (!weights) {
      continue;
    }
    const double d = Distance(area, distance, p);
    if (d < nearest) {
      nearest = d;
      found = {&area, *weights};
    }
  }
  return found;
}

DepthField AssignInAreas(const std::vector<DowelArea>& areas, AreaDistance distance,
                         double max_angle_deg, const DepthInput& input, const RunContext& run,
                         const std::function<double(const AreaPoint&, const Vec3&)>& depth_at) {
  DepthField field = EmptyDepthField(input.skull.points.size());
  ForEachVertex(input, run, [&](std::size_t i) {
    const AreaPoint in = FindArea(areas, distance, input.skull.points[i]);
    if (in.area == nullptr) {
      return;
    }
    if (!Faces(input.normals[i], in.area->mean_direction, max_angle_deg)) {
      field.status[i] = DepthStatus::kNotFacing;
      return;
    }
    const auto& [a, b, c] = in.area->dowels;
    field.status[i] = DepthStatus::kAssigned;
    field.depth_mm[i] = depth_at(in, input.skull.points[i]);
    field.sd_mm[i] =
        in.weights.dot(Vec3(input.dowels[a].sd_mm, input.dowels[b].sd_mm, input.dowels[c].sd_mm));
  });
  return field;
}

}  // namespace semblance::interp
