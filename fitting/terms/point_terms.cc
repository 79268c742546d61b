// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/terms/point_terms.h"

#include <ceres/loss_function.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "fitting/least_squares/linear_cost.h"
#include "fitting/least_squares/qr_compression.h"
#include "fitting/terms/robust_loss.h"
#include "fitting/terms/term_cost.h"

namespace semblance {
namespace {

// A loss looks at each point by itself, so robust points are not reduced.
void AddByPoint(const PointTerm& term, const LevelView& view, ControlNet& net,
                ceres::Problem& problem) {
  const double scale = term.weight / view.WeightSum();
  for (const Observation& o : view.observations) {
    const DofStencil s = view.StencilAt(o.uv);
    const Eigen::Map<const Eigen::RowVectorXd> row(s.weight.data(), s.count);
    AddLinearResidual(std::make_shared<const Eigen::MatrixXd>(row),
                      (o.position - s.fixed).transpose(), s.dofs(),
                      MakeLoss(term, scale * o.weight), net, problem);
  }
}

// Rows of one element are given on when another begins, or when they become many.
class ElementBuffer {
 public:
  ElementBuffer(const LevelView& view, RowSink& sink) : view_(view), sink_(sink) {}

  void Add(const LocalStencil& stencil, const Vec3& position, double factor) {
    if (stencil.element != element_ || rows_.size() == kMost) {
      Flush();
      element_ = stencil.element;
    }
    Row& row = rows_.emplace_back();
    for (int k = 0; k < 16; ++k) {
      row[k] = factor * stencil.weight[k];
    }
    row.tail<3>() = factor * position;
  }

  void Flush() {
    if (rows_.empty()) {
      return;
    }
    const Eigen::Map<const Eigen::Matrix<double, 19, Eigen::Dynamic>> all(rows_.front().data(), 19,
                                                                          rows_.size());
    AddElementRows(view_.Element(element_),
                   std::make_shared<const Eigen::MatrixXd>(all.topRows<16>().transpose()),
                   all.bottomRows<3>().transpose(), sink_);
    rows_.clear();
  }

 private:
  using Row = Eigen::Matrix<double, 19, 1>;
  static constexpr std::size_t kMost = 65536;  // rows; 10 MB

  const LevelView& view_;
  RowSink& sink_;
  int element_ = -1;
  std::vector<Row> rows_;
};

// The rows of those observations that are taken.
template <class Taken>
void AddWeighted(const LevelView& view, const std::vector<Observation>& observations, double scale,
                 const Taken& taken, RowSink& sink) {
  ElementBuffer buffer(view, sink);
  for (const Observation& o : observations) {
    if (taken(o)) {
      buffer.Add(view.LocalAt(o.uv), o.position, std::sqrt(scale * o.weight));
    }
  }
  buffer.Flush();
}

}  // namespace

std::unique_ptr<ceres::LossFunction> MakeLoss(const PointTerm& term, double scale) {
  std::unique_ptr<ceres::LossFunction> loss;
  if (term.loss == RobustLoss::kHuber) {
    loss = std::make_unique<ceres::HuberLoss>(term.loss_width_mm);
  } else if (term.loss == RobustLoss::kTukey) {
    loss = std::make_unique<ceres::TukeyLoss>(term.loss_width_mm);
  } else {
    loss = std::make_unique<ceres::CauchyLoss>(term.loss_width_mm);
  }
  return std::make_unique<ceres::ScaledLoss>(loss.release(), scale, ceres::TAKE_OWNERSHIP);
}

void AddRows(const PointTerm& term, const LevelView& view, RowSink& sink) {
  AddWeighted(
      view, view.observations, term.weight / view.WeightSum(),
      [](const Observation&) { return true; }, sink);
}

void AddRows(const PriorShapeTerm& term, const LevelView& view, RowSink& sink) {
  AddWeighted(
      view, view.likely, term.weight, [](const Observation&) { return true; }, sink);
}

void AddRows(const LandmarkTerm& term, const LevelView& view, RowSink& sink) {
  AddWeighted(
      view, view.observations, term.weight / view.LandmarkWeightSum(),
      [](const Observation& o) { return o.landmark; }, sink);
}

void AddResiduals(const PointTerm& term, const LevelView& view, ControlNet& net,
                  ceres::Problem& problem) {
  if (IsSeparable(term)) {
    ProblemSink sink(net, problem);
    AddRows(term, view, sink);
  } else {
    AddByPoint(term, view, net, problem);
  }
}

double TermCost(const PointTerm& term, const LevelView& view, const ControlNet& net) {
  double sum = 0;
  for (const Observation& o : view.observations) {
    sum += o.weight * Rho(term, (view.PointAt(o.uv, net) - o.position).squaredNorm());
  }
  return view.observations.empty() ? 0 : term.weight * sum / view.WeightSum();
}

double TermCost(const LandmarkTerm& term, const LevelView& view, const ControlNet& net) {
  double sum = 0;
  for (const Observation& o : view.observations) {
    sum += o.landmark ? o.weight * (view.PointAt(o.uv, net) - o.position).squaredNorm() : 0;
  }
  return sum > 0 ? term.weight * sum / view.LandmarkWeightSum() : 0;
}

double TermCost(const PriorShapeTerm& term, const LevelView& view, const ControlNet& net) {
  double sum = 0;
  for (const Observation& o : view.likely) {
    sum += o.weight * (view.PointAt(o.uv, net) - o.position).squaredNorm();
  }
  return term.weight * sum;
}

namespace {

// Takes a misfit d to one whose square is (n . d)^2 + tangential |d - n (n . d)|^2.
Mat3 Shaping(const TangentPointTerm& term, const LevelView& view, const Vec2& uv) {
  const Vec3 du = view.StencilAt(uv, {1, 0}).Apply(view.start),
             dv = view.StencilAt(uv, {0, 1}).Apply(view.start), normal = du.cross(dv);
  if (normal.norm() <= 1e-12 * (du.squaredNorm() + dv.squaredNorm())) {
    return Mat3::Identity();
  }
  const Vec3 n = normal.normalized();
  const Mat3 along = n * n.transpose();
  return along + std::sqrt(term.tangential) * (Mat3::Identity() - along);
}

// Rows over the coordinates of an element's vertices as rows over those of its dofs.
Eigen::MatrixXd Extracted(const Eigen::MatrixXd& a, const SplineElement& element) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(a.rows(), 3 * element.extraction.cols());
  for (Eigen::Index dof = 0; dof < element.extraction.cols(); ++dof) {
    for (int v = 0; v < 16; ++v) {
      result.middleCols<3>(3 * dof) += element.extraction(v, dof) * a.middleCols<3>(3 * v);
    }
  }
  return result;
}

// Three rows per point, 48 columns.
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
  AddCoupledResidual(element.IsIdentity() ? rows.a : Extracted(rows.a, element), rows.b.col(0),
                     element.dofs, net, problem);
}

}  // namespace

void AddResiduals(const TangentPointTerm& term, const LevelView& view, ControlNet& net,
                  ceres::Problem& problem) {
  constexpr std::size_t kMost = 16384;  // points; 19 MB
  const double scale = term.weight / view.WeightSum();
  const std::span<const Observation> all(view.observations);
  const auto patch = [&](std::size_t k) { return view.LocalAt(all[k].uv).element; };
  for (std::size_t begin = 0, end = 0; begin < all.size(); begin = end) {
    while (end < all.size() && end - begin < kMost && patch(end) == patch(begin)) {
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

}  // namespace semblance
