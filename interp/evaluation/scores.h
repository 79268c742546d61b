// SPDX-License-Identifier: GPL-3.0-or-later
// Scores of predictions that state a standard deviation: a forecast is the normal distribution with
// the prediction as its mean and the stated sd. CRPS, interval score and log score are proper: none
// is better in the mean than the true distribution (Gneiting & Raftery 2007, JASA 102).
#pragma once

#include <span>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance {

// error: predicted less true, mm. sd_mm >= 0; that of 0 is a forecast without doubt, and its scores
// are what the others tend to. All are better the smaller they are.

// Continuous ranked probability score, mm: the integral over x of (F(x) - [x >= truth])^2. In
// closed form sd (z (2 Phi(z) - 1) + 2 phi(z) - 1 / sqrt(pi)), z = error / sd (ibid., eq. 5).
double GaussianCrps_mm(double error_mm, double sd_mm);

// Less the logarithm of the density at the truth: log(sd sqrt(2 pi)) + z^2 / 2. Of an sd of 0
// infinite: below 0 where the error is none (ShareAround of calibration.h), else above.
double GaussianLogScore(double error_mm, double sd_mm);

// Of the central interval that should hold `share`: its width, and 2 / (1 - share) times what the
// truth lies outside of it (ibid., eq. 43). share: above 0, below 1.
double GaussianIntervalScore_mm(double error_mm, double sd_mm, double share);

// Probability integral transform: the share of the forecast below the truth, 0..1. Uniform where
// forecasts are right. sd_mm > 0, or an error that is not 0.
double GaussianPit(double error_mm, double sd_mm);

inline constexpr int kPitBins = 10;

// Means, by weight, over the points with a finite error; from crps_mm on over those of them with a
// stated sd. NaN, and no pit, where there is none. One forecast without doubt makes log_score
// infinite: above 0 if one of them errs. In the pit a certain forecast that is right counts in all
// parts alike.
struct DepthScores {
  int points = 0;   // with a finite error
  int stated = 0;   // of these, with an sd
  int certain = 0;  // of these, with an sd of 0
  double mae_mm = kNaN;
  double rmse_mm = kNaN;
  double bias_mm = kNaN;  // above 0: predicted too thick
  double crps_mm = kNaN;
  double log_score = kNaN;
  double interval_score_90_mm = kNaN;
  double coverage_50 = kNaN, coverage_90 = kNaN, coverage_95 = kNaN;
  double mean_sd_mm = kNaN;
  std::vector<double> pit;  // share in each of kPitBins equal parts of 0..1
};

// sds: one per error, >= 0, NaN where none is stated. weights: one per error, >= 0, or none for
// equal ones.
DepthScores ScoreDepths(std::span<const double> errors, std::span<const double> sds,
                        std::span<const double> weights = {});

}  // namespace semblance
