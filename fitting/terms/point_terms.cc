// SPDX-License-Identifier: GPL-3.0-or-later
#include <ceres/cost_function.h>
#include <ceres/loss_function.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "fitting/least_squares/linear_cost.h"
#include "fitting/least_squares/qr_compression.h"
#include "fitting/terms/term_cost.h"

namespace semblance::fitting {
namespace {

// A loss applies to each point separately, so points with a loss are not compressed.
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

// Collects the rows of one element and passes them on when another element begins or kMaxRows is
// reached.
class ElementBuffer {
 public:
  ElementBuffer(const LevelView& view, RowSink& sink) : view_(view), sink_(sink) {}

  void Add(const LocalStencil& stencil, const Vec3& position, double factor) {
    if (stencil.element != element_ || rows_.size() == kMaxRows) {
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
  static constexpr std::size_t kMaxRows = 65536;  // bounds memory: 10 MB

  const LevelView& view_;
  RowSink& sink_;
  int element_ = -1;
  std::vector<Row> rows_;
};

// Adds the rows of the observations that `taken` accepts.
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

// A misfit in mm, and its gradient with respect to the surface's point.
struct Misfit {
  double value = 0;
  Vec3 slope = Vec3::Zero();
};

Misfit BoneMisfit(const NonPenetrationTerm& term, const BoneObservation& o, const Vec3& point) {
  const double missing = term.min_depth_mm - o.direction.dot(point - o.foot);
  return missing > 0 ? Misfit{missing, -o.direction} : Misfit{};
}

Misfit BoneMisfit(const SpringTerm&, const BoneObservation& o, const Vec3& point) {
  const Vec3 way = point - o.foot;
  const double length = way.norm();
  return {length - (o.point.position - o.foot).norm(),
          length > 0 ? Vec3(way / length) : o.direction};
}

double FootWeightSum(const LevelView& view) {
  double sum = 0;
  for (const BoneObservation& o : view.bone) {
    sum += o.point.weight;
  }
  return sum;
}

// Residual factor * misfit of the surface's point at the observation's (u,v).
template <class T>
class BoneCost final : public ceres::CostFunction {
 public:
  BoneCost(const T& term, const BoneObservation& o, const DofStencil& stencil, double factor)
      : term_(term), observation_(o), stencil_(stencil), factor_(factor) {
    mutable_parameter_block_sizes()->assign(stencil.count, 3);
    set_num_residuals(1);
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    Vec3 point = stencil_.fixed;
    for (int k = 0; k < stencil_.count; ++k) {
      point += stencil_.weight[k] * Eigen::Map<const Vec3>(parameters[k]);
    }
    const Misfit misfit = BoneMisfit(term_, observation_, point);
    residuals[0] = factor_ * misfit.value;
    for (int k = 0; jacobians != nullptr && k < stencil_.count; ++k) {
      if (jacobians[k] != nullptr) {
        Eigen::Map<Vec3>(jacobians[k], 3) = factor_ * stencil_.weight[k] * misfit.slope;
      }
    }
    return true;
  }

 private:
  T term_;
  BoneObservation observation_;
  DofStencil stencil_;
  double factor_;
};

template <class T>
void AddBone(const T& term, const LevelView& view, ControlNet& net, ceres::Problem& problem) {
  const double scale = term.weight / FootWeightSum(view);
  for (const BoneObservation& o : view.bone) {
    const DofStencil stencil = view.StencilAt(o.point.uv);
    std::vector<double*> blocks;
    for (const int vertex : stencil.dofs()) {
      blocks.push_back(net.vertices[vertex].data());
    }
    problem.AddResidualBlock(new BoneCost<T>(term, o, stencil, std::sqrt(scale * o.point.weight)),
                             nullptr, blocks);
  }
}

template <class T>
double BoneSum(const T& term, const LevelView& view, const ControlNet& net) {
  double sum = 0;
  for (const BoneObservation& o : view.bone) {
    const double misfit = BoneMisfit(term, o, view.PointAt(o.point.uv, net)).value;
    sum += o.point.weight * misfit * misfit;
  }
  return sum > 0 ? term.weight * sum / FootWeightSum(view) : 0;
}

}  // namespace

void AddResiduals(const NonPenetrationTerm& term, const LevelView& view, ControlNet& net,
                  ceres::Problem& problem) {
  AddBone(term, view, net, problem);
}

void AddResiduals(const SpringTerm& term, const LevelView& view, ControlNet& net,
                  ceres::Problem& problem) {
  AddBone(term, view, net, problem);
}

double TermCost(const NonPenetrationTerm& term, const LevelView& view, const ControlNet& net) {
  return BoneSum(term, view, net);
}

double TermCost(const SpringTerm& term, const LevelView& view, const ControlNet& net) {
  return BoneSum(term, view, net);
}

}  // namespace semblance::fitting
