// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/schemes/outside_rule.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "interp/schemes/simple_schemes.h"
#include "surfaces/base/error.h"
#include "surfaces/base/geometry.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::interp {
namespace {

struct Depth {
  double mm = kNaN;
  double sd_mm = kNaN;
};

Depth SiteDepth(const std::string& site, std::span<const Dowel> dowels, const RunContext& run) {
  const auto it = std::ranges::find(dowels, site, &Dowel::site);
  if (it != dowels.end()) {
    return {it->depth_mm, it->sd_mm};
  }
  const double mean = MeanDepth(dowels);
  run.Report("outside rule",
             fmt::format("no dowel at '{}'; the mean depth of all dowels, {:.2f} mm, is used "
                         "instead",
                         site, mean));
  return {mean, kNaN};
}

// A triangle of the network with a sphere around it, which avoids most closest-point computations.
struct NetworkTriangle {
  std::array<Vec3, 3> base;
  Vec3 depth_mm;
  Vec3 sd_mm;
  Vec3 center;
  double radius_mm = 0;
};

std::vector<NetworkTriangle> MakeTriangles(const DepthInput& input) {
  std::vector<NetworkTriangle> triangles;
  for (const std::array<int, 3>& area : input.network.areas) {
    NetworkTriangle triangle;
    for (int k = 0; k < 3; ++k) {
      const Dowel& dowel = input.dowels[area[k]];
      triangle.base[k] = dowel.base;
      triangle.depth_mm[k] = dowel.depth_mm;
      triangle.sd_mm[k] = dowel.sd_mm;
    }
    triangle.center = (triangle.base[0] + triangle.base[1] + triangle.base[2]) / 3;
    for (const Vec3& base : triangle.base) {
      triangle.radius_mm = std::max(triangle.radius_mm, (base - triangle.center).norm());
    }
    triangles.push_back(triangle);
  }
  return triangles;
}

struct NetworkPoint {
  double distance_mm = std::numeric_limits<double>::infinity();
  Depth depth;
};

NetworkPoint ClosestOnNetwork(const std::vector<NetworkTriangle>& triangles, const Vec3& p) {
  NetworkPoint closest;
  for (const NetworkTriangle& triangle : triangles) {
    const double reach = closest.distance_mm + triangle.radius_mm;
    if ((p - triangle.center).squaredNorm() > reach * reach) {
      continue;
    }
    const TrianglePoint on =
        ClosestPointOnTriangle(p, triangle.base[0], triangle.base[1], triangle.base[2]);
    const double distance = (p - on.position).norm();
    if (distance < closest.distance_mm) {
      closest = {distance, {on.weights.dot(triangle.depth_mm), on.weights.dot(triangle.sd_mm)}};
    }
  }
  return closest;
}

// Share of the far depth at a distance from the network.
double FarShare(double distance_mm, double tissue_mm, double blend_mm) {
  const double beyond_mm = distance_mm - tissue_mm;
  return blend_mm > 0 ? SmoothStep(beyond_mm / blend_mm) : beyond_mm > 0 ? 1 : 0;
}

Depth Mix(const Depth& a, const Depth& b, double share_of_b) {
  if (share_of_b == 0 || share_of_b == 1) {
    return share_of_b == 0 ? a : b;  // the other one may have an sd of NaN
  }
  return {(1 - share_of_b) * a.mm + share_of_b * b.mm,
          (1 - share_of_b) * a.sd_mm + share_of_b * b.sd_mm};
}

// Sets depth_at(p) at each vertex without a depth from the scheme.
void Fill(const DepthInput& input, const RunContext& run, DepthField& field,
          const std::function<Depth(const Vec3&)>& depth_at) {
  ForEachVertex(input, run, [&](std::size_t i) {
    if (field.status[i] != DepthStatus::kAssigned) {
      const Depth depth = depth_at(input.skull.points[i]);
      field.depth_mm[i] = depth.mm;
      field.sd_mm[i] = depth.sd_mm;
    }
  });
}

void Apply(const ExtendNetwork& rule, const DepthInput& input, const RunContext& run,
           DepthField& field) {
  const Depth far = SiteDepth(rule.site, input.dowels, run);
  const std::vector<NetworkTriangle> triangles = MakeTriangles(input);
  const double tissue_mm = MeanDepth(input.dowels);
  Fill(input, run, field, [&](const Vec3& p) {
    const NetworkPoint near = ClosestOnNetwork(triangles, p);
    return Mix(near.depth, far, FarShare(near.distance_mm, tissue_mm, rule.blend_mm));
  });
}

void Apply(const ConstantDepth& rule, const DepthInput& input, const RunContext& run,
           DepthField& field) {
  const Depth depth =
      rule.depth_mm ? Depth{*rule.depth_mm, kNaN} : SiteDepth(rule.site, input.dowels, run);
  Fill(input, run, field, [&](const Vec3&) { return depth; });
}

void Apply(const LeaveUnassigned&, const DepthInput& input, const RunContext& run,
           DepthField& field) {
  Fill(input, run, field, [](const Vec3&) { return Depth{}; });
}

void CheckField(const DepthInput& input, const DepthField& field) {
  const std::size_t vertices = input.skull.points.size();
  for (const std::size_t size : {field.depth_mm.size(), field.status.size(), field.sd_mm.size()}) {
    if (size != vertices) {
      throw InputError(fmt::format(
          "depth field: {} entries for {} vertices; it must be of this skull", size, vertices));
    }
  }
}

}  // namespace

DepthField ApplyOutsideRule(const OutsideRule& rule, const DepthInput& input, DepthField field,
                            const RunContext& run) {
  CheckDepthInput(input);
  CheckField(input, field);
  std::visit([&](const auto& options) { Apply(options, input, run, field); }, rule);
  return field;
}

}  // namespace semblance::interp
