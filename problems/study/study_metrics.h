// SPDX-License-Identifier: GPL-3.0-or-later
// The numbers that a trial can have, known before any has run.
#pragma once

#include <array>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "problems/study/study_file.h"

namespace semblance {

// By dotted path, as in trials.csv. What is there for each landmark, feature and left-out site is
// left out: which there are, a subject decides.
std::set<std::string> MetricsOf(StudyJob job);

// What is wrong with it, and what may be meant; empty where a trial of the job can have the metric.
std::string ComplaintAboutMetric(const std::string& metric, StudyJob job);

// Whether the metric measures against the true skin, so that a subject without one has no such
// number.
bool NeedsTrueSkin(const std::string& metric);

enum class Better { kLower, kHigher, kNearest };
constexpr auto EnumNames(Better) {
  return std::to_array<std::string_view>({"lower", "higher", "nearest"});
}

// Which of its values are better: higher of shares within a distance, as face.within_2_5mm; nearest
// to 0 of signed errors (mean_signed_mm, bias_mm, a site's when it was left out), to the share that
// is stated of coverage_50, _90 and _95; of all others lower.
Better BetterOf(const std::string& metric);

// The same with what is meant by nearest.
struct Preference {
  Better better = Better::kLower;
  double target = 0;  // of kNearest

  // Of which less is better. A treatment's is the mean over its subjects: errors of either sign do
  // not make up for each other.
  double CostOf(double value) const;
  // What differences and curves are of: the value; of kNearest its distance from the target.
  double Compared(double value) const;
  bool IsBetter(double compared, double than) const;  // of two such
  std::string InWords() const;                        // "nearest to 0.9 is better"
  std::string OfWhat() const;  // behind the metric: ", distance from 0.9"; "" of the others
};

// said: by the user; then the target is still the metric's own, 0 of most.
Preference PreferenceFor(const std::string& metric, std::optional<Better> said = std::nullopt);

}  // namespace semblance
