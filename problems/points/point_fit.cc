// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/point_fit.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
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
#include "problems/points/height_field.h"
#include "problems/report/plain_names.h"
#include "surfaces/base/error.h"
#include "surfaces/base/quantile.h"

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
// given: of each point, if not all take part.
Parametrisation FindParameters(PointTable& table, std::span<const Triangle> triangles,
                               std::span<const std::uint32_t> given,
                               const PointFitOptions& options) {
  const auto name_of = [&](std::size_t point) {
    return PointName(table, given.empty() ? point : given[point]);
  };
  return Parametrise({.positions = table.positions,
                      .given_uv = std::exchange(table.uv, {}),
                      .triangles = triangles,
                      .closure = options.closure,
                      .name_of = name_of,
                      .has_map_columns = table.has_map_columns},
                     options.parameters);
}

FootMoves MoveUv(const PointTable& table, std::span<const Triangle> triangles,
                 const PointFitOptions& options, const HSplineShape& shape,
                 const RunContext& context, std::vector<Vec2>& uv) {
  if (!table.exact.empty()) {
    throw InputError(
        "fit.plan.relaxation_rounds: exact points need their (u,v), and those around them, as they "
        "are; write relaxation_rounds: 0, or leave the column exact out");
  }
  MovedUv moved = MoveToFeet(shape, {table.positions, uv, table.weights}, triangles,
                             std::get<AutoPlan>(options.fit.plan), context);
  uv = std::move(moved.uv);
  return moved.moves;
}

// ------------------------------------------------------------- points that are left out

// The coordinates of points along an axis, ascending, with the points' indices.
using Along = std::vector<std::pair<double, std::size_t>>;

// The number of points that may be strays.
std::size_t MostStrays(std::size_t count) { return std::max<std::size_t>(count / 50, 1); }

// The range of all coordinates but the outermost that may be strays.
double InnerRange(std::span<const std::pair<double, std::size_t>> along) {
  const std::size_t outer = MostStrays(along.size());
  return along.size() > 2 * outer ? along[along.size() - 1 - outer].first - along[outer].first : 0;
}

// The first of several points with one value beyond all others, such as -9999 or 0 for no data; the
// size if there are none. widest: the widest inner range of the other axes.
std::size_t FindOneValue(const Along& along, double widest) {
  constexpr double kFar = 2;  // inner ranges between the value and the others
  std::size_t first = along.empty() ? 0 : along.size() - 1;
  while (first > 0 && along[first - 1].first == along.back().first) {
    --first;
  }
  if (along.size() - first < 2 || first < along.size() / 2 || first == 0) {
    return along.size();
  }
  const double range = std::max(widest, InnerRange(std::span(along).first(first)));
  return along[first].first - along[first - 1].first > kFar * range ? first : along.size();
}

// The first of a few points beyond a gap; the size if there are none.
std::size_t FindFew(const Along& along, double widest) {
  constexpr double kFar = 3, kFarOfWidest = 1.5;  // inner ranges, of this axis and of any
  const double range = InnerRange(along),
               gap = std::max(kFar * range, kFarOfWidest * std::max(widest, range));
  const std::size_t count = along.size(), most = std::min(MostStrays(count) + 1, count);
  for (std::size_t k = count - most; k + 1 < count; ++k) {
    if (along[k + 1].first - along[k].first > gap) {
      return k + 1;
    }
  }
  return count;
}

// Finds points far beyond all others along a coordinate axis. They would squeeze the others into a
// corner of (u,v). Heights z count by their spread, because they may have another unit.
class StraySearch {
 public:
  // left_out: per point; the flags of strays are set.
  StraySearch(std::span<const Vec3> positions, std::vector<char>& left_out)
      : positions_(positions), left_out_(left_out) {
    // Spread of z relative to that of x and y. Lower values keep more points above the others.
    constexpr double kShareOfPlaces = 0.3;
    const std::size_t every = std::max<std::size_t>(positions_.size() / kSample, 1);
    const double height = InnerRange(SortedAlong(2, every)),
                 place =
                     std::max(InnerRange(SortedAlong(0, every)), InnerRange(SortedAlong(1, every)));
    units_.z() = height > 0 && place > 0 ? kShareOfPlaces * place / height : 1;
  }

  void Run() {
    for (int round = 0; round < 2 && HasFarPoints(); ++round) {  // one kind may hide the other
      Flag(FindOneValue);
      Flag(FindFew);
    }
  }

 private:
  // Returns whether some point is so far from the quartiles of a sample that a search may find it.
  bool HasFarPoints() const {
    constexpr double kFar = 2.5;  // distances between quartiles, the widest
    Vec3 low = Vec3::Zero(), high = Vec3::Zero(), beyond = Vec3::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      const Along along = SortedAlong(axis, std::max<std::size_t>(positions_.size() / kSample, 1));
      if (along.empty()) {
        return false;
      }
      low[axis] = along[along.size() / 4].first;
      high[axis] = along[along.size() * 3 / 4].first;
    }
    for (std::size_t k = 0; k < positions_.size(); ++k) {
      if (left_out_[k] == 0) {
        const Vec3 p = positions_[k].cwiseProduct(units_);
        beyond = beyond.cwiseMax(low - p).cwiseMax(p - high);
      }
    }
    return beyond.maxCoeff() > kFar * (high - low).maxCoeff();
  }

  Along SortedAlong(int axis, std::size_t every) const {
    Along along;
    for (std::size_t k = 0; k < positions_.size(); k += every) {
      if (left_out_[k] == 0) {
        along.emplace_back(units_[axis] * positions_[k][axis], k);
      }
    }
    std::sort(along.begin(), along.end());
    return along;
  }

  // Flags the points that `find` finds at either end of an axis.
  template <class Find>
  void Flag(const Find& find) {
    std::array<Along, 3> along;
    Vec3 range;
    for (int axis = 0; axis < 3; ++axis) {
      along[axis] = SortedAlong(axis, 1);
      range[axis] = InnerRange(along[axis]);
    }
    for (int axis = 0; axis < 3; ++axis) {
      const double widest = std::max(range[(axis + 1) % 3], range[(axis + 2) % 3]);
      for (int end = 0; end < 2; ++end) {
        for (std::size_t k = find(along[axis], widest); k < along[axis].size(); ++k) {
          left_out_[along[axis][k].second] = 1;
        }
        std::ranges::reverse(along[axis]);
        std::ranges::for_each(along[axis], [](auto& entry) { entry.first *= -1; });
      }
    }
  }

  static constexpr std::size_t kSample = 10000;
  std::span<const Vec3> positions_;
  std::vector<char>& left_out_;
  Vec3 units_ = Vec3::Ones();  // factors of x, y and z
};

template <class Value>
void Keep(std::span<const char> left_out, std::vector<Value>& values) {
  std::size_t kept = 0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (left_out[k] == 0) {
      values[kept++] = values[k];
    }
  }
  values.resize(kept);
}

// Takes the points out of the table, with the triangles at them.
void TakeOut(std::span<const char> left_out, PointTable& table) {
  std::vector<std::int32_t> number(left_out.size());
  std::int32_t kept = 0;
  for (std::size_t k = 0; k < left_out.size(); ++k) {
    number[k] = left_out[k] == 0 ? kept++ : -1;
  }
  Keep(left_out, table.positions);
  Keep(left_out, table.uv);
  Keep(left_out, table.weights);
  for (Triangle& triangle : table.triangles) {
    std::ranges::for_each(triangle, [&](std::int32_t& corner) { corner = number[corner]; });
  }
  std::erase_if(table.triangles, [](const Triangle& t) { return std::ranges::min(t) < 0; });
  for (std::uint32_t& point : table.exact) {
    point = static_cast<std::uint32_t>(number[point]);
  }
}

// The points that take no part in the fit.
struct PointsOut {
  std::vector<char> left_out;         // per given point
  std::vector<std::uint32_t> strays;  // ascending
  std::size_t not_finite = 0;
  std::vector<std::uint32_t> given =
      {};  // given indices of the points that take part, if not all do

  bool Any() const { return not_finite + strays.size() > 0; }
};

PointsOut LeaveOut(PointTable& table, bool uv_given) {
  PointsOut out{.left_out = std::vector<char>(table.positions.size(), 0), .strays = {}};
  for (std::size_t k = 0; k < table.positions.size(); ++k) {
    out.left_out[k] = table.positions[k].allFinite() ? 0 : 1;
    out.not_finite += out.left_out[k];
  }
  std::vector<char> far = out.left_out;
  if (!uv_given && table.exact.empty()) {
    StraySearch(table.positions, far).Run();
  }
  for (std::uint32_t k = 0; k < far.size(); ++k) {
    if (far[k] != out.left_out[k]) {
      out.strays.push_back(k);
    }
    out.left_out[k] = far[k];
  }
  for (const std::uint32_t point : table.exact) {
    if (out.left_out[point] != 0) {
      throw InputError(
          fmt::format("{} is exact and not finite; give its coordinates", PointName(table, point)));
    }
  }
  if (out.Any()) {
    for (std::uint32_t k = 0; k < far.size(); ++k) {
      if (far[k] == 0) {
        out.given.push_back(k);
      }
    }
    TakeOut(out.left_out, table);
  }
  return out;
}

// ------------------------------------------------------------------ (u,v) and level 0

// The sides of the domain in space; NaN where they are not known.
Vec2 SidesOf(const Parametrisation& parameters, std::span<const Vec3> positions, Closure closure) {
  constexpr double kMostSlant = 0.5;  // cosine, beyond which (u,v) in other units bend the sides
  if (closure != Closure::kOpen || parameters.source != ParameterSource::kGiven) {
    return parameters.lengths_mm;
  }
  const HSplineShape one{.patches_u = 1, .patches_v = 1, .max_level = 0};
  const SurfaceFrame frame = StartSurface(one, positions, parameters.uv).Frame({0.5, 0.5});
  const double slant = std::abs(frame.du.dot(frame.dv)) / (frame.du.norm() * frame.dv.norm());
  return slant < kMostSlant ? Vec2(frame.du.norm(), frame.dv.norm()) : Vec2::Constant(kNaN);
}

// The shape with about as many patches of level 0, which are square in a domain with these sides.
// points: their number; a long strip gets more patches if they allow it.
HSplineShape BySides(HSplineShape shape, const Vec2& sides_mm, std::size_t points) {
  constexpr double kMostLong = 3;  // of a patch, relative to its width
  constexpr double kPointsPerPatch = 6;
  const double longer = sides_mm.x() / shape.patches_u / (sides_mm.y() / shape.patches_v);
  if (shape.ClosedU() || !(longer > kMostLong || longer < 1 / kMostLong)) {
    return shape;
  }
  const double patches = static_cast<double>(shape.patches_u) * shape.patches_v,
               aspect = sides_mm.x() / sides_mm.y(), most = kMaxPatches >> shape.max_level;
  const auto along = [&](double ratio) {
    const double in_strip = std::min(ratio, static_cast<double>(points) / kPointsPerPatch);
    const double count = ratio > patches ? std::max(patches, in_strip) : std::sqrt(patches * ratio);
    return static_cast<int>(std::clamp(std::round(count), 1.0, most));
  };
  shape.patches_u = along(aspect);
  shape.patches_v = along(1 / aspect);
  return shape;
}

HSplineShape ShapeOver(const Parametrisation& parameters, const PointTable& table,
                       const PointFitOptions& options) {
  const HSplineShape shape = ShapeFor(options);
  return options.patches_by_shape
             ? BySides(shape, SidesOf(parameters, table.positions, options.closure),
                       table.positions.size())
             : shape;
}

struct PreparedPoints {
  Parametrisation parameters;
  HSplineShape shape;
  std::optional<FootMoves> moves = {};
};

PreparedPoints PlacePoints(PointTable& table, std::span<const std::uint32_t> given,
                           const PointFitOptions& options, StepClock& step,
                           const RunContext& context) {
  if (const std::string fault = ClosureFault(options); !fault.empty()) {
    throw InputError("closure: " + fault);
  }
  const std::vector<Triangle> triangles = std::exchange(table.triangles, {});
  PreparedPoints placed{
      .parameters =
          step("parameters", [&] { return FindParameters(table, triangles, given, options); }),
      .shape = {}};
  placed.shape = ShapeOver(placed.parameters, table, options);
  if (RelaxationRounds(options.fit) == 0 && placed.parameters.is_graph && IsAlone(options.fit)) {
    placed.shape.reference = OffsetReference::kWorld;  // so that z can be scaled
  }
  if (RelaxationRounds(options.fit) > 0) {
    placed.moves = step("relaxation", [&] {
      return MoveUv(table, triangles, options, placed.shape, context, placed.parameters.uv);
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
  bool on_line = false;  // heights alone, without places
  bool has_sigma = false;
};

bool LieOnLine(std::span<const Vec3> positions) {
  constexpr double kNarrow = 1e-4;  // share of the mean squares across the line
  Vec3 mean = Vec3::Zero();
  for (const Vec3& p : positions) {
    mean += p / static_cast<double>(positions.size());
  }
  Mat3 moments = Mat3::Zero();
  for (const Vec3& p : positions) {
    moments += (p - mean) * (p - mean).transpose();
  }
  const Vec3 squares = Eigen::SelfAdjointEigenSolver<Mat3>(moments).eigenvalues();
  return squares[1] < kNarrow * squares[2];
}

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
  given.on_line = LieOnLine(table.positions);
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

// Returns how far the surface goes beyond the box, in units of `size`. It looks at a grid of
// places; more of them would only refine a figure that is compared with 3.
double ReachBeyond(const HSplineSurface& surface, const Box3& box, double size) {
  constexpr int kCells = 64;  // along u and v
  double farthest = 0;
  for (int i = 0; i <= kCells; ++i) {
    for (int j = 0; j <= kCells; ++j) {
      const Vec3 at = surface.Point(Vec2(i, j) / kCells);
      farthest = std::max(farthest, box.exteriorDistance(at));
    }
  }
  return farthest / size;
}

bool IsOutlier(const FitResult& fit, std::uint32_t k) {
  return fit.automatic && std::ranges::binary_search(fit.automatic->outliers, k);
}

// The distances of the points that are no outliers.
std::vector<double> CountedDistances(const FitResult& fit) {
  std::vector<double> distances_mm;
  distances_mm.reserve(fit.residual_mm.size());
  for (std::uint32_t k = 0; k < fit.residual_mm.size(); ++k) {
    if (!IsOutlier(fit, k)) {
      distances_mm.push_back(fit.residual_mm[k]);
    }
  }
  return distances_mm;
}

// Compares shapes, in the coordinates of the fit.
void CompareShapes(const GivenPoints& given, PointFit& result) {
  const double diagonal = given.box.diagonal().norm();
  result.reach = ReachBeyond(result.fit.surface, given.box, diagonal);
  result.off = given.has_uv && given.on_line
                   ? kNaN
                   : RootMeanSquare(CountedDistances(result.fit)) / diagonal;
}

// The same as RootMeanSquare(CountedDistances(fit)), with weights.
double WeightedRms(const FitResult& fit, std::span<const double> weights) {
  double sum = 0, all = 0;
  for (std::uint32_t k = 0; k < weights.size(); ++k) {
    if (!IsOutlier(fit, k)) {
      sum += weights[k] * fit.residual_mm[k] * fit.residual_mm[k];
      all += weights[k];
    }
  }
  return std::sqrt(sum / all);
}

// Compares distances, in the unit of the points.
void CompareDistances(const GivenPoints& given, PointFit& result) {
  const std::optional<AutoReport>& report = result.fit.automatic;
  const std::span<const double> weights = given.weights;
  result.sigma_factor = given.has_sigma && report ? SigmaFactor(*report, weights) : kNaN;
  result.distance = ComputeQuantiles(result.fit);
  if (std::ranges::any_of(weights, [&](double weight) { return weight != weights[0]; })) {
    result.weighted_rms_mm = WeightedRms(result.fit, weights);
  }
  result.fit.point_rms_mm = RootMeanSquare(CountedDistances(result.fit));
  result.rms_of_all_mm = RootMeanSquare(result.fit.residual_mm);
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

// Spreads values of the points that take part over all given points; NaN elsewhere.
template <class Value>
void SpreadBack(const PointsOut& out, const Value& none, std::vector<Value>& values) {
  std::vector<Value> all(values.empty() ? 0 : out.left_out.size(), none);
  for (std::size_t n = 0; n < values.size(); ++n) {
    all[out.given[n]] = values[n];
  }
  values = std::move(all);
}

// Brings the result to the order and the numbers of the given points.
void RestoreOrder(const PointsOut& out, PointFit& result) {
  result.strays = out.strays;
  result.not_finite = out.not_finite;
  if (!out.Any()) {
    return;
  }
  SpreadBack(out, Vec2(Vec2::Constant(kNaN)), result.fit.uv);
  SpreadBack(out, kNaN, result.fit.residual_mm);
  SpreadBack(out, kNaN, result.sigma_mm);
  SpreadBack(out, kNaN, result.weights);
  for (std::vector<double>& values : result.attribute_at) {
    SpreadBack(out, kNaN, values);
  }
  if (result.fit.automatic) {
    AutoReport& report = *result.fit.automatic;
    for (std::vector<std::uint32_t>* const indices : {&report.outliers, &report.repeated}) {
      std::ranges::for_each(*indices, [&](std::uint32_t& k) { k = out.given[k]; });
    }
    std::vector<std::uint32_t> outliers;
    std::ranges::set_union(report.outliers, out.strays, std::back_inserter(outliers));
    report.outliers = std::move(outliers);
  }
}

// States that a part of the points lies much farther from the surface than most; empty if none
// does, or if those are outliers.
std::string TailText(const FitResult& fit, std::string_view unit) {
  constexpr double kLongTail = 3;  // RMS over median; 1.5 for normal errors, 2 for Laplace's
  if (!fit.automatic || fit.automatic->met_to_rounding) {
    return "";
  }
  std::vector<double> distances = CountedDistances(fit);
  if (distances.empty()) {
    return "";
  }
  const double rms_mm = RootMeanSquare(distances), median_mm = UpperMedian(distances);
  return rms_mm > kLongTail * median_mm
             ? fmt::format(
                   "the distances have a long tail: half of the points lie within {}, and the RMS "
                   "is {}; many points may be gross errors that were not recognised, and the "
                   "surface follows them; clean the points, and fit again",
                   LengthText(median_mm, unit, 3), LengthText(rms_mm, unit, 3))
             : "";
}

std::string LeftOutText(const PointsOut& out) {
  constexpr std::size_t kMostNamed = 5;
  std::string named;
  for (std::size_t n = 0; n < std::min(out.strays.size(), kMostNamed); ++n) {
    named += fmt::format("{}{}", n > 0 ? ", " : "", out.strays[n] + 1);
  }
  return fmt::format(
      "{} far beyond all others {} left out: {} {}{}", Counted(std::ssize(out.strays), "point"),
      out.strays.size() == 1 ? "was" : "were", out.strays.size() == 1 ? "number" : "numbers", named,
      out.strays.size() > kMostNamed ? ", ..." : "");
}

// States that the points lie in two places, if there is a wide gap along u or v.
std::string GapText(std::vector<Vec2> uv) {
  constexpr double kWideGap = 0.4;     // of the domain
  constexpr std::size_t kOneIn = 100;  // points that lie beyond the gap at least
  for (const int c : {0, 1}) {
    std::ranges::sort(uv, {}, [&](const Vec2& p) { return p[c]; });
    for (std::size_t k = uv.size() / kOneIn; k + uv.size() / kOneIn < uv.size(); ++k) {
      if (k > 0 && uv[k][c] - uv[k - 1][c] > kWideGap) {
        return fmt::format(
            "the points lie in two places, with {:.0f} % of {} between them empty: nothing holds "
            "the surface there; fit each place by itself for its detail",
            100 * (uv[k][c] - uv[k - 1][c]), c == 0 ? "u" : "v");
      }
    }
  }
  return "";
}

// What was left out of the table, and what about the points looks doubtful.
std::vector<std::string> FindNotes(const PointTable& table, const PointsOut& out,
                                   const PreparedPoints& placed, const PointFitOptions& options) {
  std::vector<std::string> notes = table.notes;
  if (out.not_finite > 0) {
    notes.push_back(fmt::format("{} without finite coordinates left out",
                                Counted(static_cast<long long>(out.not_finite), "point")));
  }
  if (!out.strays.empty()) {
    notes.push_back(LeftOutText(out));
  }
  if (const HSplineShape asked = ShapeFor(options);
      placed.shape.patches_u != asked.patches_u || placed.shape.patches_v != asked.patches_v) {
    notes.push_back(fmt::format(
        "level 0 has {} x {} patches in place of {} x {}, by the shape of "
        "the domain; patches_by_shape: false keeps them",
        placed.shape.patches_u, placed.shape.patches_v, asked.patches_u, asked.patches_v));
  }
  if (options.closure == Closure::kOpen) {
    if (std::string gap = GapText(placed.parameters.uv); !gap.empty()) {
      notes.push_back(std::move(gap));
    }
  }
  return notes;
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
    faults.push_back(
        fmt::format("the points lie {} (RMS) from the surface, {:.3g} % of their extent, "
                    "as points that fill space or lie on several sheets do; give (u,v), other "
                    "parameters, one sheet alone, or finer levels if it is one",
                    LengthText(fit.point_rms_mm, unit, 3), 100 * off));
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
  AddAttributes(given.weights, context, step, result);
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
  if (std::string tail = TailText(result.fit, options.unit); !tail.empty()) {
    notes.push_back(std::move(tail));
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
