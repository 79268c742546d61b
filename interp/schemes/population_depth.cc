// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/schemes/population_depth.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "interp/dowels/dowel_samples.h"
#include "interp/kriging/kriging_process.h"
#include "interp/schemes/people.h"
#include "interp/schemes/radial_basis.h"

namespace semblance::interp {
namespace {

// The expectation from people's points at one place of the skull.
struct Expected {
  Vec3 place = Vec3::Constant(kNaN);
  LogDepth depth;
  double gap_mm = kNaN;
  double nearest_mm = kNaN;  // to the nearest of the points
};

// The expectation all over the skull, from people's points on it.
class Expectation {
 public:
  explicit Expectation(std::vector<SubjectPoint> points)
      : points_(std::move(points)), places_(3, std::ssize(points_)) {
    for (std::size_t k = 0; k < points_.size(); ++k) {
      places_.col(static_cast<Eigen::Index>(k)) = points_[k].on_skull;
    }
  }

  // The Gaussian mean of the points around a place. Points that face away hardly count.
  Expected At(const Vec3& place, const Vec3& normal) const {
    constexpr double kWidth_mm = 6;  // about the distance of neighbouring points
    constexpr double kAway = 0.05;  // keeps the sum of weights above 0 on the far side of thin bone
    constexpr double kWidths = 6;   // weights beyond are below 1e-7 of the nearest point's
    const Eigen::ArrayXd squared = (places_.colwise() - place).colwise().squaredNorm();
    const double nearest = squared.minCoeff();
    Expected at{place, {0, 0, 0}, 0, std::sqrt(nearest)};
    double weights = 0;
    for (std::size_t k = 0; k < points_.size(); ++k) {
      // The nearest point has the weight 1 at any distance, so that no sum vanishes.
      const double beyond = squared[static_cast<Eigen::Index>(k)] - nearest;
      if (beyond > kWidths * kWidths * kWidth_mm * kWidth_mm) {
        continue;
      }
      const SubjectPoint& point = points_[k];
      const double weight = std::exp(-beyond / (2 * kWidth_mm * kWidth_mm)) *
                            std::max(kAway, point.normal.dot(normal));
      at.depth.mean += weight * point.depth.mean;
      at.depth.sd += weight * point.depth.sd;
      at.depth.loading += weight * point.depth.loading;
      at.gap_mm += weight * point.gap_mm;
      weights += weight;
    }
    at.depth.mean /= weights;
    at.depth.sd /= weights;
    at.depth.loading /= weights;
    at.gap_mm /= weights;
    return at;
  }

 private:
  std::vector<SubjectPoint> points_;
  Eigen::Matrix3Xd places_;  // of the points, so that all distances are one expression
};

double CovarianceBetween(const Expected& a, const Expected& b, double range_mm) {
  const double la = a.depth.loading, lb = b.depth.loading;
  const double rest = std::sqrt((1 - la * la) * (1 - lb * lb));
  return a.depth.sd * b.depth.sd *
         (la * lb +
          rest * CorrelationAt(Covariance::kMatern32, (a.place - b.place).norm(), range_mm).value);
}

// A dowel that people's points reach.
struct KnownDepth {
  Expected expected;
  double log_depth = kNaN;  // from the bone
  double variance = kNaN;   // of its error
};

std::vector<KnownDepth> KnownDepths(const PopulationDepth& options, const People& people,
                                    const Expectation& expectation, const DepthInput& input) {
  std::vector<Dowel> dowels(input.dowels.begin(), input.dowels.end());
  std::ranges::sort(dowels, {}, &Dowel::site);  // so that their order does not matter
  std::vector<KnownDepth> known;
  for (const Dowel& dowel : dowels) {
    Expected at = expectation.At(dowel.base, dowel.direction);
    if (const auto site = people.sites.find(dowel.site); site != people.sites.end()) {
      at.depth = site->second.depth;
    } else if (at.nearest_mm > options.reach_mm) {
      continue;
    }
    const double depth_mm = dowel.depth_mm + at.gap_mm;
    const double own = std::isfinite(dowel.sd_mm) ? dowel.sd_mm / depth_mm : 0;
    known.push_back({at, std::log(depth_mm), options.error * options.error + own * own});
  }
  return known;
}

// The tissue outside the filled skull. A skull is filled below the skin, so at least half of the
// depth between the dowels is left; an implicit surface has holes over tissue thinner than its
// cells.
double OutsideGap(double from_bone_mm, double gap_mm, double between_dowels_mm) {
  return std::max(from_bone_mm - gap_mm, std::min(from_bone_mm, between_dowels_mm / 2));
}

// The process given the dowels.
class Conditioned {
 public:
  Conditioned(std::vector<KnownDepth> known, double range_mm)
      : known_(std::move(known)), range_mm_(range_mm) {
    const auto n = static_cast<Eigen::Index>(known_.size());
    Eigen::MatrixXd covariance(n, n);
    Eigen::VectorXd surprise(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j < n; ++j) {
        covariance(i, j) = CovarianceBetween(known_[i].expected, known_[j].expected, range_mm_);
      }
      covariance(i, i) += known_[i].variance;
      surprise[i] = known_[i].log_depth - known_[i].expected.depth.mean;
    }
    factor_.compute(covariance);
    weights_ = factor_.solve(surprise);
  }

  // Depth on the skull, and its deviation. between_dowels_mm: interpolated there without people.
  DepthValue At(const Expected& place, double between_dowels_mm) const {
    const auto n = static_cast<Eigen::Index>(known_.size());
    Eigen::VectorXd to_known(n);
    for (Eigen::Index k = 0; k < n; ++k) {
      to_known[k] = CovarianceBetween(place, known_[k].expected, range_mm_);
    }
    const double from_bone_mm = std::exp(place.depth.mean + to_known.dot(weights_));
    const double variance = place.depth.sd * place.depth.sd - to_known.dot(factor_.solve(to_known));
    return {OutsideGap(from_bone_mm, place.gap_mm, between_dowels_mm),
            from_bone_mm * std::sqrt(std::max(0.0, variance))};
  }

 private:
  std::vector<KnownDepth> known_;
  double range_mm_;
  Eigen::LDLT<Eigen::MatrixXd> factor_;
  Eigen::VectorXd weights_;
};

// 0 where people reach, 1 beyond twice their reach, smooth between.
double ShareOfFallback(double nearest_mm, double reach_mm) {
  return SmoothStep(nearest_mm / reach_mm - 1);
}

}  // namespace

DepthField InterpolateDepth(const PopulationDepth& options, const DepthInput& input,
                            const RunContext& run) {
  CheckDepthInput(input);
  CheckSurface(PopulationDepth::kName, input.skull);
  const People& people = CarriedPeople();
  CarriedBone carried = CarryToSubject(people, input, run);
  DepthField beyond =
      InterpolateDepth(RadialBasis{.max_angle_deg = options.max_angle_deg}, input, run);
  if (!carried.fault.empty()) {
    beyond.shares = {{std::string(RadialBasis::kName), 1}};
    beyond.notes.push_back(
        fmt::format("interp: population: {}; the depths are those of radial_basis", carried.fault));
    return beyond;
  }
  const Expectation expectation(std::move(carried.points));
  const std::vector<DepthSample> samples = DepthSamples(input.dowels);
  const DepthLimits limits(samples, false);
  const Conditioned person(KnownDepths(options, people, expectation, input), options.range_mm);
  return AssignWhereFacing(input, samples, options.max_angle_deg, run, [&](std::size_t i) {
    const Expected place = expectation.At(input.skull.points[i], input.normals[i]);
    const double share = ShareOfFallback(place.nearest_mm, options.reach_mm);
    const DepthValue own = person.At(place, beyond.depth_mm[i]);
    return DepthValue{
        limits(share < 1 ? (1 - share) * own.mm + share * beyond.depth_mm[i] : beyond.depth_mm[i]),
        share > 0 ? kNaN : own.sd_mm};
  });
}

}  // namespace semblance::interp
