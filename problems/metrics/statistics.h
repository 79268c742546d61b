// SPDX-License-Identifier: GPL-3.0-or-later
// Comparing treatments over subjects. The unit is the subject: one value per subject and treatment.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance {

struct Interval {
  double low = kNaN;
  double high = kNaN;
};

// All NaN for no value, sd for one.
struct SampleSummary {
  int n = 0;
  double mean = kNaN, sd = kNaN, median = kNaN, min = kNaN, max = kNaN;
  double quartile_1 = kNaN, quartile_3 = kNaN;  // Quantile, as the median
  Interval mean_95;  // bootstrap percentiles of the mean; NaN below 3 values
};

// 4000 resamples drawn from random_seed.
SampleSummary Summarize(std::span<const double> values, std::uint64_t random_seed = 1);

// Wilcoxon's signed-rank test of paired differences, two-sided. Differences are rounded to 1e-9
// first; zeros are dropped (Wilcoxon 1945), ties get mean ranks.
struct WilcoxonResult {
  int n = 0;             // differences that are not zero
  double w_plus = kNaN;  // sum of ranks of the positive ones
  double p = kNaN;       // exact for n <= 25 without ties, else normal with tie and continuity
                         // correction
  bool exact = false;
};
WilcoxonResult Wilcoxon(std::span<const double> differences);

// p-values adjusted for all of them being looked at (Holm 1979), in the order given.
std::vector<double> Holm(std::span<const double> p);

// Ranks from 1, smallest first; equals get their mean rank.
std::vector<double> MeanRanks(const std::vector<double>& values);

// Spearman's rank correlation: Pearson's of the mean ranks. NaN below three values and where all of
// one side are equal. Throws InputError where there are not as many of one side as of the other.
double Spearman(const std::vector<double>& a, const std::vector<double>& b);

// values[subject][treatment]; lower is better. Ranks within each subject, ties get mean ranks
// (values rounded to 1e-9 first).
struct FriedmanResult {
  int subjects = 0, treatments = 0;
  std::vector<double> mean_ranks;     // one per treatment, 1 is best
  double chi2 = kNaN;                 // Friedman 1937, with correction for ties
  double f = kNaN, p = kNaN;          // Iman & Davenport 1980
  double critical_difference = kNaN;  // of mean ranks at 5 % (Nemenyi; Demsar 2006); NaN for more
                                      // than 20 treatments
};
// Throws InputError for fewer than 2 subjects or treatments, or rows of unlike length.
FriedmanResult Friedman(const std::vector<std::vector<double>>& values);

}  // namespace semblance
