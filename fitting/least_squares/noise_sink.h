// SPDX-License-Identifier: GPL-3.0-or-later
// Random numbers of a normal distribution, and what they make of the rows of a least-squares
// problem.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <random>
#include <span>

#include "fitting/least_squares/row_sink.h"

namespace semblance {

// Mean 0, variance 1 (Box & Muller 1958); the same on every machine.
class GaussianRandom {
 public:
  explicit GaussianRandom(std::uint64_t random_seed) : bits_(random_seed) {}
  double operator()() {
    const double r = std::sqrt(-2 * std::log(1 - Uniform()));
    return r * std::cos(2 * std::numbers::pi * Uniform());
  }

 private:
  double Uniform() { return static_cast<double>(bits_() >> 11) * 0x1p-53; }

  std::mt19937_64 bits_;
};

// Sum of A^T z over the rows, z random of unit variance: its covariance is that of the rows' normal
// matrix (perturb and solve; Papandreou & Yuille 2010).
class NoiseSink final : public RowSink {
 public:
  NoiseSink(Eigen::Index vertices, GaussianRandom& normal)
      : normal_(normal), sum_(Eigen::MatrixX3d::Zero(vertices, 3)) {}

  void Add(std::shared_ptr<const Eigen::MatrixXd> a, Rows3 /*b*/,
           std::span<const int> vertices) override {
    Rows3 noise(a->rows(), 3);
    for (Eigen::Index k = 0; k < noise.size(); ++k) {
      noise(k / 3, k % 3) = normal_();
    }
    const Eigen::MatrixX3d pull = a->transpose() * noise;
    for (std::size_t k = 0; k < vertices.size(); ++k) {
      sum_.row(vertices[k]) += pull.row(static_cast<Eigen::Index>(k));
    }
  }
  const Eigen::MatrixX3d& Sum() const { return sum_; }  // vertices x 3

 private:
  GaussianRandom& normal_;
  Eigen::MatrixX3d sum_;
};

}  // namespace semblance
