// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/dowels/depth_input.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"

namespace semblance::interp {
namespace {

constexpr double kUnitTolerance = 1e-6;
constexpr std::size_t kBlock = 2048;  // vertices between two checks of the stop token

void CheckDowel(const Dowel& dowel) {
  if (!dowel.base.allFinite()) {
    throw InputError(
        fmt::format("dowel '{}': base ({}, {}, {}) is not finite; place it on the skull",
                    dowel.site, dowel.base.x(), dowel.base.y(), dowel.base.z()));
  }
  const double length = dowel.direction.norm();
  if (!(std::abs(length - 1) <= kUnitTolerance)) {
    throw InputError(
        fmt::format("dowel '{}': direction has length {}; it must be 1 (a unit vector out of the "
                    "bone); normalise it",
                    dowel.site, length));
  }
  if (!(dowel.depth_mm > 0 && std::isfinite(dowel.depth_mm))) {
    throw InputError(
        fmt::format("dowel '{}': depth is {} mm; it must be finite and above 0; set it "
                    "or leave the dowel out",
                    dowel.site, dowel.depth_mm));
  }
}

void CheckNetwork(const DepthInput& input) {
  const int count = static_cast<int>(input.dowels.size());
  for (std::size_t a = 0; a < input.network.areas.size(); ++a) {
    for (const int d : input.network.areas[a]) {
      if (d < 0 || d >= count) {
        throw InputError(fmt::format(
            "dowel network: area {} names dowel {}, but there are {} (0..{}); build the "
            "network from these dowels",
            a, d, count, count - 1));
      }
    }
  }
}

void CheckSkull(const DepthInput& input) {
  const std::size_t vertices = input.skull.points.size();
  if (input.normals.size() != vertices) {
    throw InputError(
        fmt::format("skull: {} normals for {} vertices; there must be one per vertex; compute them "
                    "from this mesh",
                    input.normals.size(), vertices));
  }
  for (std::size_t i = 0; i < vertices; ++i) {
    if (!input.skull.points[i].allFinite() || !input.normals[i].allFinite()) {
      throw InputError(
          fmt::format("skull: vertex {} or its normal is not finite; repair the mesh", i));
    }
  }
}

}  // namespace

void CheckDepthInput(const DepthInput& input) {
  if (input.dowels.empty()) {
    throw InputError("dowels: there are none, but a depth needs at least one; place dowels");
  }
  for (const Dowel& dowel : input.dowels) {
    CheckDowel(dowel);
  }
  for (const Dowel& dowel : input.expected) {
    CheckDowel(dowel);
  }
  CheckNetwork(input);
  CheckSkull(input);
}

DepthField EmptyDepthField(std::size_t vertices) {
  return {std::vector<double>(vertices, kNaN),
          std::vector<DepthStatus>(vertices, DepthStatus::kOutside),
          std::vector<double>(vertices, kNaN)};
}

void ForEachVertex(const DepthInput& input, const RunContext& run,
                   const std::function<void(std::size_t)>& body) {
  ParallelFor(input.skull.points.size(), run.threads, kBlock, [&](std::size_t i) {
    if (i % kBlock == 0) {
      run.ThrowIfStopped();
    }
    body(i);
  });
}

bool Faces(const Vec3& normal, const Vec3& direction, double max_angle_deg) {
  return max_angle_deg >= 180 ||
         normal.dot(direction) > std::cos(max_angle_deg * std::numbers::pi / 180);
}

}  // namespace semblance::interp
