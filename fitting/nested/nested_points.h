// SPDX-License-Identifier: GPL-3.0-or-later
// The points of a nested fit, as displacements from the start surface.
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

namespace semblance::fitting {

// Points whose memory a fit may reuse.
struct OwnedPoints {
  std::vector<Vec3> positions;       // mm
  std::vector<Vec2> uv;              // in [0,1] x [0,1], one per point
  std::vector<double> weights = {};  // > 0, one per point; empty: all 1

  ScatteredPoints View() const { return {positions, uv, weights}; }
};

// A copy of a point, with the same weight. An exact copy has the same (u,v) and position. The
// others lie so close by that they are a second export of the point (SeparateTwins).
struct RepeatedPoint {
  std::uint32_t given = 0;  // given index of the copy
  std::uint32_t first = 0;  // given index of the original
  double weight = 1;
  bool is_exact = true;
  Vec2 uv = Vec2::Zero();     // as NestedPoints::uv
  Vec3 value = Vec3::Zero();  // as NestedPoints::value
};

// Points sorted along a Z-curve, so that consecutive points are neighbours and the given order has
// no effect. A channel is a direction along which some point differs from the start: a height field
// over its plane has one channel. Copies of a point are kept apart, because they would look like
// points without noise. A point takes 44 bytes: (u,v), displacement and index.
struct NestedPoints {
  std::vector<Vec2> uv;                 // in [0,1] x [0,1], as given
  Vec2 patches = {1, 1};                // numbers of patches of level 0
  bool periodic_u = false;              // u = 1 is u = 0
  std::vector<double> weight;           // > 0; empty: all 1
  double mean_weight = 1;               // of the points that count (UpdateMeanWeight)
  bool weighted = false;                // the weights differ
  std::vector<Vec3> value;              // displacement per channel, mm; 0 beyond the last channel
  std::vector<std::uint32_t> given;     // given index of each point
  std::vector<RepeatedPoint> repeated;  // copies, which are not in the arrays above
  int measured_twice = 0;  // points at the places of others that are no copies, as all points count
  double lattice_mm =
      0;  // all z are whole multiples of it apart (FindLatticeStep); 0: they are not
  int channels = 0;
  Eigen::Matrix<double, 3, Eigen::Dynamic> axes{3, 0};  // orthonormal, a column per channel

  std::size_t size() const { return uv.size(); }
  std::size_t GivenSize() const { return uv.size() + repeated.size(); }
  // The place of point k in patches of level 0; bit-identical to PatchPointAt.
  double X(std::size_t k) const {
    return periodic_u && uv[k].x() == 1 ? 0 : uv[k].x() * patches.x();
  }
  double Y(std::size_t k) const { return uv[k].y() * patches.y(); }
  double Weight(std::size_t k) const { return weight.empty() ? 1 : weight[k]; }
  // sqrt(weight / mean weight). A weight is proportional to 1 / sigma^2, so errors times this
  // factor have the same size if the points' sigma are right.
  double Scale(std::size_t k) const {
    return weight.empty() ? 1 : std::sqrt(weight[k] / mean_weight);
  }
  // Sets mean_weight over the points with left_out 0; left_out: per point, or empty.
  void UpdateMeanWeight(const std::vector<char>& left_out);
};

// The usual distance from a point to the next one on the curve, in patches of level 0. It is the
// 90th percentile over 64 points around, so that copies of points do not make it small.
class CurveSteps {
 public:
  explicit CurveSteps(const NestedPoints& points);
  double At(std::size_t k) const { return steps_[k / kBlock]; }

 private:
  static constexpr std::size_t kBlock = 64;
  std::vector<double> steps_;  // per block of the curve
};

// The distance of two points in patches of level 0.
inline double PlaceDistance(const NestedPoints& points, std::size_t a, std::size_t b) {
  const double dx = points.X(a) - points.X(b), dy = points.Y(a) - points.Y(b);
  return std::sqrt(dx * dx + dy * dy);
}

// Makes the points of a nested fit from a copy of the given points. Copies count once:
// - exact copies;
// - points nearer to another than a thousandth of the points' spacing, whose displacements differ
// by
//   less than a thousandth of the range around them;
// - points nearer than a twentieth of the spacing, if such points and near copies are at least a
//   sixth of all points and most differ from their neighbour by less than half of the noise. They
//   then share its error, as in a second export or twins of stations, and would make the noise look
//   smaller. Points that were measured twice stay.
NestedPoints DisplacementsFrom(const HSplineSurface& start, const ScatteredPoints& points,
                               int threads);
// Makes the points of a nested fit in the memory of the given points.
NestedPoints TakeDisplacements(const HSplineSurface& start, OwnedPoints points, int threads);

// A choice of points: one in `every`, except those left out.
struct PointChoice {
  std::size_t every = 1;
  std::vector<char> left_out = {};  // per point, 0: it takes part; empty: all do

  bool Has(std::size_t k) const { return left_out.empty() || left_out[k] == 0; }
  std::size_t Count(const NestedPoints& points) const {
    std::size_t count = 0;
    for (std::size_t k = 0; k < points.size(); k += every) {
      count += Has(k) ? 1 : 0;
    }
    return count;
  }
};

// The (u,v) in the given order, including those of copies.
std::vector<Vec2> UvAsGiven(NestedPoints points);

// The patch of a level that contains the place (x, y), in patches of level 0.
inline std::array<int, 2> PatchOn(const PatchGrid& grid, int level, double x, double y) {
  const double scale = 1 << level;
  return {std::clamp(static_cast<int>(x * scale), 0, grid.patches_u - 1),
          std::clamp(static_cast<int>(y * scale), 0, grid.patches_v - 1)};
}

}  // namespace semblance::fitting
