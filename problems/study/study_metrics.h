// SPDX-License-Identifier: GPL-3.0-or-later
// The numbers that a trial can have, known before any trial has run.
#pragma once

#include <array>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "problems/study/named_numbers.h"
#include "problems/study/study_file.h"
#include "problems/study/study_plugins.h"

namespace semblance::problems {

// Returns "" if a trial of the job can have the metric, else a complaint with the nearest name. A
// metric is a number of result.json, one of `own`, or an expression over these
// (config/number_expression.h).
std::string ComplaintAboutMetric(const std::string& metric, StudyJob job,
                                 std::span<const OwnMetric> own = {});

// Throws InputError if the name of a metric is not a plain word, occurs twice, or is the name of a
// member of result.json.
void CheckMetricNames(std::span<const OwnMetric> own, StudyJob job);

// Lists the metrics of a job as lines "path  unit", sorted, for people.
std::string MetricsText(StudyJob job);

// Returns true if the metric is an expression rather than the path of a number.
bool IsExpression(const std::string& metric);

// Computes the metric from the numbers of a trial, by dotted path. NaN if it lacks one of them.
double ComputeMetric(const NamedNumbers& numbers, const std::string& metric);

// Lists the numbers that the metric is computed from: itself, or those of the expression.
std::vector<std::string> ListOperands(const std::string& metric);

// Returns true if the metric compares with the true skin, so that a subject without one lacks it.
bool NeedsTrueSkin(const std::string& metric);

// The better values of a metric: those at one end, or those nearest to a target.
enum class Better { kLower, kHigher, kNearest };
constexpr auto EnumNames(Better) {
  return std::to_array<std::string_view>({"lower", "higher", "nearest"});
}

// Decides by the name of the metric: higher for shares within a distance (face.within_2_5mm),
// nearest for signed errors (mean_signed_mm, bias_mm, the error of a left-out site) and for
// coverage_50, _90 and _95, lower for all others and for expressions.
Better DefaultBetter(const std::string& metric);

// The better values of a metric, with the target of kNearest.
struct Preference {
  Better better = Better::kLower;
  double target = 0;  // only for kNearest

  // Less cost is better. The cost of a treatment is the mean over its subjects, so that errors of
  // opposite sign do not cancel.
  double RankingCost(double value) const;
  // The quantity of differences and curves: the value, or for kNearest its distance from the
  // target.
  double Compared(double value) const;
  bool IsBetter(double compared, double than) const;  // for two results of Compared
  std::string ToPhrase() const;                       // "nearest to 0.9 is better"
  std::string TargetSuffix()
      const;  // suffix to the metric: ", distance from 0.9", or "" unless kNearest
};

// Takes `given` (the user's choice) or the default of the metric. The target is that of the metric:
// the stated share of a coverage, else 0.
Preference PreferenceFor(const std::string& metric, std::optional<Better> given = std::nullopt);

}  // namespace semblance::problems
