// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/point_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <span>
#include <utility>

#include "fitting/least_squares/patch_energy.h"
#include "fitting/plan/alone_fit.h"
#include "fitting/plan/fit_check.h"
#include "fitting/problem/start_surface.h"
#include "fitting/solve/auto_weight.h"
#include "problems/points/fit_files.h"
#include "problems/points/fit_quality.h"
#include "problems/points/height_field.h"
#include "problems/points/place_points.h"
#include "problems/points/point_notes.h"
#include "problems/points/points_out.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

// Moves the attributes out of the table, in the order of the options.
std::vector<PointAttribute> TakeAttributes(PointTable& table, const PointFitOptions& options) {
  std::vector<PointAttribute> taken;
  for (const std::string& name : options.attributes) {
    const auto found = std::ranges::find(table.attributes, name, &PointAttribute::name);
    if (found == table.attributes.end()) {
      throw InputError(fmt::format("attributes: the points have no '{}'; leave it out", name));
    }
    taken.push_back(std::move(*found));
  }
  return taken;
}

std::vector<ExactPoint> ExactPoints(const PointTable& table, std::span<const Vec2> uv) {
  std::vector<ExactPoint> exact;
  for (std::size_t k = 0; k < table.exact.size(); ++k) {
    const std::uint32_t point = table.exact[k];
    exact.push_back(
        {.uv = uv[point], .position = table.positions[point], .normal = table.exact_normals[k]});
  }
  return exact;
}

// The auto plan alone frees the points as soon as their displacements are known.
FitResult FitOwned(const HSplineSurface& start, OwnedPoints points, std::vector<ExactPoint> exact,
                   const FitOptions& options, const RunContext& context) {
  if (!exact.empty()) {
    FitTarget target = MakeFitTarget(points.positions, points.uv, points.weights);
    target.exact = std::move(exact);
    return Fit(start, target, {}, options, context);
  }
  if (!IsAlone(options)) {
    return Fit(start, points.View(), options, context);
  }
  CheckFit(start, points.View(), options);
  return FitAlone(start, std::move(points), std::get<AutoPlan>(options.plan), context);
}

// Indices of the outliers and of the copies of other points, which the auto plan leaves out.
std::vector<std::uint32_t> PointsLeftOut(const std::optional<AutoReport>& report) {
  std::vector<std::uint32_t> left_out;
  if (report) {
    std::ranges::set_union(report->outliers, report->repeated, std::back_inserter(left_out));
  }
  return left_out;
}

AttributeFit AttributesOver(const PointFit& result, std::span<const double> weights,
                            const SchedulePlan& plan, const RunContext& context) {
  std::vector<std::span<const double>> values;
  for (const PointAttribute& attribute : result.attributes) {
    values.emplace_back(attribute.values);
  }
  return FitAttributes(
      result.fit.surface, {.uv = result.fit.uv, .weights = weights, .columns = values},
      PointsLeftOut(result.fit.automatic),
      std::holds_alternative<AutoPlan>(plan) ? std::get<AutoPlan>(plan) : AutoPlan{}, context);
}

void AddAttributes(std::span<const double> weights, const SchedulePlan& plan,
                   const RunContext& context, StepClock& step, PointFit& result) {
  if (!result.Faults().empty()) {
    result.attributes.clear();
  }
  if (!result.attributes.empty()) {
    result.attribute_fit =
        step("attributes", [&] { return AttributesOver(result, weights, plan, context); });
    result.attribute_at = result.attribute_fit.At(result.fit.uv, context.threads);
  }
}

std::shared_ptr<const SurfaceSigma> SigmaOver(const PointFit& result, const GivenPoints& given,
                                              const HSplineSurface& start) {
  const AutoReport& report = *result.fit.automatic;
  const std::span<const double> weights = given.weights;
  const SigmaOptions options{.noise_mm = report.noise_mm / std::sqrt(report.effective_share),
                             .weight = report.weight,
                             .stretch = report.stretch,
                             .direction_deg = report.direction_deg,
                             .lengths_mm = MeanLengths(start),
                             .met = given.exact_uv};
  return std::make_shared<const SurfaceSigma>(
      result.fit.surface, AttributeColumns{.uv = result.fit.uv, .weights = weights, .columns = {}},
      PointsLeftOut(report), options);
}

void AddSigma(const GivenPoints& given, const HSplineSurface& start, StepClock& step,
              PointFit& result) {
  if (result.Faults().empty()) {
    result.sigma = step("sigma", [&] { return SigmaOver(result, given, start); });
    result.sigma_mm = result.sigma->OfChosen(result.fit.uv);
  }
}

// Converts the weights of smoothness to those of the terms as written, with which another plan
// finds the same surface.
void ConvertWeights(std::span<const Term> terms, FitResult& fit) {
  const int automatic = AutoTerm(terms);
  if (!fit.automatic || automatic < 0) {
    return;
  }
  AutoReport& report = *fit.automatic;
  report.length_mm = std::get<SmoothnessTerm>(terms[automatic]).length_mm;
  const double as_written = WeightAsWritten(terms, report.length_mm);
  report.weight *= as_written;
  for (NestedRound& round : report.rounds) {
    round.weight *= as_written;
  }
  for (LevelSummary& level : fit.levels) {
    level.auto_weight *= as_written;
  }
}

PointFit BeginResult(PreparedPoints placed, FitResult fit, std::vector<PointAttribute> attributes,
                     const std::string& unit) {
  const Parametrisation& parameters = placed.parameters;
  return {.parameters = std::string(
              EnumNames(parameters.source)[static_cast<std::size_t>(parameters.source)]),
          .how = parameters.how,
          .unit = unit,
          .is_graph = parameters.is_graph && !placed.moves,
          .map_faults = parameters.faults,
          .moves = placed.moves,
          .fit = std::move(fit),
          .distance = {},
          .attributes = std::move(attributes),
          .attribute_at = {},
          .attribute_fit = {},
          .sigma = nullptr,
          .sigma_mm = {},
          .times = {}};
}

}  // namespace

std::optional<ToleranceReport> CompareWithTolerance(const PointFitOptions& options,
                                                    const PointFit& result) {
  const auto* adaptive = std::get_if<AdaptivePlan>(&options.fit.plan);
  return adaptive == nullptr || !result.Faults().empty()
             ? std::nullopt
             : std::optional(CompareWithTolerance(result.fit, *adaptive));
}

PointFit FitPoints(PointTable table, const PointFitOptions& options, const RunContext& context) {
  const bool uv_given = !table.uv.empty();
  std::vector<PointAttribute> given_attributes = TakeAttributes(table, options);
  const PointsOut out = LeaveOut(table, uv_given);
  std::vector<PointAttribute> attributes = given_attributes;
  for (PointAttribute& attribute : attributes) {
    Keep(out.left_out, attribute.values);
  }
  StepClock step(context);
  PreparedPoints placed = PlacePoints(table, out.given, options, step, context);
  std::vector<std::string> notes = FindNotes(table, out, placed, options);
  const bool has_heights = placed.shape.reference == OffsetReference::kWorld;
  const double factor = has_heights && table.exact.empty() ? HeightFactor(table.positions) : 1;
  ScaleHeights(factor, table.positions);
  std::vector<Vec2>& uv = placed.parameters.uv;
  const HSplineSurface start = StartSurface(placed.shape, table.positions, uv);
  CheckChord(InUnitsOfFit(options.chord_mm, factor), start, {table.positions, uv}, context);
  std::vector<ExactPoint> exact = ExactPoints(table, uv);
  const GivenPoints given = KeepFacts(table, placed.parameters.source, exact);
  OwnedPoints points{std::move(table.positions), std::move(uv), std::move(table.weights)};
  FitResult fit = step("fit", [&] {
    return FitOwned(start, std::move(points), std::move(exact), WithoutRelaxation(options.fit),
                    context);
  });
  PointFit result =
      BeginResult(std::move(placed), std::move(fit), std::move(attributes), options.unit);
  CompareShapes(given, result);
  AddAttributes(given.weights, options.fit.plan, context, step, result);
  if (factor != 1) {
    ScaleHeights(1 / factor, result.fit);
  }
  result.height_factor = factor;
  CompareDistances(given, result);
  if (std::isfinite(result.weighted_rms_mm)) {
    result.weights = given.weights;
  }
  if (result.fit.automatic) {
    result.energy_weight = result.fit.automatic->weight;
  }
  if (options.sigma) {
    AddSigma(given, start, step, result);
  }
  ConvertWeights(options.fit.terms, result.fit);
  std::string tail = TailText(given, result.fit, options.unit);
  if (result.fit.automatic) {
    result.fit.automatic->has_long_tail = !tail.empty();
  }
  for (std::string text : {std::move(tail), WeightText(given, result.fit, options.unit),
                           ReliefText(given, result), TwiceText(result.fit)}) {
    if (!text.empty()) {
      notes.push_back(std::move(text));
    }
  }
  if (!result.attributes.empty()) {
    result.attributes = std::move(given_attributes);
  }
  RestoreOrder(out, result);
  result.notes = std::move(notes);
  result.times = step.Take();
  return result;
}

}  // namespace semblance::problems
