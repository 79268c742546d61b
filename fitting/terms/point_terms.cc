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

}  // namespace semblance
