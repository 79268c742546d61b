// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/report/study_ranking.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "problems/report/plain_names.h"
#include "surfaces/base/geometry.h"

namespace semblance::problems {

double MeanOverSubjects(const Treatment& treatment) {
  double sum = 0;
  for (const auto& [subject, value] : treatment.by_subject) {
    sum += value;
  }
  const auto count = static_cast<double>(treatment.by_subject.size());
  return treatment.by_subject.empty() ? kNaN : sum / count;
}

std::vector<Treatment> RankTreatments(const StudyResults& results) {
  std::vector<Treatment> treatments = Treatments(results, results.metric);
  const auto cost = [&](const Treatment& treatment) {
    double sum = 0;
    for (const auto& [subject, value] : treatment.by_subject) {
      sum += results.preference.RankingCost(value);
    }
    return sum / static_cast<double>(treatment.by_subject.size());  // NaN without one
  };
  std::ranges::stable_sort(treatments, [&](const Treatment& a, const Treatment& b) {
    const double x = cost(a), y = cost(b);
    return std::isfinite(x) && (!std::isfinite(y) || x < y);
  });
  return treatments;
}

std::string RankingOrderText(const Preference& preference) {
  return preference.better == Better::kLower ? "best mean first"
         : preference.better == Better::kHigher
             ? "best mean first (higher is better)"
             : fmt::format("best first ({}: by the mean distance from it)", preference.ToPhrase());
}

double MeanSeconds(const StudyResults& results, const Treatment& treatment) {
  double sum = 0;
  int count = 0;
  for (const std::size_t n : treatment.trials) {
    if (std::isfinite(results.trials[n].wall_s)) {
      sum += results.trials[n].wall_s;
      ++count;
    }
  }
  return count > 0 ? sum / count : kNaN;
}

std::string LabelPartsText(const StudyResults& results) {
  const bool has_titles = std::ranges::find(results.axes, "title") != results.axes.end();
  return results.axes.empty() || has_titles
             ? std::string()
             : fmt::format("; named by {}", fmt::join(results.axes, ", "));
}

std::string RankingText(const StudyResults& results) {
  constexpr std::size_t kLines = 20;
  std::vector<Treatment> ranked = RankTreatments(results);
  std::erase_if(ranked, [](const Treatment& t) { return t.by_subject.empty(); });
  if (ranked.empty()) {
    return {};
  }
  std::string text = fmt::format("{}, {}{}:\n", WordsOfMetric(results.metric),
                                 RankingOrderText(results.preference), LabelPartsText(results));
  for (std::size_t n = 0; n < std::min(ranked.size(), kLines); ++n) {
    const double seconds = MeanSeconds(results, ranked[n]);
    const auto subjects = static_cast<long long>(ranked[n].by_subject.size());
    text += fmt::format(
        "{:>4}  {:>10.4g}  {}{}{}  {}\n", n + 1, MeanOverSubjects(ranked[n]),
        Counted(subjects, "subject"),
        ranked[n].unusable > 0 ? fmt::format(", {} not usable", ranked[n].unusable) : "",
        std::isfinite(seconds) ? fmt::format(", {:.1f} s", seconds) : "", ranked[n].label);
  }
  if (ranked.size() > kLines) {
    text += fmt::format("      and {} more in summary.csv\n", ranked.size() - kLines);
  }
  return text;
}

}  // namespace semblance::problems
