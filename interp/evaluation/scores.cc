// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/evaluation/scores.h"

#include <algorithm>
#include <boost/math/special_functions/erf.hpp>
#include <cmath>
#include <limits>
#include <numbers>

#include "surfaces/base/geometry.h"

namespace semblance::interp {
namespace {

constexpr int kLevels = 19;  // 5 % .. 95 %
constexpr double kScoreRounding = 1e-9;

double Density(double z) { return std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi); }
double Cumulative(double z) { return std::erfc(-z / std::numbers::sqrt2) / 2; }

constexpr double kInfinite = std::numeric_limits<double>::infinity();

// Half the width of the central interval with this probability, in standard deviations.
double Reach(double share) { return std::numbers::sqrt2 * boost::math::erf_inv(share); }

// Weighted sums over points.
struct Sums {
  double weight = 0, absolute = 0, squares = 0, error = 0;
  double stated = 0, crps = 0, log_score = 0, interval = 0, sd = 0;
  double within_50 = 0, within_90 = 0, within_95 = 0;
  bool certain_and_right = false, certain_and_wrong = false;
  std::vector<double> pit = std::vector<double>(kPitBins, 0);

  void AddError(double e, double by) {
    weight += by;
    absolute += by * std::abs(e);
    squares += by * e * e;
    error += by * e;
  }
  void AddStated(double e, double sd_mm, double by) {
    stated += by;
    crps += by * GaussianCrps_mm(e, sd_mm);
    interval += by * GaussianIntervalScore_mm(e, sd_mm, 0.9);
    sd += by * sd_mm;
    const double share = ShareAround(e, sd_mm);
    within_50 += share <= 0.5 ? by : 0;
    within_90 += share <= 0.9 ? by : 0;
    within_95 += share <= 0.95 ? by : 0;
    if (sd_mm > 0) {
      log_score += by * GaussianLogScore(e, sd_mm);
    } else {
      (share == 0 ? certain_and_right : certain_and_wrong) = true;
    }
    AddPit(e, sd_mm, by);
  }
  void AddPit(double e, double sd_mm, double by) {
    if (sd_mm == 0 && ShareAround(e, sd_mm) == 0) {
      for (double& part : pit) {
        part += by / kPitBins;
      }
      return;
    }
    const int bin = static_cast<int>(kPitBins * GaussianPit(e, sd_mm));
    pit[std::min(bin, kPitBins - 1)] += by;
  }
  double LogScore() const {
    return certain_and_wrong ? kInfinite : certain_and_right ? -kInfinite : log_score / stated;
  }
};

void PutMeans(const Sums& sums, DepthScores& scores) {
  if (sums.weight > 0) {
    scores.mae_mm = sums.absolute / sums.weight;
    scores.rmse_mm = std::sqrt(sums.squares / sums.weight);
    scores.bias_mm = sums.error / sums.weight;
  }
  if (sums.stated > 0) {
    scores.crps_mm = sums.crps / sums.stated;
    scores.log_score = sums.LogScore();
    scores.interval_score_90_mm = sums.interval / sums.stated;
    scores.coverage_50 = sums.within_50 / sums.stated;
    scores.coverage_90 = sums.within_90 / sums.stated;
    scores.coverage_95 = sums.within_95 / sums.stated;
    scores.mean_sd_mm = sums.sd / sums.stated;
    for (const double in_bin : sums.pit) {
      scores.pit.push_back(in_bin / sums.stated);
    }
  }
}

}  // namespace

double ShareAround(double error, double sd) {
  if (sd > 0) {
    return std::erf(std::abs(error) / (sd * std::numbers::sqrt2));
  }
  return std::abs(error) <= kScoreRounding ? 0 : 1;
}

std::vector<double> Coverage(std::span<const double> errors, std::span<const double> sds,
                             std::span<const double> weights) {
  std::vector<double> within(kLevels, 0);
  double all = 0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (!std::isfinite(errors[i]) || !std::isfinite(sds[i])) {
      continue;
    }
    const double weight = weights.empty() ? 1 : weights[i], share = ShareAround(errors[i], sds[i]);
    all += weight;
    for (int k = 0; k < kLevels; ++k) {
      within[k] += share <= (k + 1) / 20.0 ? weight : 0;
    }
  }
  if (!(all > 0)) {
    return {};
  }
  for (double& share : within) {
    share /= all;
  }
  return within;
}

double CoverageAt90(const std::vector<double>& coverage) {
  return coverage.empty() ? kNaN : coverage[17];
}

double GaussianCrps_mm(double error_mm, double sd_mm) {
  if (sd_mm == 0) {
    return std::abs(error_mm);
  }
  const double z = error_mm / sd_mm;
  return sd_mm *
         (z * std::erf(z / std::numbers::sqrt2) + 2 * Density(z) - 1 / std::sqrt(std::numbers::pi));
}

double GaussianLogScore(double error_mm, double sd_mm) {
  if (sd_mm == 0) {
    return ShareAround(error_mm, sd_mm) == 0 ? -kInfinite : kInfinite;
  }
  const double z = error_mm / sd_mm;
  return std::log(sd_mm * std::sqrt(2 * std::numbers::pi)) + z * z / 2;
}

double GaussianIntervalScore_mm(double error_mm, double sd_mm, double share) {
  const double half_mm = Reach(share) * sd_mm;
  return 2 * half_mm + 2 / (1 - share) * std::max(0.0, std::abs(error_mm) - half_mm);
}

double GaussianPit(double error_mm, double sd_mm) { return Cumulative(-error_mm / sd_mm); }

DepthScores ScoreDepths(std::span<const double> errors, std::span<const double> sds,
                        std::span<const double> weights) {
  DepthScores scores;
  Sums sums;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (!std::isfinite(errors[i])) {
      continue;
    }
    const double weight = weights.empty() ? 1 : weights[i];
    ++scores.points;
    sums.AddError(errors[i], weight);
    if (std::isfinite(sds[i])) {
      ++scores.stated;
      scores.certain += sds[i] == 0 ? 1 : 0;
      sums.AddStated(errors[i], sds[i], weight);
    }
  }
  PutMeans(sums, scores);
  return scores;
}

}  // namespace semblance::interp
