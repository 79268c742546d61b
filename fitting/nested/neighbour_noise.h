// SPDX-License-Identifier: GPL-3.0-or-later
// Noise from the points alone, and what is left of it between neighbours.
#pragma once

#include <cstdint>
#include <span>

#include "fitting/nested/leaf_sums.h"

namespace semblance {

enum class NeighbourModel { kPlaneOf8, kQuadraticOf20 };

// Standard deviation of a point of mean weight along one axis: a plane or quadratic through each of
// some thousand points and its neighbours in (u,v), by least squares, and the median of what that
// leaves per degree of freedom. Detail that neighbours do not share is in it, the more of it the
// wider the neighbourhood. NaN for too few points.
double NeighbourNoise(const NestedPoints& points, std::span<const std::uint32_t> indices,
                      NeighbourModel model);

// Of pairs of residuals, each times its point's Scale: the sum of e_a . e_b over that of |e|^2. 0
// for errors that do not know of each other.
class PairCorrelation {
 public:
  void Add(const NestedResidual& a, const NestedResidual& b);
  double Value() const { return squares_ > 0 ? together_ / squares_ : 0; }
  // The standard error is 1 / sqrt(Count()), or less.
  std::size_t Count() const { return count_; }

 private:
  double together_ = 0, squares_ = 0;
  std::size_t count_ = 0;
};

// Of that tenth of the pairs of neighbours along the curve whose points are closest to each other
// in (u,v).
PairCorrelation ClosestCorrelation(const NestedPoints& points,
                                   std::span<const std::uint32_t> indices,
                                   std::span<const NestedResidual> residuals);

}  // namespace semblance
