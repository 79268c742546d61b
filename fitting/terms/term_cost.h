// SPDX-License-Identifier: GPL-3.0-or-later
// Every term in two forms: as rows or residuals that a solver minimises, and as the plain sum that
// term.h documents. The law tests compare the two.
#pragma once

#include <ceres/loss_function.h>
#include <ceres/problem.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <variant>

#include "fitting/least_squares/linear_cost.h"
#include "fitting/least_squares/qr_compression.h"
#include "fitting/terms/level_view.h"
#include "fitting/terms/term.h"

namespace semblance::fitting {

// Adds the rows of a term that treats x, y and z alike. The sum of their squares equals TermCost.
// The rows of a PointTerm ignore its loss.
void AddRows(const PointTerm& term, const LevelView& view, RowSink& sink);
void AddRows(const LandmarkTerm& term, const LevelView& view, RowSink& sink);
void AddRows(const PriorShapeTerm& term, const LevelView& view, RowSink& sink);
void AddRows(const PriorTerm& term, const LevelView& view, RowSink& sink);
void AddRows(const SmoothnessTerm& term, const LevelView& view, RowSink& sink);
void AddRows(const MembraneTerm& term, const LevelView& view, RowSink& sink);
void AddRows(const RowsTerm& term, const LevelView& view, RowSink& sink);

// Terms of the form |A X - B|^2 with the same A for x, y and z.
template <class T>
concept RowTerm = requires(const T& term, const LevelView& view, RowSink& sink) {
  AddRows(term, view, sink);
};
// Adds the rows of every RowTerm with a positive weight.
inline void AddRows(std::span<const Term> terms, const LevelView& view, RowSink& sink) {
  for (const Term& term : terms) {
    std::visit(
        [&]<class T>(const T& t) {
          if constexpr (RowTerm<T>) {
            if (t.weight > 0) {
              AddRows(t, view, sink);
            }
          }
        },
        term);
  }
}

inline bool IsSeparable(const PointTerm& term) { return term.loss == RobustLoss::kNone; }
template <class T>
bool IsSeparable(const T&) {
  return RowTerm<T>;
}

// Returns whether every term with a positive weight is a RowTerm, so that x, y and z are separate
// apart from a loss.
inline bool SeparableButForLoss(std::span<const Term> terms) {
  return std::all_of(terms.begin(), terms.end(), [](const Term& term) {
    return std::visit([]<class T>(const T& t) { return t.weight <= 0 || RowTerm<T>; }, term);
  });
}

// Returns whether the residuals of a term are linear in the vertices. They may couple x, y and z.
inline bool IsLinear(const TangentPointTerm&) { return true; }
inline bool IsLinear(const SymmetryTerm&) { return true; }
template <class T>
bool IsLinear(const T& term) {
  return IsSeparable(term);
}
inline bool AllLinear(std::span<const Term> terms) {
  return std::all_of(terms.begin(), terms.end(), [](const Term& term) {
    return TermWeight(term) <= 0 || std::visit([](const auto& t) { return IsLinear(t); }, term);
  });
}

// The matrix of the term's cost on one patch of a level of patches_u x patches_v: the cost is x^T
// matrix x, mm^2, for each coordinate x of the patch's sixteen f. lengths_mm: lengths of [0,1]
// along u and v.
ElementStiffness PatchStiffness(const SmoothnessTerm& term, const Vec2& lengths_mm, int patches_u,
                                int patches_v);
ElementStiffness PatchStiffness(const MembraneTerm& term, const Vec2& lengths_mm, int patches_u,
                                int patches_v);

// Adds the residuals of a term over `net`, whose vertices become parameter blocks of 3 doubles. The
// sum of their squares (of their losses for a robust term) is twice Ceres' cost. It equals TermCost
// up to a constant, because the points of a patch are reduced to at most 16 rows
// (qr_compression.h), which drops the misfit that no net can change. The order of SortObservations
// gives the fewest rows.
void AddResiduals(const PointTerm& term, const LevelView& view, ControlNet& net,
                  ceres::Problem& problem);
void AddResiduals(const TangentPointTerm& term, const LevelView& view, ControlNet& net,
                  ceres::Problem& problem);
void AddResiduals(const SymmetryTerm& term, const LevelView& view, ControlNet& net,
                  ceres::Problem& problem);
void AddResiduals(const NonPenetrationTerm& term, const LevelView& view, ControlNet& net,
                  ceres::Problem& problem);
void AddResiduals(const SpringTerm& term, const LevelView& view, ControlNet& net,
                  ceres::Problem& problem);
void AddResiduals(const DistortionTerm& term, const LevelView& view, ControlNet& net,
                  ceres::Problem& problem);
template <RowTerm T>
void AddResiduals(const T& term, const LevelView& view, ControlNet& net, ceres::Problem& problem) {
  ProblemSink sink(net, problem);
  AddRows(term, view, sink);
}

// Adds the residuals of every term with a positive weight.
inline void AddResiduals(std::span<const Term> terms, const LevelView& view, ControlNet& net,
                         ceres::Problem& problem) {
  for (const Term& term : terms) {
    if (TermWeight(term) > 0) {
      std::visit([&](const auto& t) { AddResiduals(t, view, net, problem); }, term);
    }
  }
}

// rho(s) of a squared distance s, mm^2, by the formulas of PointTerm, which are those of Ceres.
inline double Rho(const PointTerm& term, double s) {
  const double a = term.loss_width_mm;
  switch (term.loss) {
    case RobustLoss::kHuber:
      return s <= a * a ? s : 2 * a * std::sqrt(s) - a * a;
    case RobustLoss::kCauchy:
      return a * a * std::log1p(s / (a * a));
    case RobustLoss::kTukey:
      return a * a / 3 * (1 - std::pow(std::max(1 - s / (a * a), 0.0), 3));
    case RobustLoss::kNone:
      break;
  }
  return s;
}

// rho'(s), which is 1 at 0: the factor of a point's weight in iteratively reweighted least squares.
inline double RhoSlope(const PointTerm& term, double s) {
  const double a = term.loss_width_mm;
  switch (term.loss) {
    case RobustLoss::kHuber:
      return s <= a * a ? 1 : a / std::sqrt(s);
    case RobustLoss::kCauchy:
      return 1 / (1 + s / (a * a));
    case RobustLoss::kTukey:
      return std::pow(std::max(1 - s / (a * a), 0.0), 2);
    case RobustLoss::kNone:
      break;
  }
  return 1;
}

// Ceres' loss scale * rho for a term with a loss.
std::unique_ptr<ceres::LossFunction> MakeLoss(const PointTerm& term, double scale);

// The cost of a term by its formula in term.h, mm^2.
double TermCost(const PointTerm& term, const LevelView& view, const ControlNet& net);
double TermCost(const LandmarkTerm& term, const LevelView& view, const ControlNet& net);
double TermCost(const PriorShapeTerm& term, const LevelView& view, const ControlNet& net);
double TermCost(const PriorTerm& term, const LevelView& view, const ControlNet& net);
double TermCost(const SmoothnessTerm& term, const LevelView& view, const ControlNet& net);
double TermCost(const MembraneTerm& term, const LevelView& view, const ControlNet& net);
double TermCost(const RowsTerm& term, const LevelView& view, const ControlNet& net);
double TermCost(const TangentPointTerm& term, const LevelView& view, const ControlNet& net);
double TermCost(const SymmetryTerm& term, const LevelView& view, const ControlNet& net);
double TermCost(const NonPenetrationTerm& term, const LevelView& view, const ControlNet& net);
double TermCost(const SpringTerm& term, const LevelView& view, const ControlNet& net);
double TermCost(const DistortionTerm& term, const LevelView& view, const ControlNet& net);

}  // namespace semblance::fitting
