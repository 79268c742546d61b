// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/terms/bone_terms.h"

#include <ceres/cost_function.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "fitting/terms/term_cost.h"

namespace semblance {
namespace {

// A misfit in mm, and what a move of the surface's point changes.
struct Misfit {
  double value = 0;
  Vec3 slope = Vec3::Zero();
};

Misfit MisfitOf(const NonPenetrationTerm& term, const BoneObservation& o, const Vec3& point) {
  const double missing = term.min_depth_mm - o.direction.dot(point - o.foot);
  return missing > 0 ? Misfit{missing, -o.direction} : Misfit{};
}

Misfit MisfitOf(const SpringTerm&, const BoneObservation& o, const Vec3& point) {
  const Vec3 way = point - o.foot;
  const double length = way.norm();
  return {length - (o.point.position - o.foot).norm(),
          length > 0 ? Vec3(way / length) : o.direction};
}

double WeightOfFeet(const LevelView& view) {
  double sum = 0;
  for (const BoneObservation& o : view.bone) {
    sum += o.point.weight;
  }
  return sum;
}

// factor * misfit of the surface's point at the observation's (u,v).
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
    const Misfit misfit = MisfitOf(term_, observation_, point);
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
  const double scale = term.weight / WeightOfFeet(view);
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
    const double misfit = MisfitOf(term, o, view.PointAt(o.point.uv, net)).value;
    sum += o.point.weight * misfit * misfit;
  }
  return sum > 0 ? term.weight * sum / WeightOfFeet(view) : 0;
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

}  // namespace semblance
