// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/fit_quality.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>

#include "fitting/plan/fit_check.h"
#include "surfaces/base/quantile.h"

namespace semblance::problems {
namespace {

// The mean squares of the points' distances from their mean along three axes, ascending: the first
// one is that of the distances from the best plane.
Vec3 MeanSquares(std::span<const Vec3> positions) {
  Vec3 mean = Vec3::Zero();
  for (const Vec3& p : positions) {
    mean += p / static_cast<double>(positions.size());
  }
  Mat3 moments = Mat3::Zero();
  for (const Vec3& p : positions) {
    moments += (p - mean) * (p - mean).transpose();
  }
  return Eigen::SelfAdjointEigenSolver<Mat3>(moments).eigenvalues() /
         static_cast<double>(positions.size());
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

// The distances of the points that are no outliers; with weights, over the deviations up to a
// factor.
std::vector<double> CountedDistances(const FitResult& fit, std::span<const double> weights = {}) {
  std::vector<double> distances;
  distances.reserve(fit.residual_mm.size());
  for (std::uint32_t k = 0; k < fit.residual_mm.size(); ++k) {
    if (!IsOutlier(fit, k)) {
      distances.push_back(fit.residual_mm[k] * (weights.empty() ? 1 : std::sqrt(weights[k])));
    }
  }
  return distances;
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

}  // namespace

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
  constexpr double kNarrow = 1e-4;  // share of the mean squares across a line
  const Vec3 squares = MeanSquares(table.positions);
  given.on_line = squares[1] < kNarrow * squares[2];
  given.plane_rms = std::sqrt(std::max(0.0, squares[0]));
  std::ranges::transform(exact, std::back_inserter(given.exact_uv), &ExactPoint::uv);
  return given;
}

void CompareShapes(const GivenPoints& given, PointFit& result) {
  const double diagonal = given.box.diagonal().norm();
  result.reach = ReachBeyond(result.fit.surface, given.box, diagonal);
  result.off = given.has_uv && given.on_line
                   ? kNaN
                   : RootMeanSquare(CountedDistances(result.fit)) / diagonal;
}

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

std::string TailText(const GivenPoints& given, const FitResult& fit, std::string_view unit) {
  constexpr double kLongTail = 3;  // RMS over median; 1.5 for normal errors, 2 for Laplace's
  if (!fit.automatic || fit.automatic->met_to_rounding) {
    return "";
  }
  std::vector<double> distances = CountedDistances(fit);
  if (distances.empty()) {
    return "";
  }
  const double rms_mm = RootMeanSquare(distances), median_mm = UpperMedian(distances);
  // Points of very different weights have a long tail without gross errors.
  std::vector<double> weighted = CountedDistances(fit, given.weights);
  const double weighted_rms = RootMeanSquare(weighted), weighted_median = UpperMedian(weighted);
  return rms_mm > kLongTail * median_mm && weighted_rms > kLongTail * weighted_median
             ? fmt::format(
                   "the distances have a long tail: half of the points lie within {}, and the RMS "
                   "is {}; many points may be gross errors that were not recognised, and the "
                   "surface follows them; clean the points, and fit again",
                   LengthText(median_mm, unit, 3), LengthText(rms_mm, unit, 3))
             : "";
}

std::string ReliefText(const GivenPoints& given, const PointFit& result) {
  // A relief of 2 % of the extent is far above the noise of measured points, so that a noisy plane
  // gets no note.
  constexpr double kUnexplained = 0.85, kRelief = 0.02;
  const double extent = given.box.diagonal().norm(), left = result.off * extent / given.plane_rms;
  if (given.plane_rms < kRelief * extent || !(left > kUnexplained)) {
    return "";
  }
  return fmt::format(
      "the points lie as far from the surface as from a plane ({:.0f} %): the surface shows "
      "nothing of their relief; check that the numbers of each row belong to one point, since a "
      "column that was sorted by itself has this effect",
      100 * left);
}

namespace {

// For plans that do not measure the noise between neighbours: the distances from the surface. A
// surface that follows the heavier points hides an exchange where weights are spread over 50 times.
NoiseByWeight CompareDistancesByWeight(std::span<const double> weights,
                                       std::span<const double> distances) {
  constexpr std::size_t kFewest = 100;  // points in each group
  if (weights.size() < 2 * kFewest) {
    return {};
  }
  const auto split = std::ranges::minmax(weights);
  const double middle = std::sqrt(split.min * split.max);
  std::vector<double> light, heavy;
  for (std::size_t k = 0; k < weights.size(); ++k) {
    (weights[k] < middle ? light : heavy).push_back(distances[k]);
  }
  if (light.size() < kFewest || heavy.size() < kFewest) {
    return {};
  }
  return {.light_mm = UpperMedian(light),
          .heavy_mm = UpperMedian(heavy),
          .light_weight = split.min,
          .heavy_weight = split.max};
}

}  // namespace

std::string WeightText(const GivenPoints& given, const FitResult& fit, std::string_view unit) {
  // True weights make the noise of the heavier points the smaller one, and constant noise makes
  // both equal; estimates of equal noises differ by 1.3 at most.
  constexpr double kFactor = 4, kRatio = 1.5;
  const NoiseByWeight noise = fit.automatic
                                  ? fit.automatic->by_weight
                                  : CompareDistancesByWeight(given.weights, fit.residual_mm);
  if (!(noise.heavy_weight > kFactor * noise.light_weight) ||
      !(noise.heavy_mm > kRatio * noise.light_mm)) {
    return "";
  }
  const std::string light = LengthText(noise.light_mm, unit, 3),
                    heavy = LengthText(noise.heavy_mm, unit, 3);
  return given.has_sigma
             ? fmt::format(
                   "points of small sigma have more noise than those of great sigma ({} and {}), "
                   "and a small sigma means an exact point; if the column "
                   "holds weights, name it weight",
                   heavy, light)
             : fmt::format(
                   "points of great weight have more noise than those of small weight ({} and {}), "
                   "and a great weight means an exact point; if the column "
                   "holds standard deviations, name it sigma",
                   heavy, light);
}

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

std::string TwiceText(const FitResult& fit) {
  return fit.automatic && fit.automatic->measured_twice > 0
             ? fmt::format(
                   "{} points lie nearly at the places of others and differ from them by as much "
                   "as neighbours do: all count, as points that were measured twice; if they are a "
                   "rounded or moved export of the others, remove them",
                   fit.automatic->measured_twice)
             : "";
}

}  // namespace semblance::problems
