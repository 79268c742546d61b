// SPDX-License-Identifier: GPL-3.0-or-later
// The trace of a matrix of which only products are known.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "surfaces/base/random.h"

namespace semblance {

// Random directions, for an estimate (Hutchinson 1990); all directions where the unknowns are few,
// which give the trace itself.
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

  // One per column.
  const Eigen::MatrixXd& directions() const { return directions_; }

  // images: the matrix times the directions.
  double TraceOf(const Eigen::MatrixXd& images) const {
    const double sum = directions_.cwiseProduct(images).sum();
    return is_exact_ ? sum : sum / static_cast<double>(directions_.cols());
  }

 private:
  static constexpr Eigen::Index kExact = 256;

  bool is_exact_ = false;
  Eigen::MatrixXd directions_;
};

}  // namespace semblance
