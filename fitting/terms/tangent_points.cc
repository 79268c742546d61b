// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/terms/tangent_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "fitting/least_squares/linear_cost.h"
#include "fitting/least_squares/qr_compression.h"
#include "fitting/terms/term_cost.h"

namespace semblance::fitting {
namespace {

// Points of one element that are summed together. It bounds memory: 19 MB as rows of 48 columns.
constexpr std::size_t kRunPoints = 16384;

using ColumnPerPoint = Eigen::Matrix<double, 16, Eigen::Dynamic>;
constexpr std::array<std::pair<int, int>, 6> kTangentPairs = {
    {{0, 0}, {1, 0}, {1, 1}, {2, 0}, {2, 1}, {2, 2}}};  // pairs of coordinates

// weights * diag(factors) * weights^T, over the element's dofs.
Eigen::MatrixXd GramOver(const SplineElement& element, const ColumnPerPoint& weights,
                         const Eigen::VectorXd& factors) {
  const Eigen::Matrix<double, 16, 16> gram = weights * factors.asDiagonal() * weights.transpose();
  return element.IsIdentity() ? Eigen::MatrixXd(gram)
                              : element.extraction.transpose() * gram * element.extraction;
}

}  // namespace

Vec3 NormalBefore(const LevelView& view, const Vec2& uv) {
  const Vec3 du = view.PointAt(uv, view.start, {1, 0}), dv = view.PointAt(uv, view.start, {0, 1}),
             normal = du.cross(dv);
  const bool none = normal.norm() <= 1e-12 * (du.squaredNorm() + dv.squaredNorm());
  return none ? Vec3(Vec3::Zero()) : normal.normalized();
}

TangentSums::TangentSums(const TangentPointTerm& term, const LevelView& view)
    : view_(view), scale_(term.weight / view.WeightSum()), tangential_(term.tangential) {
  normals_.reserve(view.observations.size());
  for (const Observation& o : view.observations) {
    const int element = view.LocalAt(o.uv).element;
    if (runs_.empty() || runs_.back().element != element ||
        runs_.back().end - runs_.back().begin == kRunPoints) {
      runs_.push_back({element, normals_.size(), normals_.size()});
    }
    ++runs_.back().end;
    normals_.push_back(NormalBefore(view, o.uv));
  }
}

Mat3 TangentSums::MetricAt(std::size_t observation) const {
  const Vec3& n = normals_[observation];
  const double weight = scale_ * view_.observations[observation].weight;
  const double along = n.isZero(0) ? 1 : tangential_;
  return weight * (along * Mat3::Identity() + (1 - along) * n * n.transpose());
}

void TangentSums::ForEachElement(const UseSum& use) const {
  for (const Run& run : runs_) {
    const SplineElement element = view_.Element(run.element);
    use(element.dofs, RunNormalMatrix(run, element));
  }
}

Eigen::MatrixXd TangentSums::RunNormalMatrix(const Run& run, const SplineElement& element) const {
  const auto count = static_cast<Eigen::Index>(run.end - run.begin);
  ColumnPerPoint weights(16, count);
  Eigen::Matrix<double, Eigen::Dynamic, 6> factors(count, 6);
  for (Eigen::Index k = 0; k < count; ++k) {
    const LocalStencil at = view_.LocalAt(view_.observations[run.begin + k].uv);
    weights.col(k) = Eigen::Map<const Eigen::Matrix<double, 16, 1>>(at.weight.data());
    const Mat3 metric = MetricAt(run.begin + k);
    for (int p = 0; p < 6; ++p) {
      factors(k, p) = metric(kTangentPairs[p].first, kTangentPairs[p].second);
    }
  }
  const auto dofs = static_cast<Eigen::Index>(element.dofs.size());
  Eigen::MatrixXd normal(3 * dofs, 3 * dofs);
  for (int p = 0; p < 6; ++p) {
    const auto [i, j] = kTangentPairs[p];
    const Eigen::MatrixXd gram = GramOver(element, weights, factors.col(p));
    for (Eigen::Index a = 0; a < dofs; ++a) {
      for (Eigen::Index b = 0; b < dofs; ++b) {
        normal(3 * a + i, 3 * b + j) = normal(3 * a + j, 3 * b + i) = gram(a, b);
      }
    }
  }
  return normal;
}

void TangentSums::ForEachDof(const std::function<void(std::span<const int> dofs)>& use) const {
  for (const Run& run : runs_) {
    use(view_.Element(run.element).dofs);
  }
}

void TangentSums::AddDownhill(const ControlNet& net, Eigen::VectorXd& down) const {
  for (const Run& run : runs_) {
    const SplineElement element = view_.Element(run.element);
    const PatchMatrix pull = RunDownhill(run, element.Vertices(net));
    const Eigen::MatrixXd over_dofs =
        element.IsIdentity() ? Eigen::MatrixXd(pull) : element.extraction.transpose() * pull;
    for (std::size_t d = 0; d < element.dofs.size(); ++d) {
      down.segment<3>(3 * element.dofs[d]) += over_dofs.row(static_cast<Eigen::Index>(d));
    }
  }
}

PatchMatrix TangentSums::RunDownhill(const Run& run, const PatchMatrix& vertices) const {
  PatchMatrix pull = PatchMatrix::Zero();
  for (std::size_t k = run.begin; k < run.end; ++k) {
    const Observation& o = view_.observations[k];
    const LocalStencil at = view_.LocalAt(o.uv);
    const Eigen::Map<const Eigen::Matrix<double, 1, 16>> weights(at.weight.data());
    const Vec3 misfit = o.position - (weights * vertices).transpose();
    pull += weights.transpose() * (MetricAt(k) * misfit).transpose();
  }
  return pull;
}

namespace {

// The matrix that maps a misfit d to a vector of squared length (n . d)^2 + tangential |d - n (n .
// d)|^2.
Mat3 Shaping(const TangentPointTerm& term, const LevelView& view, const Vec2& uv) {
  const Vec3 n = NormalBefore(view, uv);
  if (n.isZero(0)) {
    return Mat3::Identity();
  }
  const Mat3 along = n * n.transpose();
  return along + std::sqrt(term.tangential) * (Mat3::Identity() - along);
}

// Turns rows over the coordinates of an element's vertices into rows over those of its dofs.
Eigen::MatrixXd OverDofs(const Eigen::MatrixXd& a, const SplineElement& element) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(a.rows(), 3 * element.extraction.cols());
  for (Eigen::Index dof = 0; dof < element.extraction.cols(); ++dof) {
    for (int v = 0; v < 16; ++v) {
      result.middleCols<3>(3 * dof) += element.extraction(v, dof) * a.middleCols<3>(3 * v);
    }
  }
  return result;
}

// Adds one residual block for the points of an element: three rows per point and 48 columns, then
// compressed.
void AddPatch(const TangentPointTerm& term, const LevelView& view,
              std::span<const Observation> points, double scale, ControlNet& net,
              ceres::Problem& problem) {
  Eigen::MatrixXd a(3 * points.size(), 48);
  Rows3 b = Rows3::Zero(a.rows(), 3);
  for (std::size_t k = 0; k < points.size(); ++k) {
    const LocalStencil s = view.LocalAt(points[k].uv);
    const Mat3 shape = std::sqrt(scale * points[k].weight) * Shaping(term, view, points[k].uv);
    for (int v = 0; v < 16; ++v) {
      a.block<3, 3>(3 * k, 3 * v) = s.weight[v] * shape;
    }
    b.block<3, 1>(3 * k, 0) = shape * points[k].position;
  }
  const SplineElement element = view.Element(view.LocalAt(points.front().uv).element);
  if (!element.IsIdentity()) {
    for (int v = 0; v < 16; ++v) {
      b.col(0) -= a.middleCols<3>(3 * v) * element.fixed.row(v).transpose();
    }
  }
  const LinearRows rows = CompressRows(a, b);
  AddCoupledResidual(element.IsIdentity() ? rows.a : OverDofs(rows.a, element), rows.b.col(0),
                     element.dofs, net, problem);
}

}  // namespace

void AddResiduals(const TangentPointTerm& term, const LevelView& view, ControlNet& net,
                  ceres::Problem& problem) {
  const double scale = term.weight / view.WeightSum();
  const std::span<const Observation> all(view.observations);
  const auto patch = [&](std::size_t k) { return view.LocalAt(all[k].uv).element; };
  for (std::size_t begin = 0, end = 0; begin < all.size(); begin = end) {
    while (end < all.size() && end - begin < kRunPoints && patch(end) == patch(begin)) {
      ++end;
    }
    AddPatch(term, view, all.subspan(begin, end - begin), scale, net, problem);
  }
}

double TermCost(const TangentPointTerm& term, const LevelView& view, const ControlNet& net) {
  double sum = 0;
  for (const Observation& o : view.observations) {
    const Vec3 d = view.PointAt(o.uv, net) - o.position;
    sum += o.weight * (Shaping(term, view, o.uv) * d).squaredNorm();
  }
  return view.observations.empty() ? 0 : term.weight * sum / view.WeightSum();
}

}  // namespace semblance::fitting
