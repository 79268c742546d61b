// SPDX-License-Identifier: GPL-3.0-or-later
// Generalised cross-validation: its score, and the estimate of the trace that the score needs.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>

#include "surfaces/base/geometry.h"
#include "surfaces/base/random.h"

namespace semblance::fitting {

// misfit / (1 - trace / count)^2, which is least where each point is best predicted by the others
// (Craven & Wahba 1979). misfit: sum or mean of the squared residuals, negative only by round-off;
// trace: trace of the influence matrix; count: number of points. Returns NaN if the share 1 - trace
// / count of free directions is at most `least_left`, because so small a share is round-off or the
// error of the trace's estimate.
inline double CrossValidationScore(double misfit, double trace, double count,
                                   double least_left = 1e-6) {
  const double left = 1 - trace / count;
  return left > least_left ? std::max(misfit, 0.0) / (left * left) : kNaN;
}

// Directions that estimate the trace of a matrix from its products with them: random signs
// (Hutchinson 1990), or all unit vectors for few unknowns, which give the exact trace.
class TraceProbes {
 public:
  TraceProbes() = default;
  TraceProbes(Eigen::Index unknowns, int count) : is_exact_(unknowns <= kExact) {
    if (is_exact_) {
      directions_ = Eigen::MatrixXd::Identity(unknowns, unknowns);
      return;
    }
    constexpr std::uint64_t kRandomSeed = 1;
    Random random(kRandomSeed);
    directions_.resize(unknowns, count);
    for (Eigen::Index k = 0; k < directions_.size(); ++k) {
      directions_(k / count, k % count) = random.Sign();
    }
  }

  // One direction per column.
  const Eigen::MatrixXd& directions() const { return directions_; }

  // Estimates the trace. images: the matrix times the directions.
  double Estimate(const Eigen::MatrixXd& images) const {
    const double sum = directions_.cwiseProduct(images).sum();
    return is_exact_ ? sum : sum / static_cast<double>(directions_.cols());
  }

 private:
  static constexpr Eigen::Index kExact = 256;  // most unknowns for an exact trace, for speed

  bool is_exact_ = false;
  Eigen::MatrixXd directions_;
};

}  // namespace semblance::fitting
