// SPDX-License-Identifier: GPL-3.0-or-later
// Each term twice: as rows or residuals to minimise, and as the plain sum that its documentation
// states.
#pragma once

#include <ceres/loss_function.h>
#include <ceres/problem.h>

#include <algorithm>
#include <memory>
#include <span>
#include <variant>

#include "fitting/least_squares/linear_cost.h"
#include "fitting/least_squares/row_sink.h"
#include "fitting/terms/level_view.h"
#include "fitting/terms/term.h"

namespace semblance {

// The rows of a term that is the same for x, y and z (PointTerm: without a loss); their sum of
// squares equals TermCost.
void AddRows(const PointTerm& term, const LevelView& view, RowSink& sink);
void AddRows(const LandmarkTerm& term, const LevelView& view, RowSink& sink);
void AddRows(const PriorShapeTerm& term, const LevelView& view, RowSink& sink);
void AddRows(const PriorTerm& term, const LevelView& view, RowSink& sink);
void AddRows(const SmoothnessTerm& term, const LevelView& view, RowSink& sink);
void AddRows(const MembraneTerm& term, const LevelView& view, RowSink& sink);

// Terms that are |A X - B|^2 with the same A for x, y and z; then AddRows gives its rows.
template <class T>
concept RowTerm = requires(const T& term, const LevelView& view, RowSink& sink) {
  AddRows(term, view, sink);
};
// All rows of those terms that have any, and a weight.
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

// Whether all terms with a weight add rows that treat x, y and z alike.
inline bool SeparableButForLoss(std::span<const Term> terms) {
  return std::all_of(terms.begin(), terms.end(), [](const Term& term) {
    return std::visit([]<class T>(const T& t) { return t.weight <= 0 || RowTerm<T>; }, term);
  });
}

// Terms whose residuals are linear in the vertices, whether or not they couple x, y and z.
inline bool IsLinear(const TangentPointTerm&) { return true; }
inline bool IsLinear(const SymmetryTerm&) { return true; }
template <class T>
bool IsLinear(const T& term) {
  return IsSeparable(term);
}
inline bool AllLinear(std::span<const Term> terms) {
  return std::all_of(terms.begin(), terms.end(), [](const Term& term) {
    return WeightOf(term) <= 0 || std::visit([](const auto& t) { return IsLinear(t); }, term);
  });
}

// What the term costs on one patch of a level of patches_u x patches_v, mm^2: x^T form x for each
// coordinate x of the patch's sixteen f. lengths_mm: what [0,1] stands for along u and v.
ElementStiffness StiffnessOf(const SmoothnessTerm& term, const Vec2& lengths_mm, int patches_u,
                             int patches_v);
ElementStiffness StiffnessOf(const MembraneTerm& term, const Vec2& lengths_mm, int patches_u,
                             int patches_v);

// Adds the residuals of a term over `net`, whose vertices become parameter blocks of 3 doubles. The
// sum of their squares (robust: of their losses), which is twice Ceres' cost, equals TermCost but
// for a constant: the points of a patch are reduced to at most 16 rows (qr_compression.h), without
// what no net can change. Points are reduced best in the order of SortObservations.
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

// Of all terms that have a weight.
inline void AddResiduals(std::span<const Term> terms, const LevelView& view, ControlNet& net,
                         ceres::Problem& problem) {
  for (const Term& term : terms) {
    if (WeightOf(term) > 0) {
      std::visit([&](const auto& t) { AddResiduals(t, view, net, problem); }, term);
    }
  }
}

// scale * rho of a squared distance in mm^2, for a term with a loss.
std::unique_ptr<ceres::LossFunction> MakeLoss(const PointTerm& term, double scale);

// The cost of a term as term.h states it, mm^2.
double TermCost(const PointTerm& term, const LevelView& view, const ControlNet& net);
double TermCost(const LandmarkTerm& term, const LevelView& view, const ControlNet& net);
double TermCost(const PriorShapeTerm& term, const LevelView& view, const ControlNet& net);
double TermCost(const PriorTerm& term, const LevelView& view, const ControlNet& net);
double TermCost(const SmoothnessTerm& term, const LevelView& view, const ControlNet& net);
double TermCost(const MembraneTerm& term, const LevelView& view, const ControlNet& net);
double TermCost(const TangentPointTerm& term, const LevelView& view, const ControlNet& net);
double TermCost(const SymmetryTerm& term, const LevelView& view, const ControlNet& net);
double TermCost(const NonPenetrationTerm& term, const LevelView& view, const ControlNet& net);
double TermCost(const SpringTerm& term, const LevelView& view, const ControlNet& net);
double TermCost(const DistortionTerm& term, const LevelView& view, const ControlNet& net);

}  // namespace semblance
