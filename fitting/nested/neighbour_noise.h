// SPDX-License-Identifier: GPL-3.0-or-later
// Estimates of the noise from the points alone, and the correlation of neighbours' residuals.
#pragma once

#include <cstdint>
#include <span>

#include "fitting/nested/leaf_sums.h"
#include "fitting/nested/nested_fit.h"

namespace semblance::fitting {

enum class NeighbourModel { kPlaneOf8, kQuadraticOf20 };

// The standard deviation of a point of mean weight along one axis. It fits a plane or quadratic by
// least squares to each of about a thousand points and its neighbours in (u,v), and takes the
// median of the squared residuals per degree of freedom. Detail that the plane or quadratic cannot
// follow counts as noise, and more so in wider neighbourhoods. Returns NaN for too few points.
double NeighbourNoise(const NestedPoints& points, std::span<const std::uint32_t> indices,
                      NeighbourModel model);

NoiseByWeight CompareNoiseByWeight(const NestedPoints& points,
                                   std::span<const std::uint32_t> indices);

// The correlation of pairs of residuals: the sum of e_a . e_b divided by that of (|e_a|^2 +
// |e_b|^2) / 2, where each residual is multiplied by its point's Scale. Its expectation is 0 for
// independent errors.
class PairCorrelation {
 public:
  void Add(const NestedResidual& a, const NestedResidual& b);
  double Value() const { return squares_ > 0 ? together_ / squares_ : 0; }
  // The number of pairs. The standard error of Value() is at most 1 / sqrt(Count()).
  std::size_t Count() const { return count_; }

 private:
  double together_ = 0, squares_ = 0;
  std::size_t count_ = 0;
};

// The correlation over the closest tenth, in (u,v), of the pairs of neighbours along the curve.
PairCorrelation ClosestCorrelation(const NestedPoints& points,
                                   std::span<const std::uint32_t> indices,
                                   std::span<const NestedResidual> residuals);

}  // namespace semblance::fitting
