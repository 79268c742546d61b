// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/least_squares/sparse_factor.h"

#include <dlfcn.h>

#include <Eigen/CholmodSupport>
#include <Eigen/SparseCholesky>
#include <algorithm>

namespace semblance {

// Derived for the factor, which Eigen keeps to itself.
struct SparseFactor::Cholmod : Eigen::CholmodSupernodalLLT<SparseMatrix, Eigen::Lower> {
  const cholmod_factor& Factor() const { return *m_cholmodFactor; }
};

SparseFactor::SparseFactor(const SparseMatrix& lower, double shift)
    : cholmod_(std::make_unique<Cholmod>()) {
  UseOneBlasThread();
  cholmod_->cholmod().print = 0;  // what it would say is in usable()
  cholmod_->setShift(shift);
  cholmod_->compute(lower);
}

SparseFactor::~SparseFactor() = default;

bool SparseFactor::usable() const { return cholmod_->info() == Eigen::Success; }

Eigen::MatrixXd SparseFactor::Solve(const Eigen::MatrixXd& right) const {
  return cholmod_->solve(right);
}

// Supernode s holds columns super[s] .. super[s + 1] - 1 as one dense block.
Eigen::VectorXd SparseFactor::Pivots() const {
  const cholmod_factor& factor = cholmod_->Factor();
  const auto* const super = static_cast<const int*>(factor.super);
  const auto* const rows = static_cast<const int*>(factor.pi);
  const auto* const start = static_cast<const int*>(factor.px);
  const auto* const values = static_cast<const double*>(factor.x);
  Eigen::VectorXd pivots(static_cast<Eigen::Index>(factor.n));
  for (std::size_t s = 0; s < factor.nsuper; ++s) {
    const int height = rows[s + 1] - rows[s];
    for (int k = 0; k < super[s + 1] - super[s]; ++k) {
      const double diagonal = values[start[s] + k * (height + 1)];
      pivots[super[s] + k] = diagonal * diagonal;
    }
  }
  return pivots;
}

Eigen::VectorXd Pivots(const SparseMatrix& lower, double shift, double enough) {
  const SparseFactor factor(lower, shift);
  if (factor.usable() && factor.Pivots().minCoeff() > enough) {
    return factor.Pivots();
  }
  Eigen::SimplicialLDLT<SparseMatrix> signed_factor;
  signed_factor.setShift(shift);
  signed_factor.compute(lower);
  return signed_factor.vectorD();
}

namespace {

// The whole normal matrix with its columns scaled to 1 on the diagonal, which leaves the rank.
SparseMatrix Scaled(const SparseMatrix& lower) {
  const Eigen::VectorXd d = lower.diagonal();
  const Eigen::VectorXd scale =
      (d.array() > 0).select(d.array().max(1e-300).rsqrt(), Eigen::ArrayXd::Zero(d.size()));
  return scale.asDiagonal() * lower * scale.asDiagonal();
}

}  // namespace

// Pivots of the scaled normal equations that stand out of a shift, which keeps the others from
// being zero. A pivot just above the threshold leaves shift / threshold in the next one, so the
// threshold is above the root of the shift.
int NumericalRank(const SparseMatrix& lower, std::size_t rows) {
  constexpr double kIndependent = 1e-6;
  const Eigen::VectorXd pivots = Pivots(Scaled(lower), 1e-13, kIndependent);
  return static_cast<int>(std::min<Eigen::Index>((pivots.array() > kIndependent).count(), rows));
}

void UseOneBlasThread() {
  static const bool done = [] {
    using SetThreads = void (*)(int);
    void* const symbol = dlsym(RTLD_DEFAULT, "openblas_set_num_threads");
    if (symbol != nullptr) {
      reinterpret_cast<SetThreads>(symbol)(1);
    }
    return true;
  }();
  static_cast<void>(done);
}

}  // namespace semblance
