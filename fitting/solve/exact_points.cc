// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/solve/exact_points.h"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>

#include "fitting/space/hierarchical_spline_space.h"

namespace semblance::fitting {
namespace {

constexpr DerivativeOrder kPlace = {0, 0}, kAlongU = {1, 0}, kAlongV = {0, 1};

}  // namespace

ExactEquations::ExactEquations(const HierarchicalSplineSpace& space,
                               std::span<const ExactPoint> points)
    : points_(static_cast<int>(points.size())) {
  const SplineElements elements(space);
  const auto add = [&](const Vec2& uv, DerivativeOrder order) {
    const SplineElement& element = elements[elements.At(uv)];
    const std::array<double, 16> weights =
        PatchWeights(space.shape(), PatchPointAt(space.shape(), element.patch.level, uv), order);
    const Eigen::Map<const Eigen::RowVectorXd> of_patch(weights.data(), 16);
    const Eigen::RowVectorXd of_dofs =
        element.IsIdentity() ? Eigen::RowVectorXd(of_patch) : of_patch * element.extraction;
    functionals_.push_back({.rows = element.dofs,
                            .weights = {of_dofs.begin(), of_dofs.end()},
                            .fixed = (of_patch * element.fixed).transpose()});
    return static_cast<int>(functionals_.size()) - 1;
  };
  for (int k = 0; k < points_; ++k) {
    const ExactPoint& point = points[k];
    const int place = add(point.uv, kPlace);
    for (int c = 0; c < 3; ++c) {
      equations_.push_back({place, Vec3::Unit(c), point.position[c], k});
    }
    if (point.normal.squaredNorm() > 0) {
      for (const DerivativeOrder tangent : {kAlongU, kAlongV}) {
        equations_.push_back({add(point.uv, tangent), point.normal.normalized(), 0, k});
      }
    }
  }
}

std::vector<Vec3> ExactEquations::At(const ControlNet& values) const {
  std::vector<Vec3> at;
  for (const Functional& functional : functionals_) {
    Vec3 sum = functional.fixed;
    for (std::size_t n = 0; n < functional.rows.size(); ++n) {
      sum += functional.weights[n] * values.vertices[functional.rows[n]];
    }
    at.push_back(sum);
  }
  return at;
}

double ExactEquations::Miss(const Equation& equation, std::span<const Vec3> at) const {
  return equation.along.dot(at[equation.functional]) - equation.value;
}

// The coefficients of the functionals, one column each.
Eigen::MatrixXd ExactEquations::Rows(Eigen::Index unknowns) const {
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(unknowns, std::ssize(functionals_));
  for (Eigen::Index f = 0; f < rows.cols(); ++f) {
    for (std::size_t n = 0; n < functionals_[f].rows.size(); ++n) {
      rows(functionals_[f].rows[n], f) += functionals_[f].weights[n];
    }
  }
  return rows;
}

// The multipliers with which all equations hold. gram: products of the functionals through H^-1.
// The equations are scaled to 1 on the diagonal, because places and tangents differ by orders of
// magnitude.
Eigen::VectorXd ExactEquations::Forces(const Eigen::MatrixXd& gram,
                                       std::span<const Vec3> at) const {
  // Equations closer than this are dependent; round-off is 1e-15.
  constexpr double kDependent = 1e-11;
  const Eigen::Index count = std::ssize(equations_);
  Eigen::VectorXd scale(count), misses(count);
  for (Eigen::Index e = 0; e < count; ++e) {
    const int f = equations_[e].functional;
    scale[e] = 1 / std::sqrt(std::max(gram(f, f), 1e-300));
    misses[e] = scale[e] * Miss(equations_[e], at);
  }
  Eigen::MatrixXd system(count, count);
  for (Eigen::Index e = 0; e < count; ++e) {
    for (Eigen::Index g = 0; g < count; ++g) {
      system(e, g) = scale[e] * scale[g] * equations_[e].along.dot(equations_[g].along) *
                     gram(equations_[e].functional, equations_[g].functional);
    }
  }
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver;
  solver.setThreshold(kDependent);
  return solver.compute(system).solve(misses).cwiseProduct(scale);
}

Eigen::MatrixX3d ExactEquations::ConstrainStep(const SparseFactor& factor, const ControlNet& values,
                                               const Eigen::MatrixX3d& step) const {
  const Eigen::MatrixXd rows = Rows(step.rows()), ways = factor.Solve(rows);
  ControlNet after = values;
  for (std::size_t k = 0; k < after.vertices.size(); ++k) {
    after.vertices[k] += step.row(static_cast<Eigen::Index>(k)).transpose();
  }
  const Eigen::VectorXd forces = Forces(rows.transpose() * ways, At(after));
  Eigen::MatrixX3d bent = step;
  for (Eigen::Index e = 0; e < forces.size(); ++e) {
    bent -= forces[e] * ways.col(equations_[e].functional) * equations_[e].along.transpose();
  }
  return bent;
}

std::vector<double> ExactEquations::Misses(const ControlNet& values) const {
  const std::vector<Vec3> at = At(values);
  std::vector<double> misses(static_cast<std::size_t>(points_), 0);
  for (const Equation& equation : equations_) {
    double& miss = misses[static_cast<std::size_t>(equation.point)];
    miss = std::max(miss, std::abs(Miss(equation, at)));
  }
  return misses;
}

}  // namespace semblance::fitting
