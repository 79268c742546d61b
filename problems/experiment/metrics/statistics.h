// SPDX-License-Identifier: GPL-3.0-or-later
// Compares treatments over subjects. The unit is the subject: one value per subject and treatment.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance::problems {

struct Interval {
  double low = kNaN;
  double high = kNaN;
};

// All NaN without values; sd is NaN for one value.
struct SampleSummary {
  int n = 0;
  double mean = kNaN, sd = kNaN, median = kNaN, min = kNaN, max = kNaN;
  double quartile_1 = kNaN, quartile_3 = kNaN;  // by Quantile, like the median
  Interval mean_95;  // bootstrap percentiles of the mean; NaN below 3 values
};

// 4000 resamples drawn from random_seed.
SampleSummary Summarize(std::span<const double> values, std::uint64_t random_seed = 1);

// Wilcoxon's signed-rank test of paired differences, two-sided. Differences are rounded to 1e-9.
// Then zeros are dropped (Wilcoxon 1945), and ties get mean ranks.
struct WilcoxonResult {
  int n = 0;             // number of differences that are not zero
  double w_plus = kNaN;  // sum of the ranks of positive differences
  double p = kNaN;
  bool exact = false;  // for n <= 25 without ties; else p is from the normal approximation with tie
                       // and continuity correction
};
WilcoxonResult Wilcoxon(std::span<const double> differences);

// Adjusts p-values for multiple comparisons (Holm 1979), in the given order.
std::vector<double> Holm(std::span<const double> p);

// Ranks from 1, smallest first; equals get their mean rank.
std::vector<double> MeanRanks(const std::vector<double>& values);

// Spearman's rank correlation: Pearson's correlation of the mean ranks. NaN for fewer than three
// values and if all values of one side are equal. Throws InputError if the sides have different
// lengths.
double Spearman(const std::vector<double>& a, const std::vector<double>& b);

// Friedman's test of values[subject][treatment]; lower is better. Values are rounded to 1e-9 and
// ranked within each subject; ties get mean ranks.
struct FriedmanResult {
  int subjects = 0, treatments = 0;
  std::vector<double> mean_ranks;     // one per treatment, 1 is best
  double chi2 = kNaN;                 // Friedman 1937, with correction for ties
  double f = kNaN, p = kNaN;          // Iman & Davenport 1980
  double critical_difference = kNaN;  // of mean ranks at 5 % (Nemenyi; Demsar 2006); NaN for more
                                      // than 20 treatments
};
// Throws InputError for fewer than 2 subjects or treatments, or rows of different lengths.
FriedmanResult Friedman(const std::vector<std::vector<double>>& values);

}  // namespace semblance::problems
