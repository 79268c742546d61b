// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/point_fit.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <set>
#include <utility>

#include "fitting/least_squares/patch_energy.h"
#include "fitting/plan/alone_fit.h"
#include "fitting/plan/fit_check.h"
#include "fitting/problem/start_surface.h"
#include "fitting/solve/auto_weight.h"
#include "problems/points/surface_ply.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

HSplineShape ShapeOf(const PointFitOptions& options) {
  return {.patches_u = options.patches_u,
          .patches_v = options.patches_v,
          .max_level = FinestLevelOf(options.fit.plan),
          .closure = options.closure};
}

std::string_view NameOf(ParameterSource source) {
  return EnumNames(source)[static_cast<std::size_t>(source)];
}

// Empty if they go together.
std::string ClosureFault(ParameterSource source, Closure closure) {
  if (source == ParameterSource::kCylinder && closure != Closure::kPeriodicU) {
    return "parameters on a cylinder go round in u alone; write closure: periodic_u";
  }
  if (closure != Closure::kOpen &&
      (source == ParameterSource::kPlane || source == ParameterSource::kMesh)) {
    return fmt::format("parameters on a {} do not go round; write closure: open", NameOf(source));
  }
  return "";
}

void CheckClosure(ParameterSource source, Closure closure) {
  if (const std::string fault = ClosureFault(source, closure); !fault.empty()) {
    throw InputError("closure: " + fault);
  }
}

// What the parameters will be; nothing where that follows from the points.
std::optional<ParameterSource> SourceAsked(const Parameters& parameters) {
  return std::holds_alternative<PlaneParameters>(parameters)
             ? std::optional(ParameterSource::kPlane)
         : std::holds_alternative<CylinderParameters>(parameters)
             ? std::optional(ParameterSource::kCylinder)
         : std::holds_alternative<MeshParameters>(parameters)
             ? std::optional(ParameterSource::kMesh)
             : std::nullopt;
}

// What points of a file have not; empty for a term that they have all for.
std::string_view WhatIsMissing(const Term& term) {
  return std::holds_alternative<LandmarkTerm>(term)         ? "standard landmarks"
         : std::holds_alternative<PriorShapeTerm>(term)     ? "a prior's face"
         : std::holds_alternative<NonPenetrationTerm>(term) ? "bone"
         : std::holds_alternative<SpringTerm>(term)         ? "bone"
                                                            : "";
}

// Empty if they can be columns of their own.
std::string AttributesFault(const std::vector<std::string>& names) {
  static const std::set<std::string> kTaken = {
      "x",  "y",  "z",  "u", "v", "weight", "sigma",    "residual_mm", "outlier",
      "nx", "ny", "nz", "s", "t", "point",  "sigma_mm", "exact"};
  std::set<std::string> seen;
  for (const std::string& name : names) {
    const std::string residual = name + "_residual";
    if (std::find(names.begin(), names.end(), residual) != names.end()) {
      return fmt::format(
          "'{}' is what the residuals of '{}' are called in the residuals' file; "
          "give the column another name",
          residual, name);
    }
    if (kTaken.contains(name) || name.empty() ||
        name.find_first_of(" \t,\"\n") != std::string::npos) {
      return fmt::format("'{}' has a meaning of its own, or blanks in it; name another column",
                         name);
    }
    if (!seen.insert(name).second) {
      return fmt::format("'{}' appears twice; name it once", name);
    }
  }
  return "";
}

// Empty if there is a surface of so many patches, and memory for its level 0: a fit takes about a
// gigabyte for as many vertices as are allowed, however few points there are.
std::string ShapeFault(const HSplineShape& shape) try {
  constexpr std::int64_t kMostVertices = 1'100'000;  // 1024 x 1024 patches
  CheckShape(shape);
  const std::int64_t vertices = std::int64_t{shape.Columns(0)} * shape.Rows(0);
  return vertices <= kMostVertices
             ? ""
             : fmt::format(
                   "{} x {} patches have {} control vertices; level 0 may have {}; take "
                   "fewer patches, and finer levels where the points have detail",
                   shape.patches_u, shape.patches_v, vertices, kMostVertices);
} catch (const InputError& error) {
  return error.what();
}

// That of v where as many as along u would do.
std::string_view WrongPatches(HSplineShape shape) {
  shape.patches_v = shape.patches_u;
  return ShapeFault(shape).empty() ? "patches_v" : "patches_u";
}

// Of (u,v), before the fit.
int RoundsOfMoves(const FitOptions& fit) {
  const auto* const plan = std::get_if<AutoPlan>(&fit.plan);
  return plan == nullptr ? 0 : plan->relaxation_rounds;
}

// What is left to do once (u,v) have been moved.
FitOptions AfterMoves(FitOptions fit) {
  if (auto* const plan = std::get_if<AutoPlan>(&fit.plan)) {
    plan->relaxation_rounds = 0;
  }
  return fit;
}

}  // namespace

std::vector<OptionFault> FaultsBetween(const PointFitOptions& options) {
  std::vector<OptionFault> faults;
  if (const auto source = SourceAsked(options.parameters)) {
    if (std::string fault = ClosureFault(*source, options.closure); !fault.empty()) {
      faults.push_back({"closure", std::move(fault)});
    }
  }
  if (const std::string fault = ShapeFault(ShapeOf(options)); !fault.empty()) {
    faults.push_back({std::string(WrongPatches(ShapeOf(options))), fault});
  }
  if (options.sigma && !IsAlone(options.fit)) {
    faults.push_back({"sigma",
                      "it follows from the noise and smoothness that plan: auto finds with solver: "
                      "fastest; take those, or write sigma: false"});
  }
  if (const std::string fault = AttributesFault(options.attributes); !fault.empty()) {
    faults.push_back({"attributes", fault});
  }
  if (!std::holds_alternative<RestoreFeatures>(options.fit.features)) {
    faults.push_back({"fit.features",
                      "a surface through points of a file has no features; leave the option out"});
  }
  for (std::size_t k = 0; k < options.fit.terms.size(); ++k) {
    const Term& term = options.fit.terms[k];
    if (const std::string_view missing = WhatIsMissing(term);
        !missing.empty() && WeightOf(term) > 0) {
      faults.push_back({fmt::format("fit.terms[{}]", k),
                        fmt::format("the term '{}' looks at {}, and points of a file have none; "
                                    "leave it out",
                                    TermName(term), missing)});
    }
  }
  for (const FitFault& fault : FaultsOf(AfterMoves(options.fit), ShapeOf(options).max_level)) {
    faults.push_back({"fit." + fault.path, fault.what});
  }
  return faults;
}

std::optional<ToleranceReport> ToleranceOf(const PointFitOptions& options, const PointFit& result) {
  const auto* adaptive = std::get_if<AdaptivePlan>(&options.fit.plan);
  return adaptive == nullptr || !result.Faults().empty()
             ? std::nullopt
             : std::optional(ToleranceOf(result.fit, *adaptive));
}

namespace {

// In the order of the options; taken out of the table.
std::vector<PointAttribute> AttributesAsked(PointTable& table, const PointFitOptions& options) {
  std::vector<PointAttribute> asked;
  for (const std::string& name : options.attributes) {
    const auto found = std::find_if(table.attributes.begin(), table.attributes.end(),
                                    [&](const PointAttribute& a) { return a.name == name; });
    if (found == table.attributes.end()) {
      throw InputError(fmt::format("attributes: the points have no '{}'; leave it out", name));
    }
    asked.push_back(std::move(*found));
  }
  return asked;
}

// By the auto plan: outliers, and copies of other points.
std::vector<std::uint32_t> LeftOut(const std::optional<AutoReport>& report) {
  std::vector<std::uint32_t> left_out;
  if (report) {
    std::ranges::set_union(report->outliers, report->repeated, std::back_inserter(left_out));
  }
  return left_out;
}

AttributeFit AttributesOver(const PointFit& result, std::span<const double> weights,
                            const RunContext& context) {
  std::vector<std::span<const double>> values;
  for (const PointAttribute& attribute : result.attributes) {
    values.emplace_back(attribute.values);
  }
  return FitAttributes(result.fit.surface,
                       {.uv = result.fit.uv, .weights = weights, .columns = values},
                       LeftOut(result.fit.automatic), context.threads);
}

Box3 BoxOf(std::span<const Vec3> points) {
  Box3 box;
  for (const Vec3& p : points) {
    box.extend(p);
  }
  return box;
}

// What is asked of the points after the fit, which takes them apart.
struct GivenPoints {
  std::vector<double> weights;
  std::vector<Vec2> met;  // where the surface meets exact points
  Box3 box;
  bool has_uv = false;
  bool has_sigma = false;
};

GivenPoints GivenOf(const PointTable& table, ParameterSource source,
                    std::span<const ExactPoint> exact) {
  GivenPoints given{.weights = table.weights,
                    .met = {},
                    .box = BoxOf(table.positions),
                    .has_uv = source == ParameterSource::kGiven,
                    .has_sigma = table.weights_of_sigma};
  std::ranges::transform(exact, std::back_inserter(given.met), &ExactPoint::uv);
  return given;
}

std::shared_ptr<const SurfaceSigma> SigmaOver(const PointFit& result, const GivenPoints& given,
                                              const HSplineSurface& start) {
  const AutoReport& report = *result.fit.automatic;
  const std::span<const double> weights = given.weights;
  const SigmaOptions options{.noise_mm = report.noise_mm,
                             .weight = report.weight,
                             .stretch = report.stretch,
                             .direction_deg = report.direction_deg,
                             .lengths_mm = MeanLengths(start),
                             .met = given.met};
  return std::make_shared<const SurfaceSigma>(
      result.fit.surface, AttributeColumns{.uv = result.fit.uv, .weights = weights, .columns = {}},
      LeftOut(report), options);
}

// By the noise of a point of mean weight, weights being 1 / sigma^2 of points that are no outliers.
double SigmaFactorOf(const AutoReport& report, std::span<const double> weights) {
  double sum = 0;
  auto next = report.outliers.begin();
  for (std::uint32_t k = 0; k < weights.size(); ++k) {
    if (next != report.outliers.end() && *next == k) {
      ++next;
    } else {
      sum += weights[k];
    }
  }
  return report.noise_mm *
         std::sqrt(sum / static_cast<double>(weights.size() - report.outliers.size()));
}

// What is not needed any more is freed on the way.
Parametrisation ParametersOf(PointTable& table, const PointFitOptions& options) {
  const auto* const given = std::get_if<GivenParameters>(&options.parameters);
  const bool automatic = std::holds_alternative<AutoParameters>(options.parameters);
  const auto name_of = [&](std::size_t point) { return NameOfPoint(table, point); };
  if (!table.uv.empty() && table.triangles.empty() && (automatic || given != nullptr)) {
    return TakeGiven(std::move(table.uv), automatic ? GivenParameters{} : *given, name_of);
  }
  Parametrisation parameters = Parametrise({.positions = table.positions,
                                            .given_uv = table.uv,
                                            .triangles = table.triangles,
                                            .closure = options.closure,
                                            .name_of = name_of},
                                           options.parameters);
  table.uv = std::vector<Vec2>();  // frees it, which {} would not
  table.triangles = std::vector<Triangle>();
  CheckClosure(parameters.source, options.closure);
  return parameters;
}

// Before the fit.
FootMoves MoveUv(const PointTable& table, std::span<const Triangle> triangles,
                 const PointFitOptions& options, const RunContext& context, std::vector<Vec2>& uv) {
  if (!table.exact.empty()) {
    throw InputError(
        "fit.plan.relaxation_rounds: exact points need their (u,v), and those around them, as they "
        "are; write relaxation_rounds: 0, or leave the column exact out");
  }
  MovedUv moved = MoveToFeet(ShapeOf(options), {table.positions, uv, table.weights}, triangles,
                             std::get<AutoPlan>(options.fit.plan), context);
  uv = std::move(moved.uv);
  return moved.moves;
}

struct PlacedPoints {
  Parametrisation parameters;
  std::optional<FootMoves> moves;  // where they were asked for
};

// Frees the table's (u,v) and triangles.
PlacedPoints PlacePoints(PointTable& table, const PointFitOptions& options, StepClock& step,
                         const RunContext& context) {
  const bool moving = RoundsOfMoves(options.fit) > 0;
  const std::vector<Triangle> triangles = moving ? table.triangles : std::vector<Triangle>();
  PlacedPoints placed{step("parameters", [&] { return ParametersOf(table, options); }), {}};
  if (moving) {
    placed.moves = step("relaxation", [&] {
      return MoveUv(table, triangles, options, context, placed.parameters.uv);
    });
  }
  return placed;
}

std::vector<ExactPoint> ExactOf(const PointTable& table, std::span<const Vec2> uv) {
  std::vector<ExactPoint> exact;
  for (std::size_t k = 0; k < table.exact.size(); ++k) {
    const std::uint32_t point = table.exact[k];
    exact.push_back(
        {.uv = uv[point], .position = table.positions[point], .normal = table.exact_normals[k]});
  }
  return exact;
}

FitResult FitOwned(const HSplineSurface& start, OwnedPoints points, std::vector<ExactPoint> exact,
                   const FitOptions& options, const RunContext& context) {
  if (!exact.empty()) {
    FitTarget target = TargetOf(points.positions, points.uv, points.weights);
    target.exact = std::move(exact);
    return Fit(start, target, {}, options, context);
  }
  if (!IsAlone(options)) {
    return Fit(start, points.View(), options, context);
  }
  CheckFit(start, points.View(), options);
  return FitAlone(start, std::move(points), std::get<AutoPlan>(options.plan), context);
}

void AddAttributes(std::span<const double> weights, const RunContext& context, StepClock& step,
                   PointFit& result) {
  if (!result.Faults().empty()) {
    result.attributes.clear();
  }
  if (!result.attributes.empty()) {
    result.attribute_fit =
        step("attributes", [&] { return AttributesOver(result, weights, context); });
    result.attribute_at = result.attribute_fit.At(result.fit.uv, context.threads);
  }
}

void AddSigma(const GivenPoints& given, const HSplineSurface& start, StepClock& step,
              PointFit& result) {
  if (result.Faults().empty()) {
    result.sigma = step("sigma", [&] { return SigmaOver(result, given, start); });
    result.sigma_mm = result.sigma->At(result.fit.uv);
  }
}

PointFit FoundBy(PlacedPoints placed, FitResult fit, std::vector<PointAttribute> attributes) {
  return {.parameters = std::string(NameOf(placed.parameters.source)),
          .how = std::move(placed.parameters.how),
          .map_faults = placed.parameters.faults,
          .moves = placed.moves,
          .fit = std::move(fit),
          .weighted_rms_mm = kNaN,
          .distance = {},
          .attributes = std::move(attributes),
          .attribute_at = {},
          .attribute_fit = {},
          .sigma = nullptr,
          .sigma_mm = {},
          .times = {}};
}

// Of the distances as residuals list them.
double RmsOf(std::span<const double> distances) {
  double sum = 0;
  for (const double distance : distances) {
    sum += distance * distance;
  }
  return std::sqrt(sum / static_cast<double>(distances.size()));
}

// What a fit tells of points with weights is weighted; people are told of all points alike first.
void TellRms(std::span<const double> weights, PointFit& result) {
  if (std::ranges::any_of(weights, [&](double weight) { return weight != weights[0]; })) {
    result.weighted_rms_mm = result.fit.point_rms_mm;
    result.fit.point_rms_mm = RmsOf(result.fit.residual_mm);
  }
}

// With them the same terms and points give the same surface by another plan.
void TellWeights(std::span<const Term> terms, FitResult& fit) {
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

// At the corners of 64 x 64 cells of the domain.
double ReachBeyond(const HSplineSurface& surface, const Box3& points) {
  constexpr int kCells = 64;
  double farthest = 0;
  for (int i = 0; i <= kCells; ++i) {
    for (int j = 0; j <= kCells; ++j) {
      const Vec3 at = surface.Point(Vec2(i, j) / kCells);
      farthest = std::max(farthest, points.exteriorDistance(at));
    }
  }
  return farthest / points.diagonal().norm();
}

void CompareWith(const GivenPoints& given, PointFit& result) {
  const std::optional<AutoReport>& report = result.fit.automatic;
  result.sigma_factor = given.has_sigma && report ? SigmaFactorOf(*report, given.weights) : kNaN;
  result.reach = ReachBeyond(result.fit.surface, given.box);
  result.off = given.has_uv ? kNaN : result.fit.point_rms_mm / given.box.diagonal().norm();
  result.distance = QuantilesOf(result.fit);
  TellRms(given.weights, result);
}

}  // namespace

std::vector<std::string> PointFit::Faults() const {
  std::vector<std::string> faults = FaultsIn(fit);
  constexpr double kMostReach = 3;
  if (faults.empty() && reach > kMostReach) {
    faults.push_back(
        fmt::format("the surface goes {:.3g} times the points' extent beyond them, where no point "
                    "holds it; fit pieces that lie apart each by itself, or take coarser levels "
                    "(fit.plan.finest), or, with plan: adaptive, a smoothness with more weight",
                    reach));
  }
  constexpr double kMostOff = 0.1;
  if (faults.empty() && off > kMostOff) {
    faults.push_back(
        fmt::format("the points lie {:.3g} mm (RMS{}) from the surface, {:.3g} % of their extent, "
                    "as points that fill space or lie on several sheets do; give (u,v), other "
                    "parameters, one sheet alone, or finer levels if it is one",
                    std::isfinite(weighted_rms_mm) ? weighted_rms_mm : fit.point_rms_mm,
                    std::isfinite(weighted_rms_mm) ? ", weighted" : "", 100 * off));
  }
  return faults;
}

PointFit FitPoints(PointTable table, const PointFitOptions& options, const RunContext& context) {
  const HSplineShape shape = ShapeOf(options);
  std::vector<PointAttribute> attributes = AttributesAsked(table, options);
  StepClock step(context);
  PlacedPoints placed = PlacePoints(table, options, step, context);
  std::vector<Vec2>& uv = placed.parameters.uv;
  const HSplineSurface start = StartSurface(shape, table.positions, uv);
  CheckChord(options.chord_mm, start, {table.positions, uv}, context);
  std::vector<ExactPoint> exact = ExactOf(table, uv);
  const GivenPoints given = GivenOf(table, placed.parameters.source, exact);
  OwnedPoints points{std::move(table.positions), std::move(uv), std::move(table.weights)};
  FitResult fit = step("fit", [&] {
    return FitOwned(start, std::move(points), std::move(exact), AfterMoves(options.fit), context);
  });
  PointFit result = FoundBy(std::move(placed), std::move(fit), std::move(attributes));
  CompareWith(given, result);
  AddAttributes(given.weights, context, step, result);
  if (options.sigma) {
    AddSigma(given, start, step, result);
  }
  TellWeights(options.fit.terms, result.fit);
  result.times = step.Take();
  return result;
}

}  // namespace semblance
