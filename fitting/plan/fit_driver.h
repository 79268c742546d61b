// SPDX-License-Identifier: GPL-3.0-or-later
// The part of a fit that all plans share: solves, moves of the points between them, and measures.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "fitting/plan/fit_options.h"
#include "fitting/plan/fit_result.h"
#include "fitting/problem/fit_target.h"
#include "fitting/relaxation/dowel_mesh.h"
#include "fitting/terms/level_view.h"
#include "surfaces/base/run_context.h"

namespace semblance::fitting {

// Returns the weighted RMS distance of the points from the surface at their (u,v); NaN without
// points. The sum does not depend on the order of the points.
double PointRms(const HSplineSurface& surface, const FitTarget& target, int threads);

// One step or round of a plan.
struct FitStep {
  // Moves the result's surface to the minimum of the terms, or part of the way.
  std::function<LevelSummary(std::span<const Term> terms, SolveReport report)> solve;
  int level = -1;  // the level that is fitted alone, with a view of it; -1: all at once
  std::function<LevelView(const FitTarget& target)> view = {};
};

class FitDriver {
 public:
  // The arguments must outlive the driver. result.surface: the start. terms: those of the options,
  // and the plan's own.
  FitDriver(const HSplineSurface& rest, const FitTarget& target, const FitOptions& options,
            std::vector<Term> terms, const RunContext& context, FitResult& result);

  // Solves, and adds the summary to the result.
  void Solve(const FitStep& step);
  // Solves, then relaxes the points by the options, with more solves between the moves.
  void Take(const FitStep& step);
  // Ends the fit after the last step: restores the features by their rule, and measures.
  void Finish(std::span<const VertexId> features);

  std::span<const Term> terms() const { return terms_; }
  const FitTarget& target() const { return mesh_ ? moved_ : given_; }  // with the current (u,v)
  bool MovesPoints() const { return mesh_.has_value(); }
  double rms_mm() const { return rms_mm_; }  // between steps

 private:
  // Within a step only the values before the first round and after the last are measured.
  void Solve(const FitStep& step, SolveReport report);
  void SolveAgain(const FitStep& step, std::span<const Term> terms, int round);
  void RelaxAfter(const FitStep& step, const NoRelaxation& chosen);
  void RelaxAfter(const FitStep& step, const FootpointRelaxation& chosen);
  void RelaxAfter(const FitStep& step, const AlternatingRelaxation& chosen);
  void RelaxAfter(const FitStep& step, const TangentDistanceRelaxation& chosen);
  void RelaxAfter(const FitStep& step, const JointRelaxation& chosen);
  void Alternate(const FitStep& step);
  void Slide(const FitStep& step, const TangentDistanceRelaxation& chosen);
  bool IsLast(int round) const { return round == rounds_ - 1; }
  RelaxationSummary MoveOnce(int round);
  RelaxationSummary MovePoints(const NetworkMoves& moves, const MeasuredPenalties& measured);
  RelaxationSummary MoveJointly(const FitStep& step);
  void AddToLastSummary(const RelaxationSummary& next);
  void MeasurePoints(bool known);

  const HSplineSurface& rest_;
  const FitTarget& given_;
  const FitOptions& options_;
  std::vector<Term> terms_;
  const RunContext& context_;
  FitResult& result_;
  double rms_mm_;
  int rounds_;  // solves of a step after its first
  std::optional<NetworkMoves> moves_;
  FitTarget moved_;  // the points after relaxation; unused without relaxation
  std::optional<DowelMesh> mesh_;
};

}  // namespace semblance::fitting
