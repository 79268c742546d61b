// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/point_fit.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <set>
#include <span>
#include <utility>

#include "fitting/least_squares/patch_energy.h"
#include "fitting/plan/alone_fit.h"
#include "fitting/plan/fit_check.h"
#include "fitting/problem/start_surface.h"
#include "fitting/solve/auto_weight.h"
#include "problems/points/fit_files.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

// ------------------------------------------------------------- faults of the options

HSplineShape ShapeFor(const PointFitOptions& options) {
  return {.patches_u = options.patches_u,
          .patches_v = options.patches_v,
          .max_level = FinestPlanLevel(options.fit.plan),
          .closure = options.closure};
}

// Each of the following returns what is wrong and what to do, or nothing.

std::string ClosureFault(const PointFitOptions& options) {
  const bool goes_round = options.closure == Closure::kPeriodicU;
  if (std::holds_alternative<CylinderParameters>(options.parameters) && !goes_round) {
    return "parameters on a cylinder go round in u; write closure: periodic_u";
  }
  if (std::holds_alternative<PlaneParameters>(options.parameters) && goes_round) {
    return "parameters on a plane do not go round; write closure: open";
  }
  if (std::holds_alternative<MeshParameters>(options.parameters) && goes_round) {
    return "parameters on a mesh do not go round; write closure: open";
  }
  return "";
}

std::string AttributesFault(const std::vector<std::string>& names) {
  static const std::set<std::string> kTaken = {
      "x",  "y",  "z",  "u", "v", "weight", "sigma",    "residual_mm", "outlier",
      "nx", "ny", "nz", "s", "t", "point",  "sigma_mm", "exact"};
  std::set<std::string> seen;
  for (const std::string& name : names) {
    const std::string residual = name + "_residual";
    if (std::find(names.begin(), names.end(), residual) != names.end()) {
      return fmt::format(
          "'{}' is the name of the residuals of '{}' in the residuals' file; give the column "
          "another name",
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

std::string ShapeFault(const HSplineShape& shape) try {
  // 1024 x 1024 patches: a fit needs about a gigabyte for them, however few points there are.
  constexpr std::int64_t kMostVertices = 1'100'000;
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

// The option to blame: patches_v, if as many patches along v as along u would be allowed.
std::string_view WrongPatches(HSplineShape shape) {
  shape.patches_v = shape.patches_u;
  return ShapeFault(shape).empty() ? "patches_v" : "patches_u";
}

// The part of a subject that a term needs and that points of a file lack; empty if there is none.
std::string_view MissingPart(const Term& term) {
  return std::holds_alternative<LandmarkTerm>(term)         ? "standard landmarks"
         : std::holds_alternative<PriorShapeTerm>(term)     ? "a prior's face"
         : std::holds_alternative<NonPenetrationTerm>(term) ? "bone"
         : std::holds_alternative<SpringTerm>(term)         ? "bone"
                                                            : "";
}

int RelaxationRounds(const FitOptions& fit) {
  const auto* const plan = std::get_if<AutoPlan>(&fit.plan);
  return plan == nullptr ? 0 : plan->relaxation_rounds;
}

// The options of the fit itself, before which (u,v) have been moved.
FitOptions WithoutRelaxation(FitOptions fit) {
  if (auto* const plan = std::get_if<AutoPlan>(&fit.plan)) {
    plan->relaxation_rounds = 0;
  }
  return fit;
}

void AddTermFaults(std::span<const Term> terms, std::vector<OptionFault>& faults) {
  for (std::size_t k = 0; k < terms.size(); ++k) {
    if (const std::string_view missing = MissingPart(terms[k]);
        !missing.empty() && TermWeight(terms[k]) > 0) {
      faults.push_back({fmt::format("fit.terms[{}]", k),
                        fmt::format("the term '{}' needs {}, and points of a file have none; "
                                    "leave it out",
                                    TermName(terms[k]), missing)});
    }
  }
}

}  // namespace

std::vector<OptionFault> FaultsBetween(const PointFitOptions& options) {
  std::vector<OptionFault> faults;
  const auto add = [&](std::string path, std::string fault) {
    if (!fault.empty()) {
      faults.push_back({std::move(path), std::move(fault)});
    }
  };
  const HSplineShape shape = ShapeFor(options);
  add("closure", ClosureFault(options));
  add(std::string(WrongPatches(shape)), ShapeFault(shape));
  if (options.sigma && !IsAlone(options.fit)) {
    add("sigma",
        "it follows from the noise and smoothness that plan: auto finds with solver: fastest; take "
        "those, or write sigma: false");
  }
  add("attributes", AttributesFault(options.attributes));
  if (!std::holds_alternative<RestoreFeatures>(options.fit.features)) {
    add("fit.features", "a surface through points of a file has no features; leave the option out");
  }
  AddTermFaults(options.fit.terms, faults);
  for (const FitFault& fault : FindFitFaults(WithoutRelaxation(options.fit), shape.max_level)) {
    add("fit." + fault.path, fault.what);
  }
  return faults;
}

namespace {

// --------------------------------------------------------------------- before the fit

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

// Moves (u,v) and triangles out of the table, so that their memory is free during the fit.
Parametrisation FindParameters(PointTable& table, std::span<const Triangle> triangles,
                               const PointFitOptions& options) {
  return Parametrise({.positions = table.positions,
                      .given_uv = std::exchange(table.uv, {}),
                      .triangles = triangles,
                      .closure = options.closure,
                      .name_of = [&](std::size_t point) { return PointName(table, point); }},
                     options.parameters);
}

FootMoves MoveUv(const PointTable& table, std::span<const Triangle> triangles,
                 const PointFitOptions& options, const RunContext& context, std::vector<Vec2>& uv) {
  if (!table.exact.empty()) {
    throw InputError(
        "fit.plan.relaxation_rounds: exact points need their (u,v), and those around them, as they "
        "are; write relaxation_rounds: 0, or leave the column exact out");
  }
  MovedUv moved = MoveToFeet(ShapeFor(options), {table.positions, uv, table.weights}, triangles,
                             std::get<AutoPlan>(options.fit.plan), context);
  uv = std::move(moved.uv);
  return moved.moves;
}

struct PreparedPoints {
  Parametrisation parameters;
  std::optional<FootMoves> moves = {};
};

PreparedPoints PlacePoints(PointTable& table, const PointFitOptions& options, StepClock& step,
                           const RunContext& context) {
  if (const std::string fault = ClosureFault(options); !fault.empty()) {
    throw InputError("closure: " + fault);
  }
  const std::vector<Triangle> triangles = std::exchange(table.triangles, {});
  PreparedPoints placed{
      step("parameters", [&] { return FindParameters(table, triangles, options); }), {}};
  if (RelaxationRounds(options.fit) > 0) {
    placed.moves = step("relaxation", [&] {
      return MoveUv(table, triangles, options, context, placed.parameters.uv);
    });
  }
  return placed;
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

// Facts about the points that are needed after the fit, which frees their positions.
struct GivenPoints {
  std::vector<double> weights;
  std::vector<Vec2> exact_uv;
  Box3 box;
  bool has_uv = false;
  bool has_sigma = false;
};

GivenPoints KeepFacts(const PointTable& table, ParameterSource source,
                      std::span<const ExactPoint> exact) {
  GivenPoints given{.weights = table.weights,
                    .exact_uv = {},
                    .box = {},
                    .has_uv = source == ParameterSource::kGiven,
                    .has_sigma = table.weights_of_sigma};
  for (const Vec3& p : table.positions) {
    given.box.extend(p);
  }
  std::ranges::transform(exact, std::back_inserter(given.exact_uv), &ExactPoint::uv);
  return given;
}

// ------------------------------------------------------------------------- the fit

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

// ---------------------------------------------------------------------- after the fit

// Indices of the outliers and of the copies of other points, which the auto plan leaves out.
std::vector<std::uint32_t> PointsLeftOut(const std::optional<AutoReport>& report) {
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
                       PointsLeftOut(result.fit.automatic), context.threads);
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

std::shared_ptr<const SurfaceSigma> SigmaOver(const PointFit& result, const GivenPoints& given,
                                              const HSplineSurface& start) {
  const AutoReport& report = *result.fit.automatic;
  const std::span<const double> weights = given.weights;
  const SigmaOptions options{.noise_mm = report.noise_mm,
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
    result.sigma_mm = result.sigma->At(result.fit.uv);
  }
}

// The noise of a point of mean weight over its given sigma. The weights are 1 / sigma^2; the mean
// is over the points that are no outliers.
double SigmaFactor(const AutoReport& report, std::span<const double> weights) {
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

double RootMeanSquare(std::span<const double> distances) {
  double sum = 0;
  for (const double distance : distances) {
    sum += distance * distance;
  }
  return std::sqrt(sum / static_cast<double>(distances.size()));
}

// The fit's RMS is weighted. Reports show the unweighted RMS first.
void SplitRms(std::span<const double> weights, PointFit& result) {
  if (std::ranges::any_of(weights, [&](double weight) { return weight != weights[0]; })) {
    result.weighted_rms_mm = result.fit.point_rms_mm;
    result.fit.point_rms_mm = RootMeanSquare(result.fit.residual_mm);
  }
}

// Returns how far the surface goes beyond the box, in diagonals of the box. It looks at a grid of
// places; more of them would only refine a figure that is compared with 3.
double ReachBeyond(const HSplineSurface& surface, const Box3& box) {
  constexpr int kCells = 64;  // along u and v
  double farthest = 0;
  for (int i = 0; i <= kCells; ++i) {
    for (int j = 0; j <= kCells; ++j) {
      const Vec3 at = surface.Point(Vec2(i, j) / kCells);
      farthest = std::max(farthest, box.exteriorDistance(at));
    }
  }
  return farthest / box.diagonal().norm();
}

void CompareWithPoints(const GivenPoints& given, PointFit& result) {
  const std::optional<AutoReport>& report = result.fit.automatic;
  result.sigma_factor = given.has_sigma && report ? SigmaFactor(*report, given.weights) : kNaN;
  result.reach = ReachBeyond(result.fit.surface, given.box);
  result.off = given.has_uv ? kNaN : result.fit.point_rms_mm / given.box.diagonal().norm();
  result.distance = ComputeQuantiles(result.fit);
  SplitRms(given.weights, result);
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

PointFit BeginResult(PreparedPoints placed, FitResult fit, std::vector<PointAttribute> attributes) {
  const Parametrisation& parameters = placed.parameters;
  return {.parameters = std::string(
              EnumNames(parameters.source)[static_cast<std::size_t>(parameters.source)]),
          .how = parameters.how,
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

std::vector<std::string> PointFit::Faults() const {
  // Both limits are far beyond good fits and short of what nobody would use: a surface that follows
  // its points has a reach below 1, and points of one sheet lie within a few percent of it.
  constexpr double kMostReach = 3, kMostOff = 0.1;
  std::vector<std::string> faults = FaultsIn(fit);
  if (faults.empty() && reach > kMostReach) {
    faults.push_back(
        fmt::format("the surface goes {:.3g} times the points' extent beyond them, where no point "
                    "holds it; fit pieces that lie apart each by itself, or take coarser levels "
                    "(fit.plan.finest), or, with plan: adaptive, a smoothness with more weight",
                    reach));
  }
  if (faults.empty() && off > kMostOff) {
    const bool weighted = std::isfinite(weighted_rms_mm);
    faults.push_back(fmt::format(
        "the points lie {:.3g} mm (RMS{}) from the surface, {:.3g} % of their extent, "
        "as points that fill space or lie on several sheets do; give (u,v), other "
        "parameters, one sheet alone, or finer levels if it is one",
        weighted ? weighted_rms_mm : fit.point_rms_mm, weighted ? ", weighted" : "", 100 * off));
  }
  return faults;
}

std::optional<ToleranceReport> CompareWithTolerance(const PointFitOptions& options,
                                                    const PointFit& result) {
  const auto* adaptive = std::get_if<AdaptivePlan>(&options.fit.plan);
  return adaptive == nullptr || !result.Faults().empty()
             ? std::nullopt
             : std::optional(CompareWithTolerance(result.fit, *adaptive));
}

PointFit FitPoints(PointTable table, const PointFitOptions& options, const RunContext& context) {
  std::vector<PointAttribute> attributes = TakeAttributes(table, options);
  StepClock step(context);
  PreparedPoints placed = PlacePoints(table, options, step, context);
  std::vector<Vec2>& uv = placed.parameters.uv;
  const HSplineSurface start = StartSurface(ShapeFor(options), table.positions, uv);
  CheckChord(options.chord_mm, start, {table.positions, uv}, context);
  std::vector<ExactPoint> exact = ExactPoints(table, uv);
  const GivenPoints given = KeepFacts(table, placed.parameters.source, exact);
  OwnedPoints points{std::move(table.positions), std::move(uv), std::move(table.weights)};
  FitResult fit = step("fit", [&] {
    return FitOwned(start, std::move(points), std::move(exact), WithoutRelaxation(options.fit),
                    context);
  });
  PointFit result = BeginResult(std::move(placed), std::move(fit), std::move(attributes));
  CompareWithPoints(given, result);
  AddAttributes(given.weights, context, step, result);
  if (options.sigma) {
    AddSigma(given, start, step, result);
  }
  ConvertWeights(options.fit.terms, result.fit);
  result.times = step.Take();
  return result;
}

}  // namespace semblance::problems
