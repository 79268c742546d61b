// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/nested_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <span>
#include <utility>

#include "fitting/nested/neighbour_noise.h"
#include "fitting/nested/nested_steps.h"
#include "fitting/nested/outlier_search.h"
#include "fitting/nested/unresolved_detail.h"
#include "fitting/nested/weight_search.h"
#include "surfaces/base/error.h"
#include "surfaces/base/quantile.h"

namespace semblance {
namespace {

using Residual = NestedResidual;
using Indices = std::vector<std::uint32_t>;

constexpr int kMostRounds = 24;
constexpr std::size_t kFewestLooked = 100000, kPointsPerVertex = 24;
constexpr double kAsGood = 1.001;            // of the mean square held out
constexpr double kFewNew = 0.007;            // of the vertices: not worth a round
constexpr double kFewMore = 0.02;            // the same after a round that gained nothing
constexpr double kDense = 1.25;              // points for a patch of the next level
constexpr double kCheapDense = 0.3;          // the same where all patches together are few
constexpr std::size_t kCheap = 50000;        // points
constexpr int kQuick = 10000;                // vertices: solves take no time to speak of
constexpr double kSure = 1;                  // standard errors of a correlation
constexpr std::size_t kPatchesPerPoint = 4;  // of a level: more take time
// Of the extent. What is left below it is rounding: the mean square is a difference of sums.
constexpr double kRounding = 1e-8;

[[noreturn]] void Fail(const std::string& what) { throw InputError("fit: plan auto: " + what); }

constexpr std::size_t kFewestPoints = 16;
[[noreturn]] void FailForFew(std::size_t count, const char* of_kind) {
  Fail(
      fmt::format("{} points{} are too few to leave some out; give at least {}, or take another "
                  "plan",
                  count, of_kind, kFewestPoints));
}

// One in ten, by its place along the curve.
bool IsHeld(std::uint32_t k) {
  const std::uint64_t bits = (k + 1) * 0xD1B54A32D192ED03u;
  return (bits ^ bits >> 31) % 10 == 0;
}

// The finest level on which a patch with points has more than one of them on the mean.
int FinestByDensity(const NestedPoints& points, std::size_t every, const GridLayout& level0,
                    int finest) {
  constexpr double kPointsPerPatch = 1.3;
  constexpr std::size_t kFewPatches = 1 << 20;
  const std::size_t count = (points.size() + every - 1) / every;
  GridLayout layout = level0;
  for (int level = 1; level <= finest; ++level) {
    layout = layout.Finer();
    std::size_t occupied = 0, last = layout.Patches();
    for (std::size_t k = 0; k < points.size(); k += every) {
      const auto [i, j] = PatchOn(layout.grid, level, points.X(k), points.Y(k));
      const std::size_t patch = layout.Patch(i, j);
      occupied += patch != last ? 1 : 0;
      last = patch;
    }
    if (static_cast<double>(count) < kPointsPerPatch * static_cast<double>(occupied) ||
        layout.Patches() > std::max(kPatchesPerPoint * count, kFewPatches)) {
      return level - 1;
    }
  }
  return finest;
}

struct Snapshot {
  NestedSpace space;
  NestedSolve::Packed solution;
  double weight = kNaN;
  double known = kNaN;  // weight for all points, where a search by as good as all has found it
  BendingMetric metric;
  double held_square = kNaN;
  int round = -1;
};

class NestedFitter {
 public:
  NestedFitter(const HSplineSurface& start, NestedPoints points, const AutoPlan& plan,
               const RunContext& context)
      : start_(start),
        plan_(plan),
        context_(context),
        points_(std::move(points)),
        solve_(points_, MeanLengths(start)),
        rounding_mm_(kRounding * MeanLengths(start).norm()),
        space_(start.shape()),
        cap_(FinestAllowed(plan, start.shape())),
        outlier_(points_.size(), 0) {
    finest_ = FinestByDensity(points_, 1, space_[0].layout, cap_);
  }

  NestedFitResult Run() {
    Look();
    BeforeAnyFit();
    for (int round = 0; round < kMostRounds; ++round) {
      context_.ThrowIfStopped();
      context_.Report("fit",
                      fmt::format("{} vertices to level {}", space_.Vertices(), space_.finest()));
      FitRound();
      if (IsMet() || !Refine()) {
        break;
      }
    }
    return Finish();
  }

 private:
  // Some of the points, as many as the vertices need.
  void Look() {
    const std::size_t enough =
        std::max(kFewestLooked, kPointsPerVertex * static_cast<std::size_t>(space_.Vertices()));
    const std::size_t every = std::max<std::size_t>(points_.size() / enough, 1);
    if (every == every_) {
      return;
    }
    every_ = every;
    finest_seen_ = FinestByDensity(points_, every_, space_[0].layout, finest_);
  }

  bool IsCheap() const { return points_.size() < kCheap; }
  bool IsQuick() const { return space_.Vertices() < kQuick; }
  // What a solve leaves of its gain; where it takes long, as much as the search can do with.
  double PartLeft() const { return IsQuick() ? 0.01 : 0.1; }

  template <class Visit>
  void ForEachLooked(const Visit& visit) const {
    for (std::size_t k = 0, n = 0; k < points_.size(); k += every_, ++n) {
      visit(n, static_cast<std::uint32_t>(k));
    }
  }

  Indices Kept() const {
    Indices indices;
    indices.reserve(points_.size() / every_ + 1);
    ForEachLooked([&](std::size_t, std::uint32_t k) {
      if (outlier_[k] == 0) {
        indices.push_back(k);
      }
    });
    return indices;
  }

  // One point in `every_`, but for outliers and those held out.
  PointChoice Fitted() const {
    PointChoice choice{.every = every_, .left_out = outlier_};
    ForEachLooked([&](std::size_t, std::uint32_t k) { choice.left_out[k] |= IsHeld(k) ? 1 : 0; });
    return choice;
  }

  // Of those that are looked at.
  ResidualsBetween Residuals() const {
    return [this](std::size_t begin, std::size_t end) {
      return std::span(residuals_).subspan(begin, end - begin);
    };
  }

  // The displacements themselves tell the grossest outliers, which would bend the first surface.
  void BeforeAnyFit() {
    if (plan_.outliers == OutlierRule::kKeep) {
      return;
    }
    residuals_.clear();
    ForEachLooked([&](std::size_t, std::uint32_t k) {
      const Vec3& value = points_.value[k];
      residuals_.push_back({{value[0], value[1], value[2]}});
    });
    Find(Residuals(), /*noise_mm=*/0);
  }

  LeastSpread Least(double noise_mm) const {
    constexpr double kAtBorders = 10;  // rounding lets the smoothness show, more so there
    return {.noise_mm = noise_mm, .rounding_mm = kAtBorders * rounding_mm_};
  }

  // Returns how many there are. What is told of points is told of those of mean weight among the
  // others.
  int Find(const ResidualsBetween& residuals, double noise_mm) {
    // Gross errors bend the first surface so that some of them are not far from it.
    const OutlierTail tail = report_.rounds.empty() ? OutlierTail::kGoes : OutlierTail::kStays;
    const int count = FindOutliers(points_, every_, residuals, Least(noise_mm), tail, outlier_);
    points_.TakeMeanWeight(outlier_);
    return count;
  }

  void FitRound() {
    Look();
    PointChoice fitted = Fitted();
    const std::size_t count = fitted.Count(points_);
    solve_.Begin(space_, std::move(fitted), metric_);
    NestedWeightSearch search(count, solve_, PartLeft(), least_gain_);
    if (std::isnan(weight_)) {
      search.Scan();
      search.Climb(4, search.Finish().weight);
    } else {
      search.ClimbAnew(4, weight_);
    }
    SearchLengths(search);
    const NestedWeight chosen = search.Finish();
    between_ = search.Between();
    least_gain_ = search.least_gain();
    if (std::isnan(chosen.weight)) {
      Fail("no smoothness has a usable solve; give more points than a plane needs");
    }
    weight_ = chosen.weight;
    metric_ = solve_.metric();
    Judge(chosen, search.steps());
  }

  // The lengths in which the surface bends.
  void SearchLengths(NestedWeightSearch& search) {
    if (!plan_.stretched) {
      return;
    }
    if (space_.finest() >= finest_ && space_.finest() > finest_scanned_ && HasFoundNothing()) {
      search.ScanStretches(4);
      finest_scanned_ = space_.finest();
    }
    search.Stretch(4);
  }

  // Vertices as dense as the points have not brought the surface nearer to those held out, yet
  // the closest points agree.
  bool HasFoundNothing() const {
    constexpr double kNothing = 0.7;
    const std::vector<NestedRound>& rounds = report_.rounds;
    return !rounds.empty() &&
           rounds.back().held_out_rms_mm > kNothing * rounds.front().held_out_rms_mm &&
           ClosestAgree();
  }

  // By the points held out.
  void Judge(const NestedWeight& chosen, int steps) {
    residuals_ = solve_.ResidualsOf({.every = every_});
    std::vector<double> squares;
    double weights = 0;
    ForEachLooked([&](std::size_t n, std::uint32_t k) {
      if (IsHeld(k) && outlier_[k] == 0) {
        squares.push_back(Scaled(residuals_[n], k).Square());
        weights += points_.Scale(k) * points_.Scale(k);
      }
    });
    const double held = squares.empty() ? kNaN
                                        : std::accumulate(squares.begin(), squares.end(), 0.0) /
                                              weights / points_.channels;
    if (plan_.outliers == OutlierRule::kDrop) {
      outliers_ = Find(Residuals(), HeldSd(std::move(squares)));
    }
    report_.rounds.push_back({.finest = space_.finest(),
                              .vertices = space_.Vertices(),
                              .weight = chosen.weight,
                              .stretch = FindStretch(metric_).stretch,
                              .direction_deg = FindStretch(metric_).direction_deg,
                              .degrees_of_freedom = chosen.degrees_of_freedom,
                              .rms_mm = std::sqrt(chosen.mean_square),
                              .held_out_rms_mm = std::sqrt(held),
                              .steps = steps,
                              .outliers = outliers_});
    if (!best_ || held * kAsGood < best_->held_square) {
      best_ = Snapshot{.space = space_,
                       .solution = solve_.Solution(),
                       .weight = weight_,
                       .known = IsQuick() || every_ > 1 ? kNaN : between_,
                       .metric = metric_,
                       .held_square = held,
                       .round = static_cast<int>(report_.rounds.size()) - 1};
    }
  }

  // Points without noise, on a surface that the space holds.
  bool IsMet() const { return report_.rounds.back().held_out_rms_mm <= rounding_mm_; }

  // As far as one of a point of mean weight that is as likely.
  Residual Scaled(Residual residual, std::uint32_t k) const {
    for (double& along : residual.along) {
      along *= points_.Scale(k);
    }
    return residual;
  }

  // Along one axis, by the median.
  double HeldSd(std::vector<double> squares) const {
    if (squares.empty()) {
      return 0;
    }
    return kSdOfMedian[points_.channels] * std::sqrt(UpperMedian(squares));
  }

  // Where points are crowded, levels of far more patches than points are asked one after another,
  // as long as the surface comes nearer to the points held out.
  int FinestAsked() const {
    const std::size_t few = kPatchesPerPoint * (points_.size() / every_);
    const int next = space_.finest() + (HasComeNearer() ? 1 : 0);
    GridLayout layout = space_[0].layout;
    int level = 0;
    for (; level < finest_seen_; ++level) {
      layout = layout.Finer();
      if (level >= next && layout.Patches() > few) {
        break;
      }
    }
    return level;
  }

  bool HasComeNearer() const {
    constexpr double kPlainly = 0.98;
    const std::vector<NestedRound>& rounds = report_.rounds;
    return rounds.size() < 2 ||
           rounds.back().held_out_rms_mm < kPlainly * rounds[rounds.size() - 2].held_out_rms_mm;
  }

  bool Refine() {
    Indices fitted;
    std::vector<Residual> residuals;
    ForEachLooked([&](std::size_t n, std::uint32_t k) {
      if (!IsHeld(k) && outlier_[k] == 0) {
        fitted.push_back(k);
        residuals.push_back(residuals_[n]);
      }
    });
    const int vertices = space_.Vertices();
    const UnresolvedDetail detail =
        FindUnresolvedDetail(points_, space_, FinestAsked(), fitted, residuals);
    const int added = OverlayDetail(detail, space_);
    return added > (HasComeNearer() ? kFewNew : kFewMore) * vertices || Densify();
  }

  // Where most patches show detail, what is finer than the points can tell apart still helps
  // between them.
  bool Densify() {
    const bool last_helped = best_->round == std::ssize(report_.rounds) - 1;
    const int level = FinestOfMost();
    if ((densified_ && !last_helped) || level < space_.finest() - 1 ||
        level >= std::min(cap_, IsCheap() ? finest_ + 1 : finest_) || !ClosestAgree()) {
      return false;
    }
    const double least = IsCheap() ? kCheapDense : kDense;
    if (level > 0 && HasFoundNothing() &&
        OverlayDense(points_, level - 1, least, space_) > kFewNew * space_.Vertices()) {
      return true;  // gaps of that level, where nothing could be found
    }
    densified_ = true;
    return OverlayDense(points_, level, least, space_) > 0;
  }

  // Detail finer than the points are apart shows in those that chance has put close together, and
  // noise does not.
  bool ClosestAgree() const {
    const PairCorrelation pairs = ClosestCorrelation(points_, Kept(), KeptResiduals());
    return pairs.Value() * std::sqrt(static_cast<double>(pairs.Count())) > kSure;
  }

  // Of the points looked at that are no outliers, scaled.
  std::vector<Residual> KeptResiduals() const {
    std::vector<Residual> kept;
    kept.reserve(residuals_.size());
    ForEachLooked([&](std::size_t n, std::uint32_t k) {
      if (outlier_[k] == 0) {
        kept.push_back(Scaled(residuals_[n], k));
      }
    });
    return kept;
  }

  // The finest level that most of the domain has.
  int FinestOfMost() const {
    int level = space_.finest();
    for (; level > 0; --level) {
      const std::vector<char>& there = space_[level].there;
      if (2 * std::count(there.begin(), there.end(), 1) >= std::ssize(there)) {
        break;
      }
    }
    return level;
  }

  // All points, with the smoothness in finer steps. What is left of them is looked at some at a
  // time.
  NestedFitResult Finish() {
    Snapshot best = std::move(*best_);
    best_.reset();
    residuals_ = std::vector<Residual>();  // frees it, which {} would not
    every_ = 1;
    space_ = std::move(best.space);
    solve_.Enter(space_);
    solve_.SetSolution(best.solution);
    report_.chosen_round = best.round;
    report_.held_out_rms_mm = std::sqrt(best.held_square);
    weight_ = best.weight;
    metric_ = best.metric;
    DropOutliers(report_.held_out_rms_mm);
    NestedWeight chosen = FitAll(best.known);
    if (DropOutliers(std::sqrt(chosen.score))) {
      chosen = FitAll(best.known);
    }
    const double mean_weight = points_.mean_weight;
    if (SparePointsAtSteps(std::sqrt(chosen.score))) {
      chosen.mean_square *= mean_weight / points_.mean_weight;  // of a point of mean weight
      FitAll(weight_);
    }
    Report(chosen);
    NestedFitResult result{.surface = Surface(), .report = {}, .uv = {}, .residual_mm = {}};
    Measure(result);
    result.report = std::move(report_);
    result.uv = UvAsGiven(std::move(points_));
    return result;
  }

  // In the order of the curve, so that the sums do not depend on that as given.
  void Measure(NestedFitResult& result) {
    constexpr std::size_t kAtOnce = 1 << 14;
    double sum = 0, weights = 0;
    result.residual_mm.resize(points_.GivenSize());
    NestedResiduals residuals(solve_);
    PairCorrelation neighbours;
    std::optional<Residual> last;
    for (std::size_t begin = 0; begin < points_.size(); begin += kAtOnce) {
      const std::size_t end = std::min(begin + kAtOnce, points_.size());
      const std::span<const Residual> some = residuals.Of(begin, end);
      for (std::size_t k = begin; k < end; ++k) {
        const double square = some[k - begin].Square();
        result.residual_mm[points_.given[k]] = std::sqrt(square);
        sum += points_.Weight(k) * square;
        weights += points_.Weight(k);
        if (outlier_[k] == 0) {
          const Residual scaled = Scaled(some[k - begin], static_cast<std::uint32_t>(k));
          if (last) {
            neighbours.Add(*last, scaled);
          }
          last = scaled;
        }
      }
    }
    for (const RepeatedPoint& copy : points_.repeated) {
      const double distance = result.residual_mm[copy.given] = result.residual_mm[copy.first];
      sum += copy.weight * distance * distance;
      weights += copy.weight;
    }
    result.rms_mm = std::sqrt(sum / weights);
    report_.neighbour_correlation = neighbours.Value();
  }

  // ask(residuals): of all points, at the last solution.
  template <class Ask>
  auto AskOfResiduals(const Ask& ask) {
    NestedResiduals residuals(solve_);
    return ask([&](std::size_t begin, std::size_t end) { return residuals.Of(begin, end); });
  }

  // Whether others than before are outliers.
  bool DropOutliers(double noise_mm) {
    if (plan_.outliers == OutlierRule::kKeep) {
      return false;
    }
    const std::vector<char> before = outlier_;
    AskOfResiduals([&](const ResidualsBetween& residuals) { return Find(residuals, noise_mm); });
    return before != outlier_;
  }

  // Whether some are outliers no more. They take part once smoothness is chosen and noise is known:
  // before, a step would make all the rest too smooth and pass for noise.
  bool SparePointsAtSteps(double noise_mm) {
    const int spared = AskOfResiduals([&](const ResidualsBetween& residuals) {
      return SpareSheets(points_, residuals, Least(noise_mm), outlier_);
    });
    points_.TakeMeanWeight(outlier_);
    return spared > 0;
  }

  // known: the weight, or NaN where it is still to be found.
  NestedWeight FitAll(double known) {
    PointChoice kept{.left_out = outlier_};
    const std::size_t count = kept.Count(points_);
    solve_.Begin(space_, std::move(kept), metric_);
    NestedWeightSearch search(count, solve_, PartLeft(), least_gain_);
    NestedWeight chosen;
    if (std::isnan(known)) {
      search.Climb(2, weight_);
      chosen = IsQuick() ? search.Finish() : search.Settle(search.Between());
    } else {
      chosen = search.Settle(known);
    }
    weight_ = std::isnan(chosen.weight) ? weight_ : chosen.weight;
    return chosen;
  }

  void Report(const NestedWeight& chosen) {
    report_.weight = weight_;
    report_.stretch = FindStretch(metric_).stretch;
    report_.direction_deg = FindStretch(metric_).direction_deg;
    report_.weighted = points_.weighted;
    report_.met_to_rounding = report_.held_out_rms_mm <= rounding_mm_;
    report_.limited_by_density =
        !report_.met_to_rounding && finest_ < cap_ && FinestOfMost() >= finest_;
    const Indices kept = Kept();
    const double left = 1 - chosen.degrees_of_freedom / static_cast<double>(kept.size());
    report_.noise_mm = std::sqrt(chosen.mean_square / std::max(left, 0.02));
    report_.neighbour_noise_mm = NeighbourNoise(points_, kept, NeighbourModel::kQuadraticOf20);
    report_.closer_noise_mm = NeighbourNoise(points_, kept, NeighbourModel::kPlaneOf8);
    for (std::uint32_t k = 0; k < points_.size(); ++k) {
      if (outlier_[k] != 0) {
        report_.outliers.push_back(points_.given[k]);
      }
    }
    std::sort(report_.outliers.begin(), report_.outliers.end());
    ReportRepeated();
  }

  // A copy of an outlier is one too.
  void ReportRepeated() {
    std::vector<std::uint32_t> copies;
    for (const RepeatedPoint& copy : points_.repeated) {
      report_.repeated.push_back(copy.given);
      if (std::ranges::binary_search(report_.outliers, copy.first)) {
        copies.push_back(copy.given);
      }
    }
    report_.outliers.insert(report_.outliers.end(), copies.begin(), copies.end());
    std::sort(report_.outliers.begin(), report_.outliers.end());
    std::sort(report_.repeated.begin(), report_.repeated.end());
  }

  Vec3 InSpace(const GridValues& values, int i, int j) const {
    Vec3 sum = Vec3::Zero();
    for (int c = 0; c < points_.channels; ++c) {
      sum += values.Row(c, j)[i] * points_.axes.col(c);
    }
    return sum;
  }

  // Level by level: an offset is measured from the next coarser surface, in its frame or the
  // world's.
  HSplineSurface Surface() {
    const NestedValues& displacements = solve_.Displacements();
    HSplineShape shape = start_.shape();
    shape.max_level = space_.finest();
    ControlNet net = start_.Net(0);
    for (int j = 0; j < net.rows; ++j) {
      for (int i = 0; i < net.columns; ++i) {
        net.At(i, j) += InSpace(displacements[0], i, j);
      }
    }
    HSplineSurface surface(shape, net);
    ControlNet rest = start_.Net(0);
    for (int level = 1; level <= space_.finest(); ++level) {
      rest = Refine(shape, rest, level - 1);
      surface.SetOffsets(OffsetsOf(level, rest, displacements[level], surface));
    }
    return surface;
  }

  static ControlNet Refine(const HSplineShape& shape, const ControlNet& net, int level) {
    return semblance::Refine(shape, net, level);
  }

  std::map<VertexId, std::optional<Vec3>> OffsetsOf(int level, const ControlNet& rest,
                                                    const GridValues& displacements,
                                                    const HSplineSurface& surface) const {
    std::map<VertexId, std::optional<Vec3>> offsets;
    const NestedLevel& nested = space_[level];
    const bool world = surface.shape().reference == OffsetReference::kWorld;
    for (int i = 0; i < rest.columns; ++i) {
      for (int j = 0; j < rest.rows; ++j) {
        if (nested.active[nested.layout.At(i, j)] == 0 || space_.IsCovered(level, i, j)) {
          continue;
        }
        const VertexId vertex{level, i, j};
        const SurfaceFrame frame = surface.LevelFrame(level - 1, surface.ParameterOf(vertex));
        const Vec3 way = rest.At(i, j) + InSpace(displacements, i, j) - frame.point;
        offsets.emplace_hint(offsets.end(), vertex,
                             world ? way : Vec3(frame.axes.transpose() * way));
      }
    }
    return offsets;
  }

  const HSplineSurface& start_;
  const AutoPlan& plan_;
  const RunContext& context_;
  NestedPoints points_;
  NestedSolve solve_;
  double rounding_mm_;
  NestedSpace space_;
  int cap_;  // level
  std::vector<char> outlier_;
  int finest_ = 0, outliers_ = 0;
  std::size_t every_ = 0;            // point of the curve is looked at
  int finest_seen_ = 0;              // level on which those show something
  std::vector<Residual> residuals_;  // of those that are looked at
  double weight_ = kNaN, least_gain_ = 0;
  double between_ = kNaN;  // weight of the last search (NestedWeightSearch::Between)
  BendingMetric metric_ = BendingMetric::Identity();
  int finest_scanned_ = -1;  // level
  bool densified_ = false;
  std::optional<Snapshot> best_;
  AutoReport report_;
};

void CheckWeights(const ScatteredPoints& points) {
  double sum = 0;
  for (const double weight : points.weights) {
    sum += weight;
  }
  if (!std::isfinite(sum)) {
    Fail("the points' weights add up to no finite number; divide them all by the largest");
  }
}

}  // namespace

void CheckNested(const HSplineSurface& start, const ScatteredPoints& points) {
  if (!start.Offsets().empty()) {
    Fail("the start has detail of finer levels; start from one without, or take plan adaptive");
  }
  if (points.size() < kFewestPoints) {
    FailForFew(points.size(), "");
  }
  CheckWeights(points);
  const Vec2 lengths_mm = MeanLengths(start);
  if (!(lengths_mm.allFinite() && lengths_mm.minCoeff() > 0)) {
    Fail("the points have no extent along u or v; give other (u,v)");
  }
}

void TellOf(const HSplineSurface& surface, const ScatteredPoints& points,
            std::span<const double> residual_mm, int threads, AutoReport& report) {
  constexpr double kPlainly = 1.2;
  NestedPoints left = DisplacementsFrom(surface, points, threads);
  std::vector<char> outlier(left.size(), 0);
  for (std::size_t k = 0; k < left.size(); ++k) {
    outlier[k] = std::ranges::binary_search(report.outliers, left.given[k]) ? 1 : 0;
  }
  left.TakeMeanWeight(outlier);
  double before = 0, after = 0;
  PairCorrelation neighbours;
  std::optional<Residual> last;
  for (std::size_t k = 0; k < left.size(); ++k) {
    if (outlier[k] == 0) {
      const Vec3 scaled = left.Scale(k) * left.value[k];
      const Residual residual{{scaled[0], scaled[1], scaled[2]}};
      if (last) {
        neighbours.Add(*last, residual);
      }
      last = residual;
      before += left.Weight(k) * residual_mm[left.given[k]] * residual_mm[left.given[k]];
      after += left.Weight(k) * left.value[k].squaredNorm();
    }
  }
  report.neighbour_correlation = neighbours.Value();
  if (before > 0) {  // as many parameters as before, or as good as
    report.noise_mm *= std::sqrt(after / before);
  }
  if (after > kPlainly * kPlainly * before) {
    report.held_out_rms_mm = kNaN;
    report.limited_by_density = false;
    report.met_to_rounding =
        report.met_to_rounding && report.noise_mm <= kRounding * MeanLengths(surface).norm();
  }
}

NestedFitResult FitNested(const HSplineSurface& start, NestedPoints points, const AutoPlan& plan,
                          const RunContext& context) {
  if (points.size() < kFewestPoints) {
    FailForFew(points.size(), points.repeated.empty() ? "" : " that differ");
  }
  return NestedFitter(start, std::move(points), plan, context).Run();
}

NestedFitResult FitNested(const HSplineSurface& start, const ScatteredPoints& points,
                          const AutoPlan& plan, const RunContext& context) {
  CheckNested(start, points);
  return FitNested(start, DisplacementsFrom(start, points, context.threads), plan, context);
}

}  // namespace semblance
