// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/average_skull.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "fitting/problem/placement.h"
#include "interp/dowels/dowel.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/base/quantile.h"

namespace semblance::problems {
namespace {

struct AverageLandmark {
  std::string_view code;       // Site::landmark
  double x, y, z;              // mm; the left one of a pair
  double out_x, out_y, out_z;  // outward direction of the bone, about unit
};

// The directions are the mean over the 54 heads of configs/mean_skull/README.md, made symmetric.
constexpr AverageLandmark kAverageSkull[] = {
    {"sg", 0, 3, 27, 0, -0.92, 0.39},
    {"g", 0, -2, 13, 0, -1, 0.03},
    {"n", 0, 0, 0, 0, -1, 0.03},
    {"rhi", 0, -11, -14, 0, -0.75, 0.66},
    {"mp", 0, 0, -62, 0, -0.95, 0.32},
    {"pr", 0, -1, -67, 0, -0.96, 0.27},
    {"id", 0, 4, -91, 0, -0.88, -0.47},
    {"sm", 0, 10, -102, 0, -0.99, -0.14},
    {"pg", 0, 10, -112, 0, -1, -0.04},
    {"me", 0, 19, -121, 0, -0.52, -0.85},
    {"fe", 31, 20, 44, 0.45, -0.71, 0.53},
    {"mso", 29, 6, 11, 0.31, -0.88, -0.36},
    {"mio", 35, 12, -29, 0.25, -0.91, -0.33},
    {"im", 41, 20, -41, 0.35, -0.85, -0.4},
    {"lo", 46, 21, -36, 0.52, -0.75, -0.42},
    {"zy", 63, 57, -29, 1, 0.01, -0.05},
    {"sgl", 60, 81, -27, 0.98, -0.15, 0.16},
    {"go", 48, 71, -89, 0.98, -0.19, -0.12},
    {"sM2", 29, 35, -61, 0.97, -0.24, -0.04},
    {"mr", 45, 61, -71, 0.91, -0.4, -0.07},
    {"iM2", 34, 38, -89, 0.69, -0.67, 0.28},
};

Vec3 Mirrored(const Vec3& p) { return {-p.x(), p.y(), p.z()}; }

const AverageLandmark& FindAverageLandmark(std::string_view site) {
  const std::string landmark = WithoutSide(site);
  const auto* const found = std::ranges::find(kAverageSkull, landmark, &AverageLandmark::code);
  if (found == std::end(kAverageSkull)) {
    throw InputError(fmt::format("average skull: {}", problems::StandardSiteFault(site)));
  }
  return *found;
}

// The points of the same sites on the average skull and on the subject.
struct SitePairs {
  std::vector<Vec3> average, skull;
};

SitePairs MakePairs(std::span<const SitePoint> sites, Handedness hand) {
  SitePairs pairs;
  for (const SitePoint& s : sites) {
    const Vec3 average = AverageSite(s.site);
    pairs.average.push_back(hand == Handedness::kMirrored ? Mirrored(average) : average);
    pairs.skull.push_back(s.point);
  }
  return pairs;
}

std::vector<double> Residuals(const SitePairs& pairs, const Similarity& skull_from_average) {
  std::vector<double> residuals;
  for (std::size_t k = 0; k < pairs.skull.size(); ++k) {
    residuals.push_back((skull_from_average * pairs.average[k] - pairs.skull[k]).norm() /
                        skull_from_average.scale);
  }
  return residuals;
}

// True if three points span a triangle, so that they determine a pose. 1e-6 only excludes
// round-off.
bool Spans(const Vec3& a, const Vec3& b, const Vec3& c) {
  return (b - a).cross(c - a).norm() >
         1e-6 * std::max((b - a).squaredNorm(), (c - a).squaredNorm());
}

bool SpansABroadTriangle(const SitePairs& pairs, const std::array<std::size_t, 3>& t) {
  // Twice the area of a right triangle with legs of 20 mm. Smaller triangles determine the rotation
  // too poorly to start from.
  constexpr double kMinDoubleArea_mm2 = 400;
  const auto& a = pairs.average;
  return (a[t[1]] - a[t[0]]).cross(a[t[2]] - a[t[0]]).norm() > kMinDoubleArea_mm2 &&
         Spans(pairs.skull[t[0]], pairs.skull[t[1]], pairs.skull[t[2]]);
}

Similarity PoseFromTriple(const SitePairs& pairs, const std::array<std::size_t, 3>& t) {
  const std::array average = {pairs.average[t[0]], pairs.average[t[1]], pairs.average[t[2]]};
  const std::array skull = {pairs.skull[t[0]], pairs.skull[t[1]], pairs.skull[t[2]]};
  return PlaceTemplate(average, skull);
}

Similarity LeastMedianPose(const SitePairs& pairs) {
  Similarity best;
  double least = std::numeric_limits<double>::infinity();
  const std::size_t n = pairs.skull.size();
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; ++j) {
      for (std::size_t k = j + 1; k < n; ++k) {
        if (!SpansABroadTriangle(pairs, {i, j, k})) {
          continue;
        }
        const Similarity candidate = PoseFromTriple(pairs, {i, j, k});
        std::vector<double> residuals = Residuals(pairs, candidate);
        const double median = UpperMedian(residuals);
        if (median < least) {
          least = median;
          best = candidate;
        }
      }
    }
  }
  if (!std::isfinite(least)) {
    throw InputError(
        fmt::format("landmarks: at least three that are apart and not on a line are needed to find "
                    "the skull's pose; place more than these {}",
                    n));
  }
  return best;
}

// Iteratively reweighted least squares with the Cauchy loss. Its width of 8 mm is how far the three
// measured skulls differ from each other: larger residuals are rather mistakes than anatomy.
Similarity RefineByReweighting(const SitePairs& pairs, Similarity pose) {
  constexpr double kWidth_mm = 8, kCostTolerance = 1e-9;
  constexpr int kMaxSteps = 500;
  double last = std::numeric_limits<double>::infinity();
  for (int step = 0; step < kMaxSteps; ++step) {
    std::vector<double> weights;
    double cost = 0;
    for (const double r : Residuals(pairs, pose)) {
      weights.push_back(1 / (1 + std::pow(r / kWidth_mm, 2)));
      cost += std::log1p(std::pow(r / kWidth_mm, 2));
    }
    if (std::abs(last - cost) <= kCostTolerance) {
      break;
    }
    last = cost;
    pose = PlaceTemplate(pairs.average, pairs.skull, weights);
  }
  return pose;
}

}  // namespace

Vec3 AverageSite(std::string_view site) {
  const AverageLandmark& found = FindAverageLandmark(site);
  const Vec3 left(found.x, found.y, found.z);
  return SideOfSite(site) == Side::kRight ? Mirrored(left) : left;
}

Vec3 AverageDirection(std::string_view site) {
  const AverageLandmark& found = FindAverageLandmark(site);
  const Vec3 left = Vec3(found.out_x, found.out_y, found.out_z).normalized();
  return SideOfSite(site) == Side::kRight ? Mirrored(left) : left;
}

Vec3 SkullFit::Predicted(std::string_view site) const {
  const Vec3 average = AverageSite(site);
  return skull_from_average * (mirrored ? Mirrored(average) : average);
}

SkullFit FitAverageSkull(std::span<const SitePoint> sites, Handedness hand) {
  const SitePairs pairs = MakePairs(sites, hand);
  SkullFit fit;
  fit.mirrored = hand == Handedness::kMirrored;
  fit.skull_from_average = RefineByReweighting(pairs, LeastMedianPose(pairs));
  fit.residual_mm = Residuals(pairs, fit.skull_from_average);
  std::vector<double> sorted = fit.residual_mm;
  fit.median_mm = UpperMedian(sorted);
  return fit;
}

PoseAxes FindPoseAxes(const Mat3& skull_from_average) {
  constexpr double kUprightWithin_deg = 60;
  const auto is_upright = [](const Mat3& r) {
    return Eigen::AngleAxisd(r).angle() * 180 / std::numbers::pi <= kUprightWithin_deg;
  };
  if (is_upright(skull_from_average)) {
    return PoseAxes::kLps;
  }
  const Mat3 ras = Vec3(-1, -1, 1).asDiagonal();
  return is_upright(ras * skull_from_average) ? PoseAxes::kRas : PoseAxes::kNeither;
}

Vec3 SkullSites::InAverage(const Vec3& point) const {
  return skull_from_average.rotation.transpose() * (point - skull_from_average.translation) /
         skull_from_average.scale;
}

SkullSites CompleteSites(std::span<const SitePoint> sites) {
  const SkullFit fit = FitAverageSkull(sites);
  SkullSites complete{fit.skull_from_average, {}};
  for (const std::string& site : StandardSiteCodes()) {
    complete.points[site] = fit.Predicted(site);
  }
  for (const SitePoint& s : sites) {
    complete.points[s.site] = s.point;
  }
  return complete;
}

}  // namespace semblance::problems
