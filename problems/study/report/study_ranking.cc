// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/report/study_ranking.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>
#include <set>

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

namespace {

// Finds the treatments that have enough subjects to take part in the comparison.
std::vector<bool> FindParts(const std::vector<Treatment>& treatments) {
  std::size_t most = 0;
  for (const Treatment& treatment : treatments) {
    most = std::max(most, treatment.by_subject.size());
  }
  std::vector<bool> parts;
  for (const Treatment& treatment : treatments) {
    const std::size_t count = treatment.by_subject.size();
    parts.push_back(count > 0 && 2 * count >= most);
  }
  return parts;
}

std::set<std::string> FindCommonSubjects(const std::vector<Treatment>& treatments) {
  const std::vector<bool> parts = FindParts(treatments);
  std::map<std::string, std::ptrdiff_t> count;
  for (std::size_t n = 0; n < treatments.size(); ++n) {
    if (parts[n]) {
      for (const auto& [subject, value] : treatments[n].by_subject) {
        ++count[subject];
      }
    }
  }
  std::set<std::string> common;
  for (const auto& [subject, treatments_with_it] : count) {
    if (treatments_with_it == std::ranges::count(parts, true)) {
      common.insert(subject);
    }
  }
  return common;
}

// "a, b, c and 4 more".
std::string ListNames(const std::vector<std::string>& names) {
  constexpr std::size_t kNamed = 5;
  const std::vector<std::string> first(
      names.begin(), names.begin() + static_cast<long>(std::min(names.size(), kNamed)));
  return fmt::format(
      "{}{}", fmt::join(first, ", "),
      names.size() > kNamed ? fmt::format(" and {} more", names.size() - kNamed) : std::string());
}

}  // namespace

std::vector<Treatment> RestrictToCommonSubjects(const StudyResults& results,
                                                std::vector<Treatment> treatments) {
  const std::set<std::string> common = FindCommonSubjects(treatments);
  if (common.empty()) {
    return treatments;
  }
  const std::vector<bool> parts = FindParts(treatments);
  for (std::size_t n = 0; n < treatments.size(); ++n) {
    const auto is_out = [&](const std::string& subject) {
      return !parts[n] || !common.contains(subject);
    };
    std::erase_if(treatments[n].by_subject, [&](const auto& one) { return is_out(one.first); });
    std::erase_if(treatments[n].trials,
                  [&](std::size_t trial) { return is_out(results.trials[trial].subject); });
  }
  return treatments;
}

std::string CommonSubjectsText(const std::vector<Treatment>& treatments) {
  const std::set<std::string> common = FindCommonSubjects(treatments);
  const std::vector<bool> parts = FindParts(treatments);
  std::set<std::string> all;
  std::vector<std::string> sparse;
  for (std::size_t n = 0; n < treatments.size(); ++n) {
    for (const auto& [subject, value] : treatments[n].by_subject) {
      all.insert(subject);
    }
    if (!parts[n] && !treatments[n].by_subject.empty()) {
      sparse.push_back(treatments[n].label);
    }
  }
  if (common.empty()) {
    return all.empty() ? ""
                       : "No subject has a value for all treatments, so each mean is over other "
                         "subjects. The order of the treatments is not a comparison. Run the "
                         "missing trials.";
  }
  std::vector<std::string> left_out;
  std::ranges::set_difference(all, common, std::back_inserter(left_out));
  std::string text;
  if (!left_out.empty()) {
    text = fmt::format(
        "The treatments are compared over the {} that all of them have. Not all of them have: {}.",
        Counted(std::ssize(common), "subject"), ListNames(left_out));
  }
  if (!sparse.empty()) {
    text += fmt::format("{}Not ranked, because fewer than half of the subjects have a value: {}.",
                        text.empty() ? "" : " ", ListNames(sparse));
  }
  return text;
}

std::vector<Treatment> RankTreatments(const StudyResults& results) {
  const std::vector<Treatment> treatments = Treatments(results, results.metric);
  const std::vector<Treatment> compared = RestrictToCommonSubjects(results, treatments);
  std::vector<double> cost;
  for (const Treatment& treatment : compared) {
    double sum = 0;
    for (const auto& [subject, value] : treatment.by_subject) {
      sum += results.preference.RankingCost(value);
    }
    cost.push_back(sum / static_cast<double>(treatment.by_subject.size()));  // NaN without one
  }
  std::vector<std::size_t> order(treatments.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) {
    return std::isfinite(cost[a]) && (!std::isfinite(cost[b]) || cost[a] < cost[b]);
  });
  std::vector<Treatment> ranked;
  for (const std::size_t n : order) {
    ranked.push_back(treatments[n]);
  }
  return ranked;
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
  const std::vector<Treatment> all = RankTreatments(results);
  std::vector<Treatment> ranked = RestrictToCommonSubjects(results, all);
  std::erase_if(ranked, [](const Treatment& t) { return t.by_subject.empty(); });
  const std::string missing = MissingMetricText(results);
  const std::string last = missing.empty() ? "" : missing + "\n";
  if (ranked.empty()) {
    return last;
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
  const std::string common = CommonSubjectsText(all);
  return text + (common.empty() ? "" : common + "\n") + last;
}

}  // namespace semblance::problems
