// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study_report/study_charts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "problems/config/value_filter.h"
#include "problems/plots/axis_plot.h"
#include "problems/plots/heat_map.h"
#include "problems/report/plain_names.h"
#include "problems/study_report/study_ranking.h"
#include "surfaces/base/geometry.h"

namespace semblance {
namespace {

bool IsNumeric(const std::vector<Treatment>& treatments, std::size_t axis) {
  std::set<double> values;
  for (const Treatment& treatment : treatments) {
    const auto value = NumberIn(treatment.values[axis]);
    if (!value) {
      return false;
    }
    values.insert(*value);
  }
  return values.size() > 1;
}

// What the treatments have in common beside the axis.
std::string LabelWithout(const StudyResults& results, const Treatment& treatment,
                         std::size_t axis) {
  std::vector<std::string> axes = results.axes, values = treatment.values;
  axes.erase(axes.begin() + static_cast<long>(axis));
  values.erase(values.begin() + static_cast<long>(axis));
  return axes.empty() ? "all" : TreatmentLabel(axes, values);
}

std::vector<AxisLine> LinesAlong(const StudyResults& results, const std::vector<Treatment>& ranked,
                                 std::size_t axis) {
  std::vector<AxisLine> lines;
  std::map<std::string, std::size_t> index;
  for (const Treatment& treatment : ranked) {
    const double mean = MeanOf(treatment);
    if (!std::isfinite(mean)) {
      continue;
    }
    const std::string label = LabelWithout(results, treatment, axis);
    const auto [at, is_new] = index.try_emplace(label, lines.size());
    if (is_new) {
      lines.push_back({label, {}});
    }
    lines[at->second].points.push_back({*NumberIn(treatment.values[axis]), mean,
                                        fmt::format("{}: {:.6g}", treatment.label, mean)});
  }
  return lines;
}

std::vector<std::string> SubjectsOf(const StudyResults& results) {
  std::vector<std::string> subjects;
  for (const TrialRow& row : results.trials) {
    if (std::ranges::find(subjects, row.subject) == subjects.end()) {
      subjects.push_back(row.subject);
    }
  }
  return subjects;
}

std::string LinkTo(const StudyResults& results, const Treatment& treatment,
                   const std::string& subject) {
  for (const std::size_t n : treatment.trials) {
    if (results.trials[n].subject == subject) {
      return "#" + TrialAnchor(results.trials[n]);
    }
  }
  return "";
}

}  // namespace

std::string TrialAnchor(const TrialRow& row) { return "t-" + row.id; }

std::vector<ReportImage> AxisPlots(const StudyResults& results,
                                   const std::vector<Treatment>& ranked) {
  std::vector<ReportImage> plots;
  for (std::size_t axis = 0; axis < results.axes.size(); ++axis) {
    if (!IsNumeric(ranked, axis)) {
      continue;
    }
    const std::vector<AxisLine> lines = LinesAlong(results, ranked, axis);
    if (!lines.empty()) {
      plots.push_back({AxisPlotSvg(lines, results.axes[axis], WordsOfMetric(results.metric)),
                       fmt::format("Mean over subjects along {}.", results.axes[axis]),
                       fmt::format("the metric against {}", results.axes[axis])});
    }
  }
  return plots;
}

std::vector<ReportImage> SubjectMap(const StudyResults& results,
                                    const std::vector<Treatment>& ranked) {
  constexpr std::size_t kMost = 40;
  std::vector<std::string> subjects = SubjectsOf(results);
  if (subjects.size() < 2 || ranked.size() < 2) {
    return {};
  }
  const std::size_t rows = std::min(ranked.size(), kMost);
  const bool is_cut = ranked.size() > kMost || subjects.size() > kMost;
  subjects.resize(std::min(subjects.size(), kMost));
  HeatMap map{
      .rows = {}, .columns = subjects, .values = {}, .title = WordsOfMetric(results.metric)};
  for (std::size_t r = 0; r < rows; ++r) {
    map.rows.push_back(ranked[r].label);
    map.values.emplace_back();
    map.links.emplace_back();
    for (const std::string& subject : subjects) {
      const auto value = ranked[r].by_subject.find(subject);
      map.values.back().push_back(value == ranked[r].by_subject.end() ? kNaN : value->second);
      map.links.back().push_back(LinkTo(results, ranked[r], subject));
    }
  }
  return {{HeatMapSvg(map),
           fmt::format("Best treatment first. A cell leads to its trial.{}",
                       is_cut ? " Only the first 40 treatments and subjects are drawn." : ""),
           "the metric of each subject under each treatment, as colours"}};
}

}  // namespace semblance
