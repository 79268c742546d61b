// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/emitters/emitter_triangle.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "surfaces/base/error.h"

namespace semblance::surfaces {
namespace {

// A triangle with the depths of its corners.
struct DeepTriangle {
  std::array<Vec3, 3> corner;
  std::array<double, 3> depth_mm;

  double MeanDepth() const { return (depth_mm[0] + depth_mm[1] + depth_mm[2]) / 3; }
  Vec3 AreaVector() const { return 0.5 * (corner[1] - corner[0]).cross(corner[2] - corner[0]); }
};

// The gradient of the depth in the plane, divided by the mean depth.
Vec3 RelativeSlope(const DeepTriangle& t, const Vec3& normal, double area_mm2) {
  Vec3 sum = Vec3::Zero();
  for (int c = 0; c < 3; ++c) {
    sum += t.depth_mm[c] * normal.cross(t.corner[(c + 2) % 3] - t.corner[(c + 1) % 3]);
  }
  return sum / (2 * area_mm2 * t.MeanDepth());
}

EmitterTriangle MakeTriangle(const DeepTriangle& t, EmitterDepth depth) {
  EmitterTriangle e;
  e.a = t.corner[0];
  e.b = t.corner[1];
  e.c = t.corner[2];
  e.centroid = (e.a + e.b + e.c) / 3;
  const Vec3 area_vector = t.AreaVector();
  e.area_mm2 = area_vector.norm();
  e.normal = area_vector / e.area_mm2;
  e.depth_mm = t.MeanDepth();
  e.longest2_mm2 =
      std::max({(e.b - e.a).squaredNorm(), (e.c - e.b).squaredNorm(), (e.a - e.c).squaredNorm()});
  e.edge_normal_a = (e.b - e.a).cross(e.normal);
  e.edge_normal_b = (e.c - e.b).cross(e.normal);
  e.edge_normal_c = (e.a - e.c).cross(e.normal);
  if (depth == EmitterDepth::kLinear) {
    const auto [least, most] = std::minmax_element(t.depth_mm.begin(), t.depth_mm.end());
    e.least_share = *least / e.depth_mm;
    e.most_share = *most / e.depth_mm;
    e.slope = RelativeSlope(t, e.normal, e.area_mm2);
  }
  return e;
}

// Appends the triangle, or its quarters if the depth is linear and changes much.
void AppendEmitters(const DeepTriangle& t, EmitterDepth depth,
                    std::vector<EmitterTriangle>& emitters) {
  constexpr double kMaxChange = 0.15;  // of the mean depth; bounds the error of the second-order
                                       // formulas, against more emitters
  const auto [least, most] = std::minmax_element(t.depth_mm.begin(), t.depth_mm.end());
  if (depth == EmitterDepth::kMean || *most - *least <= kMaxChange * t.MeanDepth()) {
    emitters.push_back(MakeTriangle(t, depth));
    return;
  }
  DeepTriangle middle;
  for (int c = 0; c < 3; ++c) {
    middle.corner[c] = 0.5 * (t.corner[(c + 1) % 3] + t.corner[(c + 2) % 3]);
    middle.depth_mm[c] = 0.5 * (t.depth_mm[(c + 1) % 3] + t.depth_mm[(c + 2) % 3]);
  }
  AppendEmitters(middle, depth, emitters);
  for (int c = 0; c < 3; ++c) {
    DeepTriangle quarter = middle;
    quarter.corner[c] = t.corner[c];
    quarter.depth_mm[c] = t.depth_mm[c];
    std::swap(quarter.corner[(c + 1) % 3], quarter.corner[(c + 2) % 3]);
    std::swap(quarter.depth_mm[(c + 1) % 3], quarter.depth_mm[(c + 2) % 3]);
    AppendEmitters(quarter, depth, emitters);
  }
}

double SquaredDistanceToSegment(const Vec3& p, const Vec3& u, const Vec3& v) {
  const Vec3 uv = v - u;
  const double s = std::clamp((p - u).dot(uv) / uv.squaredNorm(), 0.0, 1.0);
  return (p - u - s * uv).squaredNorm();
}

void CheckDepths(const TriMesh& skull, std::span<const double> depth_mm) {
  if (depth_mm.size() != skull.points.size()) {
    throw InputError(
        fmt::format("implicit surface: {} depths for {} vertices; one depth per vertex is needed",
                    depth_mm.size(), skull.points.size()));
  }
  for (std::size_t v = 0; v < depth_mm.size(); ++v) {
    if (depth_mm[v] <= 0 || std::isinf(depth_mm[v])) {
      throw InputError(
          fmt::format("implicit surface: the depth of vertex {} is {} mm; it must be positive, or "
                      "NaN where nothing is emitted",
                      v, depth_mm[v]));
    }
  }
}

}  // namespace

bool ProjectsOnto(const EmitterTriangle& t, const Vec3& p) {
  return (p - t.a).dot(t.edge_normal_a) <= 0 && (p - t.b).dot(t.edge_normal_b) <= 0 &&
         (p - t.c).dot(t.edge_normal_c) <= 0;
}

double SquaredDistance(const EmitterTriangle& t, const Vec3& p) {
  if (ProjectsOnto(t, p)) {
    const double h = (p - t.a).dot(t.normal);
    return h * h;
  }
  return std::min({SquaredDistanceToSegment(p, t.a, t.b), SquaredDistanceToSegment(p, t.b, t.c),
                   SquaredDistanceToSegment(p, t.c, t.a)});
}

std::vector<EmitterTriangle> MakeEmitters(const TriMesh& skull, std::span<const double> depth_mm,
                                          EmitterDepth over_triangle) {
  CheckDepths(skull, depth_mm);
  std::vector<EmitterTriangle> emitters;
  for (const Triangle& t : skull.triangles) {
    DeepTriangle deep;
    for (int c = 0; c < 3; ++c) {
      deep.corner[c] = skull.points[t[c]];
      deep.depth_mm[c] = depth_mm[t[c]];
    }
    if (std::isfinite(deep.MeanDepth()) && deep.AreaVector().norm() > 0) {
      AppendEmitters(deep, over_triangle, emitters);
    }
  }
  if (emitters.empty()) {
    throw InputError(
        "implicit surface: no triangle has a depth at all three corners, so nothing emits; give "
        "depths "
        "to neighbouring vertices");
  }
  return emitters;
}

}  // namespace semblance::surfaces
