// SPDX-License-Identifier: GPL-3.0-or-later
// The numbers that a trial can have, known before any trial has run.
#pragma once

#include <array>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "problems/study/study_file.h"

namespace semblance::problems {

// Returns "" if a trial of the job can have the metric, else a complaint with the nearest name.
std::string ComplaintAboutMetric(const std::string& metric, StudyJob job);

// Returns true if the metric compares with the true skin, so that a subject without one lacks it.
bool NeedsTrueSkin(const std::string& metric);

// The better values of a metric: those at one end, or those nearest to a target.
enum class Better { kLower, kHigher, kNearest };
constexpr auto EnumNames(Better) {
  return std::to_array<std::string_view>({"lower", "higher", "nearest"});
}

// Decides by the name of the metric: higher for shares within a distance (face.within_2_5mm),
// nearest for signed errors (mean_signed_mm, bias_mm, the error of a left-out site) and for
// coverage_50, _90 and _95, lower for all others.
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
