// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/run_offsets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <utility>

#include "fitting/least_squares/patch_energy.h"
#include "fitting/nested/nested_solve.h"
#include "fitting/nested/nested_space.h"
#include "fitting/nested/unresolved_detail.h"
#include "surfaces/base/quantile.h"

namespace semblance::fitting {
namespace {

constexpr int kFolds = 5;     // of runs; each is predicted from the others
constexpr int kSegments = 8;  // of a run, whose medians show how alike its residuals are
constexpr int kDraws = 6;     // of made-up offsets; their mean square has an error of some 20 %
// Points. Trades time for the error of a run's median, which is small beside that of few runs.
constexpr std::size_t kSample = 20000;

// The points of a sample with their runs.
struct SampledRuns {
  NestedPoints points;
  std::vector<std::uint32_t> run;     // per sampled point
  std::vector<std::uint8_t> segment;  // of the run, in the order of the file
};

// The segment of each point of its run.
std::vector<std::uint8_t> SegmentsOf(const NestedPoints& points, const FileRuns& runs) {
  std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>> of_run(runs.count);
  for (std::uint32_t k = 0; k < points.size(); ++k) {
    if (runs.run[k] != FileRuns::kNone) {
      of_run[runs.run[k]].emplace_back(points.given[k], k);
    }
  }
  std::vector<std::uint8_t> segment(points.size(), 0);
  for (auto& run : of_run) {
    std::ranges::sort(run);
    for (std::size_t n = 0; n < run.size(); ++n) {
      segment[run[n].second] = static_cast<std::uint8_t>(n * kSegments / run.size());
    }
  }
  return segment;
}

SampledRuns Sample(const NestedPoints& points, const FileRuns& runs) {
  const std::vector<std::uint8_t> segments = SegmentsOf(points, runs);
  SampledRuns sampled;
  NestedPoints& some = sampled.points;
  some.patches = points.patches;
  some.periodic_u = points.periodic_u;
  some.channels = points.channels;
  some.axes = points.axes;
  constexpr std::size_t kPerRun = 32;  // on average, so that no run is left without points
  const std::size_t wanted = std::max<std::size_t>(kSample, kPerRun * runs.count),
                    every = std::max<std::size_t>(points.size() / wanted, 1);
  for (std::size_t k = 0; k < points.size(); k += every) {
    if (runs.run[k] != FileRuns::kNone) {
      some.uv.push_back(points.uv[k]);
      some.value.push_back(points.value[k]);
      some.given.push_back(points.given[k]);
      sampled.run.push_back(runs.run[k]);
      sampled.segment.push_back(segments[k]);
    }
  }
  return sampled;
}

// A space of whole levels that resolves the spacing of this many runs, as far as it is affordable.
NestedSpace SpaceFor(const NestedPoints& points, std::uint32_t runs, const HSplineSurface& start) {
  constexpr double kMostVertices = 4000;
  const double enough = std::min(0.5 * runs * runs, kMostVertices);
  NestedSpace space(start.shape());
  while (space.Vertices() < enough) {
    OverlayDense(points, space.finest(), /*points_per_patch=*/0, space);
  }
  return space;
}

// Residuals of each segment of each run, by their median; NaN for one without points.
using SegmentMedians = std::vector<std::array<double, kSegments>>;

SegmentMedians MediansOf(const SampledRuns& sampled, const std::vector<double>& residual_mm,
                         std::uint32_t runs) {
  std::vector<std::array<std::vector<double>, kSegments>> values(runs);
  for (std::size_t k = 0; k < sampled.run.size(); ++k) {
    values[sampled.run[k]][sampled.segment[k]].push_back(residual_mm[k]);
  }
  SegmentMedians medians(runs);
  for (std::uint32_t r = 0; r < runs; ++r) {
    for (int s = 0; s < kSegments; ++s) {
      medians[r][s] = values[r][s].empty() ? kNaN : UpperMedian(values[r][s]);
    }
  }
  return medians;
}

// The mean of each run's segments; 0 for a run without points.
std::vector<double> MeansOf(const SegmentMedians& medians) {
  std::vector<double> means;
  for (const auto& run : medians) {
    std::vector<double> known;
    std::ranges::copy_if(run, std::back_inserter(known),
                         [](double median) { return std::isfinite(median); });
    means.push_back(known.empty() ? 0 : ArithmeticMean(known));
  }
  return means;
}

// The distances of whole runs, by one-way analysis of variance over their segments.
struct RunScatter {
  double square_of_means = kNaN;  // mean square of the runs' means
  double common_square = kNaN;    // the part of it that is common to all parts of a run
  double share = kNaN;            // of the segments' variance that is common to a run
};

RunScatter ScatterOf(const SegmentMedians& medians) {
  double means = 0, within = 0, runs = 0, free = 0, segments = 0;
  for (const auto& run : medians) {
    double sum = 0, squares = 0, count = 0;
    for (const double median : run) {
      if (std::isfinite(median)) {
        sum += median;
        squares += median * median;
        ++count;
      }
    }
    if (count > 1) {
      means += std::pow(sum / count, 2);
      within += squares - sum * sum / count;
      free += count - 1;
      segments += count;
      ++runs;
    }
  }
  const double square = within / free, of_means = means / runs,
               common = std::max(of_means - square * runs / segments, 0.0);
  return {
      .square_of_means = of_means, .common_square = common, .share = common / (common + square)};
}

// The fits of a sample to which runs were or were not given.
class RunFits {
 public:
  RunFits(const NestedPoints& points, FileRuns runs, const HSplineSurface& start)
      : runs_(std::move(runs)),
        sampled_(Sample(points, runs_)),
        space_(SpaceFor(sampled_.points, runs_.count, start)),
        solve_(sampled_.points, MeanLengths(start)) {}

  // Finds the weight with which runs are predicted best.
  void ChooseWeight() {
    constexpr double kFactor = 4;
    constexpr int kMost = 16, kMostWorse = 2;
    Begin({});
    double weight = 1000 * solve_.EvenWeight(), best_weight = weight;
    for (int tried = 0, worse = 0; tried < kMost && worse < kMostWorse; ++tried) {
      last_ = ScatterOf(Predict(weight));
      const bool is_best = !(last_.square_of_means >= best_.square_of_means);
      worse = is_best ? 0 : worse + 1;
      best_ = is_best ? last_ : best_;
      best_weight = is_best ? weight : best_weight;
      weight /= kFactor;
    }
    weight_ = best_weight;
  }

  // The largest share of a run's residuals that is common to its parts, for the best weight and the
  // least: near the best one what the surface lacks along the runs may still hide the offsets.
  double Share() const { return std::max(best_.share, last_.share); }

  // Returns whether the others predict hardly anything of how far a run lies off its neighbours. A
  // surface with ridges along the lines is predicted, if some lines fall on each ridge.
  bool AreUnpredictable() {
    constexpr double kLeastLeft = 0.5;  // of the variance of independent offsets; ridges leave 0.1
    return best_.common_square > kLeastLeft * SquareBetweenRuns();
  }

  // The runs' offsets from the fit to all of them.
  RunOffsets Find() {
    RunOffsets offsets{.runs = runs_,
                       .offset_mm = MeansOf(MediansOf(sampled_, Fit({}), runs_.count))};
    offsets.sd_mm = std::sqrt(best_.common_square);
    offsets.left_square = SquareFollowed(offsets.sd_mm);
    return offsets;
  }

 private:
  void Begin(std::vector<char> left_out) {
    solve_.Begin(space_, PointChoice{.left_out = std::move(left_out)});
  }

  // The variance of independent offsets that have the second differences of consecutive runs.
  double SquareBetweenRuns() const {
    constexpr double kOfDifferences = 6;  // 1 + 4 + 1
    std::vector<double> values;
    for (const Vec3& value : sampled_.points.value) {
      values.push_back(value[0]);
    }
    const std::vector<double> mean = MeansOf(MediansOf(sampled_, values, runs_.count));
    double sum = 0;
    for (std::size_t r = 2; r < mean.size(); ++r) {
      sum += std::pow(mean[r] - 2 * mean[r - 1] + mean[r - 2], 2);
    }
    return sum / (kOfDifferences * static_cast<double>(mean.size() - 2));
  }

  // Residuals along the channel of all sampled points, from a fit to those that are not left out.
  std::vector<double> Fit(std::vector<char> left_out) {
    constexpr double kPart = 1e-6;  // of the sum of squares
    Begin(std::move(left_out));
    solve_.SetWeight(weight_);
    solve_.Solve(kPart * SumOfSquares());
    std::vector<double> residual_mm;
    NestedResiduals(solve_).ForEach([&](std::size_t, const NestedResidual& residual) {
      residual_mm.push_back(residual.along[0]);
    });
    return residual_mm;
  }

  double SumOfSquares() const {
    double sum = 0;
    for (const Vec3& value : sampled_.points.value) {
      sum += value[0] * value[0];
    }
    return sum;
  }

  // Each run's segments from fits to the other folds.
  SegmentMedians Predict(double weight) {
    weight_ = weight;
    std::vector<double> predicted(sampled_.run.size(), 0);
    for (int fold = 0; fold < kFolds; ++fold) {
      std::vector<char> left_out(sampled_.run.size(), 0);
      for (std::size_t k = 0; k < left_out.size(); ++k) {
        left_out[k] = sampled_.run[k] % kFolds == static_cast<std::uint32_t>(fold) ? 1 : 0;
      }
      const std::vector<double> residual_mm = Fit(left_out);
      for (std::size_t k = 0; k < left_out.size(); ++k) {
        predicted[k] = left_out[k] != 0 ? residual_mm[k] : predicted[k];
      }
    }
    return MediansOf(sampled_, predicted, runs_.count);
  }

  // The mean square of what a surface with this weight follows of the offsets, by made-up ones of
  // random sign. The product with the surface instead of its square includes its bias on average
  // (Wahba 1983).
  double SquareFollowed(double sd_mm) {
    const std::vector<Vec3> values = sampled_.points.value;
    double sum = 0;
    for (std::uint64_t draw = 0; draw < kDraws; ++draw) {
      std::vector<double> offset(runs_.count);
      for (std::uint64_t r = 0; r < runs_.count; ++r) {
        const std::uint64_t bits = (kDraws * r + draw + 1) * 0xD1B54A32D192ED03u;
        offset[r] = ((bits ^ bits >> 31) & 1u) != 0 ? sd_mm : -sd_mm;
      }
      for (std::size_t k = 0; k < values.size(); ++k) {
        sampled_.points.value[k] = {offset[sampled_.run[k]], 0, 0};
      }
      const std::vector<double> residual_mm = Fit({});
      for (std::size_t k = 0; k < values.size(); ++k) {
        const double offset_mm = sampled_.points.value[k][0];
        sum += offset_mm * (offset_mm - residual_mm[k]);
      }
    }
    sampled_.points.value = values;
    return sum / (kDraws * static_cast<double>(values.size()));
  }

  FileRuns runs_;
  SampledRuns sampled_;
  NestedSpace space_;
  NestedSolve solve_;
  double weight_ = kNaN;
  RunScatter best_, last_;
};

}  // namespace

std::optional<RunOffsets> FindRunOffsets(const NestedPoints& points, const HSplineSurface& start) {
  // Trades offsets beside much detail, which stay in the surface, for detail that passes for
  // offsets.
  constexpr double kLeastShare = 0.5;
  if (points.channels != 1 || points.weighted) {
    return std::nullopt;
  }
  FileRuns runs = FindFileRuns(points);
  if (runs.count == 0) {
    return std::nullopt;
  }
  RunFits fits(points, std::move(runs), start);
  fits.ChooseWeight();
  return fits.Share() > kLeastShare && fits.AreUnpredictable() ? std::optional(fits.Find())
                                                               : std::nullopt;
}

void Level(const RunOffsets& offsets, NestedPoints& points) {
  for (std::size_t k = 0; k < points.size(); ++k) {
    points.value[k][0] -= offsets.At(k);
  }
}

}  // namespace semblance::fitting
