// SPDX-License-Identifier: GPL-3.0-or-later
// What all plans do between their solves: they move the points, and measure.
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

namespace semblance {

// Sorted, so that no sum depends on the order in which points were given. NaN without points.
double PointRms(const HSplineSurface& surface, const FitTarget& target, int threads);

// One step or round of a plan.
struct FitStep {
  // Brings the result's surface to the minimum of the terms, or part of the way.
  std::function<LevelSummary(std::span<const Term> terms, SolveReport report)> solve;
  int level = -1;  // that is fitted alone, with a view of it; -1: all at once
  std::function<LevelView(const FitTarget& target)> view = {};
};

class FitDriver {
 public:
  // All must outlive it. result.surface: the start. terms: the options', and the plan's own.
  FitDriver(const HSplineSurface& rest, const FitTarget& target, const FitOptions& options,
            std::vector<Term> terms, const RunContext& context, FitResult& result);

  // Solves, and notes it in the result.
  void Solve(const FitStep& step);
  // Solves, then moves the points as the options ask, with more solves between the moves.
  void Take(const FitStep& step);
  // After the last step: gives features their offsets back if the rule asks for it, and measures.
  void Finish(std::span<const VertexId> features);

  std::span<const Term> terms() const { return terms_; }
  const FitTarget& target() const { return mesh_ ? moved_ : given_; }  // where they are now
  bool MovesPoints() const { return mesh_.has_value(); }
  double rms_mm() const { return rms_mm_; }  // between steps

 private:
  // Of the rounds of a step, only what was before the first and what is after the last is measured.
  void Solve(const FitStep& step, SolveReport report);
  void SolveAgain(const FitStep& step, std::span<const Term> terms, int round);
  void After(const FitStep& step, const NoRelaxation& chosen);
  void After(const FitStep& step, const FootpointRelaxation& chosen);
  void After(const FitStep& step, const AlternatingRelaxation& chosen);
  void After(const FitStep& step, const TangentDistanceRelaxation& chosen);
  void After(const FitStep& step, const JointRelaxation& chosen);
  void Alternate(const FitStep& step);
  void Slide(const FitStep& step, const TangentDistanceRelaxation& chosen);
  bool IsLast(int round) const { return round == rounds_ - 1; }
  RelaxationSummary MoveOnce(int round);
  RelaxationSummary Move(const NetworkMoves& moves, const MeasuredPenalties& measured);
  RelaxationSummary MoveJointly(const FitStep& step);
  void Keep(const RelaxationSummary& next);
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
  FitTarget moved_;  // the points as relaxation has left them; unused without
  std::optional<DowelMesh> mesh_;
};

}  // namespace semblance
