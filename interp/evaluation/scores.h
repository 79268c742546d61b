// SPDX-License-Identifier: GPL-3.0-or-later
// Scores and calibration of predictions that state a standard deviation. The forecast is a normal
// distribution with the prediction as its mean and the stated sd. CRPS, interval score and log
// score are proper scores: no forecast has a better expected score than the true distribution
// (Gneiting & Raftery 2007, JASA 102).
#pragma once

#include <span>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance::interp {

// The probability (0..1) of the smallest central interval of a normal distribution that contains
// the error. With an sd of 0 it is 0 for an error of 0 (within 1e-9, for round-off) and otherwise
// 1. sd >= 0.
double ShareAround(double error, double sd);

// The calibration curve: the shares (0..1) of errors within the central intervals that should
// contain 5 %, 10 %, .. 95 % of them; 19 ascending values. It uses errors whose error and sd are
// finite. weights: one per error, >= 0, or none for equal weights. Empty if the total weight is 0.
std::vector<double> Coverage(std::span<const double> errors, std::span<const double> sds,
                             std::span<const double> weights = {});

// The curve's value at 90 %; NaN for an empty curve.
double CoverageAt90(const std::vector<double>& coverage);

// In all scores error_mm is predicted minus true and sd_mm >= 0. Smaller is better. The scores of
// sd_mm = 0, a certain forecast, are the limits for sd_mm -> 0.

// Continuous ranked probability score, mm: the integral over x of (F(x) - [x >= truth])^2. The
// closed form is sd (z (2 Phi(z) - 1) + 2 phi(z) - 1 / sqrt(pi)) with z = error / sd (ibid., eq.
// 5).
double GaussianCrps_mm(double error_mm, double sd_mm);

// Negative logarithm of the density at the truth: log(sd sqrt(2 pi)) + z^2 / 2. For an sd of 0 it
// is -infinity if the error is 0 (as in ShareAround), otherwise +infinity.
double GaussianLogScore(double error_mm, double sd_mm);

// Interval score of the central interval with probability `share` (0 < share < 1): its width plus 2
// / (1 - share) times the distance of the truth from the interval (ibid., eq. 43).
double GaussianIntervalScore_mm(double error_mm, double sd_mm, double share);

// Probability integral transform: the forecast's probability (0..1) below the truth. It is
// uniformly distributed for correct forecasts. Needs sd_mm > 0 or an error that is not 0.
double GaussianPit(double error_mm, double sd_mm);

inline constexpr int kPitBins = 10;

// Weighted means over the points with a finite error; from crps_mm on, over the points with a
// stated sd. NaN, and an empty pit, if there are no such points. A certain forecast makes log_score
// infinite: +infinity if one of them is wrong. A certain and correct forecast counts equally in all
// parts of the pit.
struct DepthScores {
  int points = 0;   // points with a finite error
  int stated = 0;   // of these, points with a stated sd
  int certain = 0;  // of these, points with an sd of 0
  double mae_mm = kNaN;
  double rmse_mm = kNaN;
  double bias_mm = kNaN;  // above 0: predicted too thick
  double crps_mm = kNaN;
  double log_score = kNaN;
  double interval_score_90_mm = kNaN;
  double coverage_50 = kNaN, coverage_90 = kNaN, coverage_95 = kNaN;
  double mean_sd_mm = kNaN;
  std::vector<double> pit;  // share of points in each of kPitBins equal parts of 0..1
};

// sds: one per error, >= 0, NaN if not stated. weights: one per error, >= 0, or none for equal
// weights.
DepthScores ScoreDepths(std::span<const double> errors, std::span<const double> sds,
                        std::span<const double> weights = {});

}  // namespace semblance::interp
