// SPDX-License-Identifier: GPL-3.0-or-later
// States of a nested fit (class NestedFitter).
//
//   start
//     |  ChooseSample, FindGrossOutliers
//     v
//   SAMPLED <---------------------- ChooseSample <-----------------+
//     |  FitRound: weight and metric by cross-validation            |
//     v                                                             |
//   FITTED                                                          |
//     |  Judge: held-out error, outliers, best round                |
//     v                                                             |
//   JUDGED ---- Refine: finer vertices were added ------------------+
//     |  none were added, or IsMet, or kMaxRounds
//     v
//   RESTORED: the best round's space, solution, weight and metric; every point
//     |  DropOutliers, FitAll, DropOutliers (if they changed: FitAll)
//     |  ReinstateSteps (if any: FitAll with the same weight)
//     v
//   DONE: report, surface, distances
//
//   transition    requires                            guarantees
//   FitRound      SAMPLED, a linked space_            solve_ holds the best solution of the round
//   Judge         FITTED                              residuals_, held-out error and outlier_ are
//                                                     those of this solution; best_ is up to date
//   Refine        JUDGED                              space_ is linked; true: it has new vertices
//   FitAll        RESTORED, outlier_ up to date       solve_ holds the solution for all inliers
//
// Invariants, which functions refer to by number.
//   1. solve_ refers to points_ and space_. After a change of space_ it must Begin or Enter again.
//   2. In JUDGED residuals_[n] is the residual of point n * every_ of the curve.
//   3. points_.mean_weight is the mean weight of the points with outlier_ 0.
//   4. A point is held out by its cell, a run of close points along the curve (ChooseHeldOut), so
//   that
//      near copies are held out together. A round never fits held-out points or outliers; FitAll
//      fits all inliers.
//   5. best_ is the last round whose held-out mean square is more than 0.1 % below that of the
//      best round before it. So of equally good rounds the coarsest is chosen.
//   6. weight_, metric_ and least_gain_ are the results of the last search, and the start of the
//      next one.
//   7. every_ does not grow from round to round, because the number of vertices does not fall.
//   8. All sums are in the order of the curve, so the given order of the points has no effect, but
//      that of near copies the one given first is the original.
#include "fitting/nested/nested_fit.h"
#include "fitting/nested/nested_points.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>
#include <utility>

#include "fitting/nested/error_structure.h"
#include "fitting/nested/neighbour_noise.h"
#include "fitting/nested/nested_surface.h"
#include "fitting/nested/outlier_search.h"
#include "fitting/nested/run_offsets.h"
#include "fitting/nested/shared_errors.h"
#include "fitting/nested/unresolved_detail.h"
#include "fitting/nested/weight_search.h"
#include "surfaces/base/error.h"
#include "surfaces/base/quantile.h"
#include "surfaces/hspline_query/hspline_batch.h"

namespace semblance::fitting {
namespace {

using Residual = NestedResidual;
using Indices = std::vector<std::uint32_t>;

// The constants were chosen on the point sets of docs/explanation/fit.md, "How good it is"
// (`fit_bench untuned`), unless a line states another reason.

constexpr int kMaxRounds = 24;  // bounds the loop, which normally ends by Refine
// The smallest sample, and its points per vertex. Smaller samples save time in the first rounds;
// larger ones find detail earlier.
constexpr std::size_t kMinSample = 100000, kPointsPerVertex = 24;
// Improvement of the held-out mean square that a finer round needs; closer rounds count as equal.
constexpr double kBetterRatio = 1.001;
// Smallest share of new vertices that is worth a round, and the same after a round that gained
// nothing. Smaller shares cost rounds, larger ones lose detail.
constexpr double kMinNewShare = 0.007, kMinNewShareAfterNoGain = 0.02;
// Rounds without a better one that end the refinement, and the ratio of held-out errors at which
// one is enough. On 60 sets of smooth and rough surfaces with independent and correlated errors no
// later round was better; on soundings along tracks they took more than half of the time.
constexpr int kMaxRoundsNoBetter = 2;
constexpr double kClearlyWorse = 1.01;
// Points per patch of the next level for overlaying all dense patches; with fewer, vertices have
// too few points. Cheap fits may go further, since cross-validation smooths what is too fine.
constexpr double kDense = 1.25, kCheapDense = 0.3;
constexpr std::size_t kCheapPoints = 50000;  // below, a fit takes well under a second
constexpr int kQuickVertices = 10000;        // below, exact solves take little time
constexpr double kMinStandardErrors = 1;     // of a correlation that shows detail; more stop early
constexpr std::size_t kPatchesPerPoint = 4;  // of a tested level; more take time and memory
// Ratio of neighbouring weights in the search, in rounds and in the final fit: solves against a
// closer weight. The score is flat near its minimum.
constexpr double kCoarseFactor = 4, kFineFactor = 2;
// Held-out error, relative to the extent, that is round-off: mean squares are differences of sums.
constexpr double kRoundingOfPoints = 1e-8;

[[noreturn]] void RefuseFit(const std::string& what) {
  throw InputError("fit: plan auto: " + what);
}

constexpr std::size_t kMinPoints = 16;  // so that a tenth of them is at least one point
[[noreturn]] void FailForFew(std::size_t count, const char* of_kind) {
  RefuseFit(
      fmt::format("{} points{} are too few to hold some out; give at least {}, or choose another "
                  "plan",
                  count, of_kind, kMinPoints));
}

// Flags the points that are held out: one cell in ten, pseudo-randomly by its place along the
// curve. A cell is a run of points that are closer together than a tenth of their usual distance.
// Most cells hold one point.
std::vector<char> ChooseHeldOut(const NestedPoints& points) {
  constexpr double kClose = 0.04;  // of a step on the curve; steps are 2.5 spacings at the most
  const CurveSteps steps(points);
  std::vector<char> held(points.size());
  for (std::size_t k = 0; k < points.size(); ++k) {
    const bool is_next = k > 0 && PlaceDistance(points, k - 1, k) < kClose * steps.At(k);
    const std::uint64_t bits = (k + 1) * 0xD1B54A32D192ED03u;
    held[k] = is_next ? held[k - 1] : (bits ^ bits >> 31) % 10 == 0 ? 1 : 0;
  }
  return held;
}

// The finest level on which patches with points have more than kPointsPerPatch of them on average.
int FinestByDensity(const NestedPoints& points, std::size_t every, const GridLayout& level0,
                    int finest) {
  constexpr double kPointsPerPatch = 1.3;       // fewer determine nothing
  constexpr std::size_t kFewPatches = 1 << 20;  // affordable for any number of points
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

// The mean of independent differences.
class MeanGain {
 public:
  void Add(double difference) {
    sum_ += difference;
    squares_ += difference * difference;
    count_ += 1;
  }
  // Returns whether the mean is above 0 by more than its standard error.
  bool IsSure() const {
    return sum_ > std::sqrt(std::max(squares_ - sum_ * sum_ / std::max(count_, 1.0), 0.0));
  }

 private:
  double sum_ = 0, squares_ = 0, count_ = 0;
};

// The state of a round that predicts the held-out points best.
struct Snapshot {
  NestedSpace space;
  NestedSolve::Packed solution;
  double weight = kNaN;
  double known = kNaN;  // weight for the final fit; NaN: search again, as it is quick or sampled
  BendingMetric metric;
  double held_square = kNaN;
  std::vector<float> squares;  // of held-out inliers among the sampled points; NaN for the others
  std::vector<float> held_mm;  // errors of all held-out sampled points; NaN for the others
  int round = -1;
};

class NestedFitter {
 public:
  // offsets: those that were subtracted from the points.
  NestedFitter(const HSplineSurface& start, NestedPoints points, std::optional<RunOffsets> offsets,
               const AutoPlan& plan, const RunContext& context)
      : start_(start),
        plan_(plan),
        context_(context),
        points_(std::move(points)),
        offsets_(std::move(offsets)),
        solve_(points_, MeanLengths(start)),
        rounding_mm_(kRoundingOfPoints * MeanLengths(start).norm()),
        space_(start.shape()),
        cap_(FinestAllowed(plan, start.shape())),
        held_(ChooseHeldOut(points_)),
        outlier_(points_.size(), 0),
        least_noise_square_(RoundingNoiseSquare(points_)) {
    finest_ = FinestByDensity(points_, 1, space_[0].layout, cap_);
  }

  NestedFitResult Run() {
    ChooseSample();
    FindGrossOutliers();
    for (int round = 0; round < kMaxRounds; ++round) {
      context_.ThrowIfStopped();
      context_.Report("fit",
                      fmt::format("{} vertices to level {}", space_.Vertices(), space_.finest()));
      FitRound();
      if (IsMet() || IsRoundedBelow() || IsPastBest() || !Refine()) {
        break;
      }
    }
    FitNarrowFeature();
    return Finish();
  }

 private:
  // Chooses every_, so that the sample has as many points as the vertices need.
  void ChooseSample() {
    const std::size_t enough =
        std::max(kMinSample, kPointsPerVertex * static_cast<std::size_t>(space_.Vertices()));
    const std::size_t every = std::max<std::size_t>(points_.size() / enough, 1);
    if (every == every_) {
      return;
    }
    every_ = every;
    sample_finest_ = FinestByDensity(points_, every_, space_[0].layout, finest_);
  }

  bool IsCheap() const { return points_.size() < kCheapPoints; }
  bool IsQuick() const { return space_.Vertices() < kQuickVertices; }
  // The part of the noise's effect at which a solve ends (NestedWeightSearch). Slow solves end
  // earlier, as soon as the comparison of weights allows.
  double PartLeft() const { return IsQuick() ? 0.01 : 0.1; }

  // Calls visit(n, k) for the n-th sampled point, point k of the curve.
  template <class Visit>
  void ForEachSampled(const Visit& visit) const {
    for (std::size_t k = 0, n = 0; k < points_.size(); k += every_, ++n) {
      visit(n, static_cast<std::uint32_t>(k));
    }
  }

  // The sampled inliers.
  Indices SampledInliers() const {
    Indices indices;
    indices.reserve(points_.size() / every_ + 1);
    ForEachSampled([&](std::size_t, std::uint32_t k) {
      if (outlier_[k] == 0) {
        indices.push_back(k);
      }
    });
    return indices;
  }

  // The points of a round: the sample without outliers and held-out points (invariant 4).
  PointChoice RoundPoints() const {
    PointChoice choice{.every = every_, .left_out = outlier_};
    ForEachSampled([&](std::size_t, std::uint32_t k) { choice.left_out[k] |= held_[k]; });
    return choice;
  }

  ResidualsBetween SampledResiduals() const {
    return [this](std::size_t begin, std::size_t end) {
      return std::span(residuals_).subspan(begin, end - begin);
    };
  }

  // Finds gross outliers from the displacements alone, because they would bend the first surface.
  void FindGrossOutliers() {
    if (plan_.outliers == OutlierRule::kKeep) {
      return;
    }
    residuals_.clear();
    ForEachSampled([&](std::size_t, std::uint32_t k) {
      const Vec3& value = points_.value[k];
      residuals_.push_back({{value[0], value[1], value[2]}});
    });
    UpdateOutliers(SampledResiduals(), /*noise_mm=*/0);
  }

  LeastSpread MinSpread(double noise_mm) const {
    constexpr double kAtBorders = 10;  // smoothness exceeds round-off most at borders
    return {.noise_mm = noise_mm, .rounding_mm = kAtBorders * rounding_mm_};
  }

  // Updates outlier_ of the sampled points, and the mean weight (invariant 3). Returns the number
  // of sampled outliers.
  int UpdateOutliers(const ResidualsBetween& residuals, double noise_mm) {
    // Gross errors bend the first surface, so some of them are not far from it.
    const OutlierTail tail = report_.rounds.empty() ? OutlierTail::kReject : OutlierTail::kKeep;
    int count = FindOutliers(points_, every_, residuals, MinSpread(noise_mm), tail, outlier_);
    for (const std::uint32_t k : feature_) {
      count -= outlier_[k];
      outlier_[k] = 0;
    }
    points_.UpdateMeanWeight(outlier_);
    return count;
  }

  void FitRound() {
    const bool scan = NeedsStretchScan();  // uses residuals_, so before every_ changes
    ChooseSample();
    PointChoice fitted = RoundPoints();
    const std::size_t count = fitted.Count(points_);
    solve_.Begin(space_, std::move(fitted), metric_);
    NestedWeightSearch search(count, solve_, PartLeft(), least_gain_);
    if (std::isnan(weight_)) {
      search.Scan();
      search.Climb(kCoarseFactor, search.Finish().weight);
    } else {
      search.ClimbFromRough(kCoarseFactor, weight_);
    }
    SearchMetric(search, scan);
    const double between = search.Between();
    const NestedWeight chosen = SmoothWithinRounding(search, count);
    between_ = is_rounded_below_ ? chosen.weight : between;
    least_gain_ = search.least_gain();
    if (std::isnan(chosen.weight)) {
      RefuseFit("no smoothness has a usable solve; give more points than a plane needs");
    }
    weight_ = chosen.weight;
    metric_ = solve_.metric();
    Judge(chosen, search.steps());
  }

  // Returns whether to try stretched metrics although the surface shows no direction yet: its
  // vertices are as dense as the points and have found nothing. Once per level.
  bool NeedsStretchScan() const {
    return plan_.stretched && space_.finest() >= finest_ && space_.finest() > finest_scanned_ &&
           HasFoundNothing();
  }

  void SearchMetric(NestedWeightSearch& search, bool scan) {
    if (!plan_.stretched) {
      return;
    }
    if (scan) {
      search.ScanStretches(kCoarseFactor);
      finest_scanned_ = space_.finest();
    }
    search.Stretch(kCoarseFactor);
  }

  // Returns whether the refinement has not brought the surface nearer to the held-out points,
  // although the closest points agree.
  bool HasFoundNothing() const {
    constexpr double kNoGainRatio = 0.7;  // remaining share of the first round's held-out error
    const std::vector<NestedRound>& rounds = report_.rounds;
    return !rounds.empty() &&
           rounds.back().held_out_rms_mm > kNoGainRatio * rounds.front().held_out_rms_mm &&
           ClosestAgree();
  }

  // Sets residuals_, finds outliers, and compares the round with the best one by the held-out
  // points.
  void Judge(const NestedWeight& chosen, int steps) {
    residuals_ = solve_.Residuals({.every = every_});
    std::vector<double> squares;
    std::vector<float> of_sampled(residuals_.size(), std::nanf(""));
    double weights = 0;
    ForEachSampled([&](std::size_t n, std::uint32_t k) {
      if (held_[k] != 0 && outlier_[k] == 0) {
        squares.push_back(ScaledResidual(points_, k, residuals_[n]).Square());
        of_sampled[n] = static_cast<float>(squares.back());
        weights += points_.Scale(k) * points_.Scale(k);
      }
    });
    const double held = squares.empty() ? kNaN
                                        : std::accumulate(squares.begin(), squares.end(), 0.0) /
                                              weights / points_.channels;
    if (plan_.outliers == OutlierRule::kDrop) {
      outliers_ = UpdateOutliers(SampledResiduals(), HeldOutSd(std::move(squares)));
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
    if (!best_ || held * kBetterRatio < best_->held_square || IsSurelyBetter(of_sampled)) {
      MakeBest(held, std::move(of_sampled));
    }
  }

  // Makes the round the best one. squares: Snapshot::squares.
  void MakeBest(double held_square, std::vector<float> squares) {
    best_ = Snapshot{.space = space_,
                     .solution = solve_.Solution(),
                     .weight = weight_,
                     .known = IsQuick() || every_ > 1 ? kNaN : between_,
                     .metric = metric_,
                     .held_square = held_square,
                     .squares = std::move(squares),
                     .held_mm = HeldOutErrors(),
                     .round = static_cast<int>(report_.rounds.size()) - 1};
  }

  // Snapshot::held_mm of the round.
  std::vector<float> HeldOutErrors() const {
    std::vector<float> errors_mm(residuals_.size(), std::nanf(""));
    ForEachSampled([&](std::size_t n, std::uint32_t k) {
      if (held_[k] != 0) {
        errors_mm[n] =
            static_cast<float>(std::sqrt(ScaledResidual(points_, k, residuals_[n]).Square()));
      }
    });
    return errors_mm;
  }

  // Takes outliers that stand together for a feature that is as narrow as the points' spacing, if a
  // surface with vertices as dense as the points explains it. Refinement where residuals show
  // detail cannot find it, since its points look like errors. Only for so few points that every one
  // of them is in the sample.
  void FitNarrowFeature() {
    if (plan_.outliers != OutlierRule::kDrop || !IsCheap() || !StandTogether(outlier_)) {
      return;
    }
    const std::vector<char> before = outlier_;
    feature_ = FindOutliersTogether(outlier_);
    for (const std::uint32_t k : feature_) {
      outlier_[k] = 0;
    }
    points_.UpdateMeanWeight(outlier_);
    for (int level = 0; level < finest_ && level <= space_.finest(); ++level) {
      OverlayDense(points_, level, kCheapDense, space_);
    }
    finest_scanned_ = -1;  // most such features are longer than wide, so stretched metrics help
    FitRound();
    if (ExplainsFeature()) {
      MakeBest(best_->held_square, {});
    } else {
      feature_.clear();
      outlier_ = before;
      points_.UpdateMeanWeight(outlier_);
    }
  }

  // Returns whether the round has explained the feature: the mean square error of held-out points
  // in and around it has clearly fallen, to about half of the best round's. On other seeds of
  // ridges and peaks the remaining share was at most 0.49. Clumps of gross errors keep 0.63,
  // because only their mean can be predicted.
  bool ExplainsFeature() const {
    constexpr double kShareLeft = 0.55;
    const std::vector<float> errors_mm = HeldOutErrors();
    MeanGain gain;
    double before = 0, after = 0;
    for (const std::uint32_t k : PointsAround(feature_)) {
      if (held_[k] != 0) {
        const double square = std::pow(errors_mm[k], 2), last = std::pow(best_->held_mm[k], 2);
        gain.Add(last - square);
        before += last;
        after += square;
      }
    }
    return gain.IsSure() && after < kShareLeft * before;
  }

  // These points and the eight on each side of them on the curve, ascending.
  Indices PointsAround(const Indices& points) const {
    constexpr std::uint32_t kBeside = 8;
    Indices around;
    for (const std::uint32_t k : points) {
      const auto end = std::min(k + kBeside + 1, static_cast<std::uint32_t>(points_.size()));
      std::uint32_t n = k - std::min(k, kBeside);
      for (n = around.empty() ? n : std::max(n, around.back() + 1); n < end; ++n) {
        around.push_back(n);
      }
    }
    return around;
  }

  // Returns whether the held-out points are met better than by the best round, beyond the standard
  // error of the mean difference. With many points that is less than kBetterRatio: surfaces that
  // differ by a hundredth of the noise can be told apart.
  bool IsSurelyBetter(const std::vector<float>& squares) const {
    if (squares.size() != best_->squares.size()) {
      return false;  // another sample
    }
    MeanGain gain;
    for (std::size_t n = 0; n < squares.size(); ++n) {
      if (const double difference = double{best_->squares[n]} - squares[n];
          std::isfinite(difference)) {
        gain.Add(difference);
      }
    }
    return gain.IsSure();
  }

  // Takes the largest weight at which the points still lie within half a step of the lattice, as
  // far as any does, if the search has chosen less noise than rounding makes. Errors of rounding
  // follow the surface, so their size alone does not show how smooth it is: it is less than step /
  // sqrt(12) where the surface stays within a step.
  NestedWeight SmoothWithinRounding(NestedWeightSearch& search, std::size_t count) {
    const NestedWeight found = search.Finish();
    is_rounded_below_ = found.NoiseSquare(static_cast<double>(count)) < least_noise_square_;
    return is_rounded_below_ ? search.SmoothWhileFits([this] {
      return MeanSquareBeyondRounding(solve_, points_, outlier_);
    })
                             : found;
  }

  // Returns whether cross-validation would follow the rounding; finer vertices would only do so
  // more.
  bool IsRoundedBelow() const { return is_rounded_below_; }

  // Returns whether the held-out points are met to round-off: points without noise on a surface of
  // the space.
  bool IsMet() const { return report_.rounds.back().held_out_rms_mm <= rounding_mm_; }

  // The standard deviation of held-out points along one axis, by the median.
  double HeldOutSd(std::vector<double> squares) const {
    if (squares.empty()) {
      return 0;
    }
    return kSdOfMedian[points_.channels] * std::sqrt(UpperMedian(squares));
  }

  // The finest level to test for detail. Levels of far more patches than points, as in crowded
  // data, are tested one after another, as long as the surface comes nearer to the held-out points.
  int FinestTested() const {
    const std::size_t few = kPatchesPerPoint * (points_.size() / every_);
    const int next = space_.finest() + (HasComeNearer() ? 1 : 0);
    GridLayout layout = space_[0].layout;
    int level = 0;
    for (; level < sample_finest_; ++level) {
      layout = layout.Finer();
      if (level >= next && layout.Patches() > few) {
        break;
      }
    }
    return level;
  }

  // Returns whether refinement has met the held-out points better before and is not likely to do so
  // again. Finer rounds are the dearest ones.
  bool IsPastBest() const {
    const std::vector<NestedRound>& rounds = report_.rounds;
    const int since_best = static_cast<int>(rounds.size()) - 1 - best_->round;
    const bool is_worse =
        rounds.back().held_out_rms_mm > kClearlyWorse * rounds[best_->round].held_out_rms_mm;
    return (since_best >= kMaxRoundsNoBetter || (since_best > 0 && is_worse)) && !HasFoundNothing();
  }

  bool HasComeNearer() const {
    constexpr double kClearly = 0.98;  // ratio of held-out errors beyond chance
    const std::vector<NestedRound>& rounds = report_.rounds;
    return rounds.size() < 2 ||
           rounds.back().held_out_rms_mm < kClearly * rounds[rounds.size() - 2].held_out_rms_mm;
  }

  // Adds vertices where residuals show detail, or where points are dense. Returns whether the new
  // ones are worth a round.
  bool Refine() {
    Indices fitted;
    std::vector<Residual> residuals;
    ForEachSampled([&](std::size_t n, std::uint32_t k) {
      if (held_[k] == 0 && outlier_[k] == 0) {
        fitted.push_back(k);
        residuals.push_back(residuals_[n]);
      }
    });
    const int vertices = space_.Vertices();
    const UnresolvedDetail detail =
        FindUnresolvedDetail(points_, space_, FinestTested(), fitted, residuals);
    const int added = OverlayDetail(detail, space_);
    return added > (HasComeNearer() ? kMinNewShare : kMinNewShareAfterNoGain) * vertices ||
           Densify();
  }

  // Overlays all dense patches of the finest level that most of the domain has. If most patches
  // show detail, vertices finer than the points can resolve still improve the surface between the
  // points.
  bool Densify() {
    const bool last_helped = best_->round == std::ssize(report_.rounds) - 1;
    const int level = FinestOfMost();
    if ((densified_ && !last_helped) || level < space_.finest() - 1 ||
        level >= std::min(cap_, IsCheap() ? finest_ + 1 : finest_) || !ClosestAgree()) {
      return false;
    }
    const double points_per_patch = IsCheap() ? kCheapDense : kDense;
    if (level > 0 && HasFoundNothing() &&
        OverlayDense(points_, level - 1, points_per_patch, space_) >
            kMinNewShare * space_.Vertices()) {
      return true;  // gaps of the coarser level, where no detail could be found
    }
    densified_ = true;
    return OverlayDense(points_, level, points_per_patch, space_) > 0;
  }

  // Returns whether residuals of points that are close together by chance agree. Detail finer than
  // the points' spacing shows there, and noise does not.
  bool ClosestAgree() const {
    const PairCorrelation pairs = ClosestCorrelation(points_, SampledInliers(), InlierResiduals());
    return pairs.Value() * std::sqrt(static_cast<double>(pairs.Count())) > kMinStandardErrors;
  }

  // The residuals of SampledInliers, scaled to mean weight.
  std::vector<Residual> InlierResiduals() const {
    std::vector<Residual> kept;
    kept.reserve(residuals_.size());
    ForEachSampled([&](std::size_t n, std::uint32_t k) {
      if (outlier_[k] == 0) {
        kept.push_back(ScaledResidual(points_, k, residuals_[n]));
      }
    });
    return kept;
  }

  // The finest level that covers at least half of the domain.
  int FinestOfMost() const {
    int level = space_.finest();
    for (; level > 0; --level) {
      const std::vector<char>& there = space_[level].present;
      if (2 * std::count(there.begin(), there.end(), 1) >= std::ssize(there)) {
        break;
      }
    }
    return level;
  }

  // Fits all points with the best round's space and a finer choice of the weight. Residuals are
  // computed for some points at a time.
  NestedFitResult Finish() {
    Snapshot best = std::move(*best_);
    best_.reset();
    residuals_ = std::vector<Residual>();  // frees the memory; {} would not
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
    if (shared_ && CoarsenFor(chosen.degrees_of_freedom)) {
      chosen = FitAll(best.known);
    }
    if (DropOutliers(std::sqrt(chosen.score))) {
      chosen = FitAll(best.known);
    }
    const double mean_weight = points_.mean_weight;
    if (ReinstateSteps(std::sqrt(chosen.score))) {
      chosen.mean_square *= mean_weight / points_.mean_weight;  // now of the new mean weight
      FitAll(weight_);
    }
    Report(chosen);
    NestedFitResult result{.surface = MakeSurface(start_, space_, points_, solve_.Displacements()),
                           .report = {},
                           .uv = {},
                           .residual_mm = {}};
    Measure(result);
    result.report = std::move(report_);
    result.uv = UvAsGiven(std::move(points_));
    return result;
  }

  // Computes the distances and their statistics, in the order of the curve (invariant 8).
  void Measure(NestedFitResult& result) {
    double sum = 0, weights = 0;
    result.residual_mm.resize(points_.GivenSize());
    PairCorrelation neighbours;
    const FileRuns runs = FindFileRuns(points_);
    DesignEffect effect(runs);
    std::optional<Residual> last;
    NestedResiduals(solve_).ForEach([&](std::size_t k, const Residual& residual) {
      const double square = AsGiven(k, residual).Square();
      result.residual_mm[points_.given[k]] = std::sqrt(square);
      sum += points_.Weight(k) * square;
      weights += points_.Weight(k);
      if (outlier_[k] == 0) {
        const Residual scaled = ScaledResidual(points_, k, residual);
        if (last) {
          neighbours.Add(*last, scaled);
        }
        last = scaled;
        effect.Add(k, scaled);
      }
    });
    report_.effective_share = EffectiveShare(effect);
    if (offsets_) {
      AddOffsetsToReport();
    }
    MeasureCopies(result);
    for (const RepeatedPoint& copy : points_.repeated) {
      sum += copy.weight * result.residual_mm[copy.given] * result.residual_mm[copy.given];
      weights += copy.weight;
    }
    result.rms_mm = std::sqrt(sum / weights);
    report_.neighbour_correlation = neighbours.Value();
  }

  // The residual of a given point, of which its run's offset is a part.
  Residual AsGiven(std::size_t k, Residual residual) const {
    if (offsets_) {
      residual.along[0] += offsets_->At(k);
    }
    return residual;
  }

  double EffectiveShare(const DesignEffect& effect) const {
    if (report_.met_to_rounding) {
      return 1;
    }
    return shared_ ? std::min(1.0, std::pow(report_.noise_mm, 2) / shared_->square_per_parameter)
                   : 1 / effect.Value();
  }

  // Offsets are a part of a point's noise. Points count as so many independent ones that the
  // surface's variance becomes that by the noise beside the offsets and what it follows of them.
  void AddOffsetsToReport() {
    const double beside = std::pow(report_.noise_mm, 2),
                 all = beside + std::pow(offsets_->sd_mm, 2),
                 parameters_per_point =
                     report_.degrees_of_freedom / static_cast<double>(points_.size()),
                 variance = beside * parameters_per_point / report_.effective_share +
                            offsets_->left_square;
    report_.noise_mm = std::sqrt(all);
    report_.effective_share = std::min(1.0, all * parameters_per_point / variance);
    report_.run_offset_mm = offsets_->sd_mm;
    report_.runs = static_cast<int>(offsets_->runs.count);
  }

  // Computes the distances of copies; those of exact copies are their original's.
  void MeasureCopies(NestedFitResult& result) const {
    std::vector<Vec2> uv;
    for (const RepeatedPoint& copy : points_.repeated) {
      uv.push_back(copy.uv);
    }
    const std::vector<Vec3> from = HSplineBatch(start_).Points(uv, context_.threads),
                            to = HSplineBatch(result.surface).Points(uv, context_.threads);
    for (std::size_t n = 0; n < uv.size(); ++n) {
      const RepeatedPoint& copy = points_.repeated[n];
      const Vec3 displacement = points_.axes * copy.value.head(points_.channels);
      result.residual_mm[copy.given] =
          copy.is_exact ? result.residual_mm[copy.first] : (from[n] + displacement - to[n]).norm();
    }
  }

  // Calls use(residuals) with the residuals of all points at the last solution.
  template <class Use>
  auto WithAllResiduals(const Use& use) {
    NestedResiduals residuals(solve_);
    return use([&](std::size_t begin, std::size_t end) { return residuals.Of(begin, end); });
  }

  // Updates the outliers among all points. Returns whether they changed.
  bool DropOutliers(double noise_mm) {
    if (plan_.outliers == OutlierRule::kKeep) {
      return false;
    }
    const std::vector<char> before = outlier_;
    WithAllResiduals(
        [&](const ResidualsBetween& residuals) { return UpdateOutliers(residuals, noise_mm); });
    return before != outlier_;
  }

  // Reinstates outliers at steps. Returns whether there are any. It comes last, when smoothness and
  // noise are known: before, a step would pass for noise and make all the rest too smooth.
  bool ReinstateSteps(double noise_mm) {
    const int reinstated = WithAllResiduals([&](const ResidualsBetween& residuals) {
      return ReinstateStepPoints(points_, residuals, MinSpread(noise_mm), outlier_);
    });
    points_.UpdateMeanWeight(outlier_);
    return reinstated > 0;
  }

  // Fits all inliers. known: the weight, or NaN to search for it.
  NestedWeight FitAll(double known) {
    PointChoice kept{.left_out = outlier_};
    const std::size_t count = kept.Count(points_);
    solve_.Begin(space_, std::move(kept), metric_);
    NestedWeightSearch search(count, solve_, PartLeft(), least_gain_);
    if (shared_) {
      known = shared_->weight;
    }
    NestedWeight chosen;
    if (std::isnan(known)) {
      search.Climb(kFineFactor, weight_);
      chosen = IsQuick() ? search.Finish() : search.FinalSolve(search.Between());
    } else {
      chosen = search.FinalSolve(known);
    }
    chosen = shared_ ? chosen : SmoothOverSharedErrors(search, count);
    weight_ = std::isnan(chosen.weight) ? weight_ : chosen.weight;
    return chosen;
  }

  // Takes a larger weight than that of cross-validation where points share errors: those of
  // rounding, or those of neighbours.
  NestedWeight SmoothOverSharedErrors(NestedWeightSearch& search, std::size_t count) {
    const NestedWeight found = SmoothWithinRounding(search, count);
    const bool is_first = !std::exchange(has_sought_shared_, true);
    if (!is_first || is_rounded_below_ || std::isnan(found.weight) || !MayFollowErrors()) {
      return found;
    }
    const NestedSolve::Packed solution = solve_.Solution();
    shared_ = search.FindSharedErrors(found.weight, MostSharedSquare(points_, outlier_));
    if (shared_) {
      const NestedWeight smoother = search.FinalSolve(shared_->weight);
      if (AreAlikeEverywhere(solve_, points_, outlier_)) {
        return smoother;
      }
      shared_.reset();
    }
    solve_.SetWeight(found.weight);
    solve_.SetSolution(solution);
    return found;
  }

  // Replaces the space by whole levels with enough vertices for a smooth surface of so many
  // parameters, if these are fewer than the space has. Vertices for the errors of neighbours would
  // only cost time in predictions. Returns whether they are.
  bool CoarsenFor(double parameters) {
    constexpr double kVerticesPerParameter = 8;  // more slow predictions down
    NestedSpace coarse(start_.shape());
    while (coarse.Vertices() < kVerticesPerParameter * parameters && coarse.finest() < cap_) {
      OverlayDense(points_, coarse.finest(), /*points_per_patch=*/0, coarse);
    }
    if (coarse.Vertices() >= space_.Vertices()) {
      return false;
    }
    space_ = std::move(coarse);
    solve_.Forget();
    return true;
  }

  // A surface with far fewer vertices than points does not follow the errors of neighbours, and
  // round-off is no error.
  bool MayFollowErrors() const {
    constexpr std::size_t kMostPointsPerVertex = 8;
    return report_.held_out_rms_mm > rounding_mm_ &&
           points_.size() < kMostPointsPerVertex * static_cast<std::size_t>(space_.Vertices());
  }

  // Fills the report, except for the statistics of distances (Measure).
  void Report(const NestedWeight& chosen) {
    report_.weight = weight_;
    report_.degrees_of_freedom = chosen.degrees_of_freedom;
    report_.stretch = FindStretch(metric_).stretch;
    report_.direction_deg = FindStretch(metric_).direction_deg;
    report_.weighted = points_.weighted;
    report_.met_to_rounding = report_.held_out_rms_mm <= rounding_mm_;
    report_.limited_by_density =
        !report_.met_to_rounding && !shared_ && finest_ < cap_ && FinestOfMost() >= finest_;
    const Indices kept = SampledInliers();
    report_.noise_mm = std::sqrt(chosen.NoiseSquare(static_cast<double>(kept.size())));
    report_.lattice_mm = least_noise_square_ > 0 ? points_.lattice_mm : 0;
    report_.outliers_together = StandTogether(outlier_);
    report_.neighbour_noise_mm = NeighbourNoise(points_, kept, NeighbourModel::kQuadraticOf20);
    report_.closer_noise_mm = NeighbourNoise(points_, kept, NeighbourModel::kPlaneOf8);
    if (points_.weighted) {
      report_.by_weight = CompareNoiseByWeight(points_, kept);
    }
    for (std::uint32_t k = 0; k < points_.size(); ++k) {
      if (outlier_[k] != 0) {
        report_.outliers.push_back(points_.given[k]);
      }
    }
    std::sort(report_.outliers.begin(), report_.outliers.end());
    ReportRepeated();
  }

  // Reports copies. A copy of an outlier is an outlier too.
  void ReportRepeated() {
    std::vector<std::uint32_t> copies;
    report_.measured_twice = points_.measured_twice;
    for (const RepeatedPoint& copy : points_.repeated) {
      report_.repeated.push_back(copy.given);
      report_.near_copies += copy.is_exact ? 0 : 1;
      if (std::ranges::binary_search(report_.outliers, copy.first)) {
        copies.push_back(copy.given);
      }
    }
    report_.outliers.insert(report_.outliers.end(), copies.begin(), copies.end());
    std::sort(report_.outliers.begin(), report_.outliers.end());
    std::sort(report_.repeated.begin(), report_.repeated.end());
  }

  // Fixed during the fit.
  const HSplineSurface& start_;
  const AutoPlan& plan_;
  const RunContext& context_;
  NestedPoints points_;                // only mean_weight changes (invariant 3)
  std::optional<RunOffsets> offsets_;  // of the given points, which were subtracted from points_
  NestedSolve solve_;
  double rounding_mm_;  // held-out error that is round-off
  NestedSpace space_;
  int cap_;                    // finest level that the plan and the shape allow
  std::vector<char> held_;     // per point: it is held out (invariant 4)
  std::vector<char> outlier_;  // per point
  Indices feature_;            // points that are never outliers (FitNarrowFeature)
  int finest_ = 0;             // finest level that the density of all points allows
  // The sample and its residuals (invariant 2).
  std::size_t every_ = 0;            // one point in every_ is sampled
  int sample_finest_ = 0;            // finest level that the density of the sample allows
  std::vector<Residual> residuals_;  // of the sampled points
  int outliers_ = 0;                 // number among the sampled points
  // The last search (invariant 6).
  double weight_ = kNaN, least_gain_ = 0;
  double between_ = kNaN;  // NestedWeightSearch::Between
  BendingMetric metric_ = BendingMetric::Identity();
  int finest_scanned_ = -1;  // finest level at which stretched metrics were tried
  // Errors that points share.
  double least_noise_square_;           // RoundingNoiseSquare
  std::optional<SharedErrors> shared_;  // of the final fit
  bool has_sought_shared_ = false;      // once, because the search is slow
  bool is_rounded_below_ = false;       // of the last search
  // The progress.
  bool densified_ = false;        // Densify has overlaid a whole level
  std::optional<Snapshot> best_;  // invariant 5
  AutoReport report_;
};

void CheckWeights(const ScatteredPoints& points) {
  double sum = 0;
  for (const double weight : points.weights) {
    sum += weight;
  }
  if (!std::isfinite(sum)) {
    RefuseFit("the points' weights add up to no finite number; divide them all by the largest");
  }
}

}  // namespace

void CheckNested(const HSplineSurface& start, const ScatteredPoints& points) {
  if (!start.Offsets().empty()) {
    RefuseFit(
        "the start has detail of finer levels; give a start without it, or use plan adaptive");
  }
  if (points.size() < kMinPoints) {
    FailForFew(points.size(), "");
  }
  CheckWeights(points);
  const Vec2 lengths_mm = MeanLengths(start);
  if (!(lengths_mm.allFinite() && lengths_mm.minCoeff() > 0)) {
    RefuseFit("the points have no extent along u or v; give other (u,v)");
  }
}

void UpdateReport(const HSplineSurface& surface, const ScatteredPoints& points,
                  std::span<const double> residual_mm, int threads, AutoReport& report) {
  constexpr double kClearly = 1.2;  // ratio of distances from which the report no longer holds
  NestedPoints left = DisplacementsFrom(surface, points, threads);
  std::vector<char> outlier(left.size(), 0);
  for (std::size_t k = 0; k < left.size(); ++k) {
    outlier[k] = std::ranges::binary_search(report.outliers, left.given[k]) ? 1 : 0;
  }
  left.UpdateMeanWeight(outlier);
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
  if (before > 0) {  // assumes about as many parameters as before
    report.noise_mm *= std::sqrt(after / before);
  }
  if (after > kClearly * kClearly * before) {
    report.held_out_rms_mm = kNaN;
    report.limited_by_density = false;
    report.met_to_rounding = report.met_to_rounding &&
                             report.noise_mm <= kRoundingOfPoints * MeanLengths(surface).norm();
  }
}

NestedFitResult FitNested(const HSplineSurface& start, NestedPoints points, const AutoPlan& plan,
                          const RunContext& context) {
  if (points.size() < kMinPoints) {
    FailForFew(points.size(), points.repeated.empty() ? "" : " that differ");
  }
  std::optional<RunOffsets> offsets = FindRunOffsets(points, start);
  if (offsets) {
    Level(*offsets, points);
  }
  return NestedFitter(start, std::move(points), std::move(offsets), plan, context).Run();
}

NestedFitResult FitNested(const HSplineSurface& start, const ScatteredPoints& points,
                          const AutoPlan& plan, const RunContext& context) {
  CheckNested(start, points);
  return FitNested(start, DisplacementsFrom(start, points, context.threads), plan, context);
}

}  // namespace semblance::fitting
