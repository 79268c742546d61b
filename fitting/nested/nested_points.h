// SPDX-License-Identifier: GPL-3.0-or-later
// The points of a nested fit, as displacements from where the surface starts.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "fitting/nested/grid_values.h"
#include "fitting/problem/fit_target.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

// Points that a fit may take apart.
struct OwnedPoints {
  std::vector<Vec3> positions;       // mm
  std::vector<Vec2> uv;              // in [0,1] x [0,1], one per point
  std::vector<double> weights = {};  // > 0, one per point; or none: all 1

  ScatteredPoints View() const { return {positions, uv, weights}; }
};

// A point that was given before: at the same (u,v), in the same place and with the same weight.
struct RepeatedPoint {
  std::uint32_t given = 0;  // its index
  std::uint32_t first = 0;  // of the one that stands for it
  double weight = 1;
};

// Sorted along a Z-curve, so that points that follow each other are neighbours; their order as
// given has no effect. Only directions in which some point is off the start are channels: a height
// field over its plane has one. A point that was given several times is here once, for copies tell
// nothing of noise. All that a point takes is its (u,v), its displacement and an index: 44 bytes.
struct NestedPoints {
  std::vector<Vec2> uv;        // in [0,1] x [0,1], as given
  Vec2 patches = {1, 1};       // of level 0
  bool periodic_u = false;     // u = 1 is u = 0
  std::vector<double> weight;  // > 0; or none: all 1
  double mean_weight = 1;      // of those that count (TakeMeanWeight)
  bool weighted = false;       // some weigh more than others
  std::vector<Vec3> value;     // displacement along each channel's axis, mm; zero beyond those
  std::vector<std::uint32_t> given;
  std::vector<RepeatedPoint> repeated;  // that are not among these
  int channels = 0;
  Eigen::Matrix<double, 3, Eigen::Dynamic> axes{3, 0};  // orthonormal, a column per channel

  std::size_t size() const { return uv.size(); }
  std::size_t GivenSize() const { return uv.size() + repeated.size(); }
  // Where it is, in patches of level 0: to the bit what PatchPointAt makes of (u,v).
  double X(std::size_t k) const {
    return periodic_u && uv[k].x() == 1 ? 0 : uv[k].x() * patches.x();
  }
  double Y(std::size_t k) const { return uv[k].y() * patches.y(); }
  double Weight(std::size_t k) const { return weight.empty() ? 1 : weight[k]; }
  // 1 for a point of mean weight. A weight is 1 / sigma^2 up to a factor, so that errors times this
  // are of one size if the points' sigma are right.
  double Scale(std::size_t k) const {
    return weight.empty() ? 1 : std::sqrt(weight[k] / mean_weight);
  }
  // left_out: per point, not 0 for one that does not count; or none.
  void TakeMeanWeight(const std::vector<char>& left_out);
};

NestedPoints DisplacementsFrom(const HSplineSurface& start, const ScatteredPoints& points,
                               int threads);
// The same in the memory of the points, which are taken apart.
NestedPoints TakeDisplacements(const HSplineSurface& start, OwnedPoints points, int threads);

// Which points take part: one in `every`, but for those left out.
struct PointChoice {
  std::size_t every = 1;
  std::vector<char> left_out = {};  // per point, not 0 for one that is; or none

  bool Has(std::size_t k) const { return left_out.empty() || left_out[k] == 0; }
  std::size_t Count(const NestedPoints& points) const {
    std::size_t count = 0;
    for (std::size_t k = 0; k < points.size(); k += every) {
      count += Has(k) ? 1 : 0;
    }
    return count;
  }
};

// The (u,v) in the order in which they were given.
std::vector<Vec2> UvAsGiven(NestedPoints points);

// A point's patch on a level, by x and y in patches of level 0.
inline std::array<int, 2> PatchOn(const PatchGrid& grid, int level, double x, double y) {
  const double scale = 1 << level;
  return {std::clamp(static_cast<int>(x * scale), 0, grid.patches_u - 1),
          std::clamp(static_cast<int>(y * scale), 0, grid.patches_v - 1)};
}

}  // namespace semblance
