// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/barycentric.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "surfaces/error.h"
#include "surfaces/point_triangle.h"

namespace semblance {
namespace {

// Relative. A vertex on a shared cutting plane must be in one of its areas in spite of rounding,
// and a plane closer than this to a degenerate one has no direction left to trust.
constexpr double kTolerance = 1e-9;

// Row k of `inside` is the cutting plane opposite corner k: 0 on the plane, 1 at corner k.
//
// These three values give the projection without the centre p_c: all three vanish in p_c, so p =
// p_c
// + sum_k inside_k(p) (base_k - p_c), and the line from p_c through p meets the plane of the bases
// at the barycentric coordinates inside_k(p) / sum. If the planes have a common direction instead
// (det M = 0), going along it changes no inside_k and the sum is 1: the same formula, so nothing
// has to be tested against zero and nothing is lost near it.
struct DowelArea {
  std::array<Vec3, 3> base;
  Mat3 inside;
  Vec3 offset;
  Vec3 unit_normal;
  Vec3 mean_direction;  // unit
  Vec3 depth_mm;
  Vec3 sd_mm;
};

std::string Title(const std::array<const Dowel*, 3>& dowels) {
  return fmt::format("dowel network: area {} {} {}", dowels[0]->site, dowels[1]->site,
                     dowels[2]->site);
}

// The cutting plane of d[i], d[j], as a normal with value 1 at d[k].
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

// Twice the triangle's area along its normal.
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

DowelArea MakeArea(const std::array<const Dowel*, 3>& d) {
  DowelArea area;
  area.unit_normal = TriangleNormal(d).normalized();
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    const Vec3 plane = CuttingPlane(d, i, j, k);
    area.base[k] = d[k]->base;
    area.inside.row(k) = plane;
    area.offset[k] = -plane.dot(d[i]->base);
    area.depth_mm[k] = d[k]->depth_mm;
    area.sd_mm[k] = d[k]->sd_mm;
  }
  const Vec3 sum = d[0]->direction + d[1]->direction + d[2]->direction;
  if (sum.norm() <= kTolerance) {
    throw InputError(fmt::format(
        "{}: the three directions cancel; correct a direction or leave the area out", Title(d)));
  }
  area.mean_direction = sum.normalized();
  return area;
}

std::vector<DowelArea> MakeAreas(const DepthInput& input) {
  if (input.network.areas.empty()) {
    throw InputError(
        "dowel network: there is no area, but barycentric depth needs at least one; place the "
        "dowels of an area, or use scheme nearest or mean");
  }
  std::vector<DowelArea> areas;
  for (const auto& [a, b, c] : input.network.areas) {
    areas.push_back(MakeArea({&input.dowels[a], &input.dowels[b], &input.dowels[c]}));
  }
  return areas;
}

// The barycentric coordinates of p's projection, if p is inside the three cutting planes.
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
    return std::nullopt;  // in p_c itself, which has no projection
  }
  return inside / sum;
}

double Distance(const DowelArea& area, AreaDistance distance, const Vec3& p) {
  if (distance == AreaDistance::kPlane) {
    return std::abs(area.unit_normal.dot(p - area.base[0]));
  }
  return (p - ClosestPointOnTriangle(p, area.base[0], area.base[1], area.base[2]).position).norm();
}

struct Membership {
  const DowelArea* area = nullptr;
  Vec3 weights;
};

Membership FindArea(const std::vector<DowelArea>& areas, AreaDistance distance, const Vec3& p) {
  Membership found;
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

}  // namespace

DepthField InterpolateDepth(const Barycentric& options, const DepthInput& input,
                            const RunContext& run) {
  CheckDepthInput(input);
  const std::vector<DowelArea> areas = MakeAreas(input);
  DepthField field = EmptyDepthField(input.skull.points.size());
  ForEachVertex(input, run, [&](std::size_t i) {
    const Membership in = FindArea(areas, options.distance, input.skull.points[i]);
    if (in.area == nullptr) {
      return;
    }
    if (!Faces(input.normals[i], in.area->mean_direction, options.max_angle_deg)) {
      field.status[i] = DepthStatus::kNotFacing;
      return;
    }
    field.status[i] = DepthStatus::kAssigned;
    field.depth_mm[i] = in.weights.dot(in.area->depth_mm);
    field.sd_mm[i] = in.weights.dot(in.area->sd_mm);
  });
  return field;
}

}  // namespace semblance
