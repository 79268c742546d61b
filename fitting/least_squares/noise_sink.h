// SPDX-License-Identifier: GPL-3.0-or-later
// What random normal numbers make of the rows of a least-squares problem.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>

#include "fitting/least_squares/row_sink.h"
#include "surfaces/base/random.h"

namespace semblance {

// Sum of A^T z over the rows, z random of unit variance: its covariance is that of the rows' normal
// matrix (perturb and solve; Papandreou & Yuille 2010).
class NoiseSink final : public RowSink {
 public:
  NoiseSink(Eigen::Index vertices, Random& random)
      : random_(random), sum_(Eigen::MatrixX3d::Zero(vertices, 3)) {}

  void Add(std::shared_ptr<const Eigen::MatrixXd> a, Rows3 /*b*/,
           std::span<const int> vertices) override {
    Rows3 noise(a->rows(), 3);
    for (Eigen::Index k = 0; k < noise.size(); ++k) {
      noise(k / 3, k % 3) = random_.Normal();
    }
    const Eigen::MatrixX3d pull = a->transpose() * noise;
    for (std::size_t k = 0; k < vertices.size(); ++k) {
      sum_.row(vertices[k]) += pull.row(static_cast<Eigen::Index>(k));
    }
  }
  const Eigen::MatrixX3d& Sum() const { return sum_; }  // vertices x 3

 private:
  Random& random_;
  Eigen::MatrixX3d sum_;
};

}  // namespace semblance
