// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/plan/alone_fit.h"

#include <cmath>
#include <utility>
#include <variant>

#include "fitting/nested/nested_fit.h"

namespace semblance::fitting {
namespace {

LevelSummary Summarise(const NestedRound& round) {
  return {.level = round.finest,
          .fraction = 1,
          .terms = {},
          .iterations = round.steps,
          .free_vertices = round.vertices,
          .auto_weight = round.weight,
          .solver = "conjugate gradients",
          .termination = "convergence",
          .usable = true};
}

FitResult MakeResult(NestedFitResult fit) {
  FitResult result{.surface = std::move(fit.surface),
                   .uv = std::move(fit.uv),
                   .residual_mm = std::move(fit.residual_mm),
                   .point_rms_mm = fit.rms_mm,
                   .dowel_rms_mm = fit.rms_mm,
                   .restored_features = 0,
                   .automatic = std::move(fit.report),
                   .usable = std::isfinite(fit.rms_mm)};
  for (const NestedRound& round : result.automatic->rounds) {
    result.levels.push_back(Summarise(round));
  }
  result.levels.back().rms_after_mm = fit.rms_mm;
  return result;
}

}  // namespace

bool IsAlone(const FitOptions& options) {
  return std::holds_alternative<AutoPlan>(options.plan) && options.solver == Solver::kFastest;
}

FitResult FitAlone(const HSplineSurface& start, const ScatteredPoints& points, const AutoPlan& plan,
                   const RunContext& context) {
  return MakeResult(FitNested(start, points, plan, context));
}

FitResult FitAlone(const HSplineSurface& start, OwnedPoints points, const AutoPlan& plan,
                   const RunContext& context) {
  CheckNested(start, points.View());
  return MakeResult(FitNested(start, TakeDisplacements(start, std::move(points), context.threads),
                              plan, context));
}

}  // namespace semblance::fitting
