// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/search_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/pipeline/experiment_config.h"
#include "problems/search/searcher.h"

namespace semblance {
namespace {

bool IsWhole(const ConfigNode& end) { return end.text.find_first_of(".eE") == std::string::npos; }

SearchAxis AxisOf(const ConfigMap<SearchedNumber>::Entry& entry, ConfigErrors& errors) {
  const auto& [low, high, log] = entry.value;
  const std::string path = JoinPath("search.ranges", entry.key);
  SearchAxis axis{.whole = IsWhole(low) && IsWhole(high), .log = log};
  if (low.IsNull() || high.IsNull()) {
    errors.Add(entry.key_location, path, "give both ends, as in {low: 0.1, high: 1.0}");
    return axis;
  }
  const std::size_t before = errors.size();
  ReadScalar(errors, {low, JoinPath(path, "low"), FieldInfo{}}, axis.low);
  ReadScalar(errors, {high, JoinPath(path, "high"), FieldInfo{}}, axis.high);
  if (errors.size() == before && !(axis.low < axis.high)) {
    errors.Add(entry.key_location, path, "low must be lower than high");
  }
  if (errors.size() == before && axis.log && !(axis.low > 0)) {
    errors.Add(entry.key_location, path,
               "log: both ends must be above 0; raise low, or take log out");
  }
  return axis;
}

// Within the ends, however it is rounded.
std::string NumberText(const SearchAxis& axis, double value) {
  if (axis.whole) {
    return fmt::format("{:.0f}", value);
  }
  const std::string text = fmt::format("{:.6g}", value);
  const double rounded = std::stod(text);
  return rounded < axis.low || rounded > axis.high ? fmt::format("{}", value) : text;
}

StudyRow RowAt(const SearchPlan& plan, const SearchPoint& point) {
  StudyRow row;
  std::size_t k = plan.options.ranges.entries.size();
  for (const auto& choice : plan.options.choices.entries) {
    row.push_back(
        {choice.key, choice.key_location, choice.value[static_cast<std::size_t>(point[k])]});
    ++k;
  }
  k = 0;  // after the choices, so that a number that a chosen type does not have is a fault
  for (const auto& range : plan.options.ranges.entries) {
    ConfigNode value = ConfigNode::Scalar(NumberText(plan.space[k], point[k]));
    value.location = range.value.low.location;
    row.push_back({range.key, range.key_location, std::move(value)});
    ++k;
  }
  return row;
}

int Part(int whole, double share) {
  return std::max(1, static_cast<int>(std::ceil(whole * share - 1e-9)));
}

// What a plan of the fit does first: the first steps of a schedule, fewer passes, or the coarser
// levels.
struct Shortener {
  double share;
  void operator()(ListedPlan& plan) const {
    plan.schedule.resize(static_cast<std::size_t>(Part(std::ssize(plan.schedule), share)));
  }
  void operator()(UntilPlan& plan) const { plan.max_passes = Part(plan.max_passes, share); }
  void operator()(CoarseToFinePlan& plan) const { plan.finest = Part(plan.finest + 1, share) - 1; }
  void operator()(AdaptivePlan& plan) const { plan.finest = Part(plan.finest + 1, share) - 1; }
  void operator()(AutoPlan& plan) const { plan.finest = Part(plan.finest + 1, share) - 1; }
};

// What shortens the runs of a rung beside the fit; nothing of a run in full.
const ConfigMap<ConfigNode>* ShortRunOf(const SearchPlan& plan, int rung) {
  const auto* halving = std::get_if<HalvingSearch>(&plan.options.method);
  return halving && rung < static_cast<int>(halving->short_runs.size())
             ? &halving->short_runs[static_cast<std::size_t>(rung)]
             : nullptr;
}

StudyTrial TrialAt(const SearchPlan& plan, const SearchAsk& ask, const SubjectTree& subject,
                   TrialFaults& faults) {
  const std::vector<double> rungs = Searcher::CostsOfRungs(plan.options.method);
  const bool is_short = ask.rung + 1 < std::ssize(rungs);
  StudyRow row = RowAt(plan, ask.point);
  std::vector<std::string> axes = plan.axes;
  const auto* shorter = ShortRunOf(plan, ask.rung);
  if (shorter) {
    for (const auto& setting : shorter->entries) {
      row.push_back(setting);
      axes.push_back(setting.key);
    }
  }
  StudyTrial trial = MakeTrial(subject, row, axes, plan.defaults, faults);
  trial.values.resize(plan.axes.size());
  trial.aside = is_short;
  if (is_short) {
    trial.values.back() = fmt::format("{} of {}", ask.rung + 1, rungs.size());
  }
  if (is_short && !shorter) {
    std::visit(Shortener{rungs[static_cast<std::size_t>(ask.rung)]}, trial.experiment.fit.plan);
  }
  return trial;
}

}  // namespace

SearchPlan MakeSearchPlan(const StudySearch& options, const ConfigNode& tree,
                          ConfigErrors& errors) {
  SearchPlan plan{
      .options = options, .space = {}, .axes = {}, .subjects = {}, .held_out = {}, .defaults = {}};
  for (const auto& range : options.ranges.entries) {
    plan.axes.push_back(range.key);
    plan.space.push_back(AxisOf(range, errors));
  }
  for (const auto& choice : options.choices.entries) {
    if (std::ranges::find(plan.axes, choice.key) != plan.axes.end()) {
      errors.Add(LocationOf(tree, "search.choices"), JoinPath("search.choices", choice.key),
                 "stands among the ranges too; take one out");
    }
    plan.axes.push_back(choice.key);
    plan.space.push_back({.choices = static_cast<int>(choice.value.size())});
  }
  if (Searcher::CostsOfRungs(options.method).size() > 1) {
    plan.axes.push_back(kRungAxis);
  }
  return plan;
}

std::vector<StudyRow> RowsToCheck(const SearchPlan& plan) {
  SearchPoint first;
  std::vector<std::vector<double>> values;
  for (const SearchAxis& axis : plan.space) {
    values.emplace_back();
    for (int choice = 0; choice < axis.choices; ++choice) {
      values.back().push_back(choice);
    }
    if (axis.choices == 0) {
      values.back() = {axis.low, axis.high};
    }
    first.push_back(values.back().front());
  }
  std::vector<StudyRow> rows = {RowAt(plan, first)};
  for (std::size_t i = 0; i < values.size(); ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      for (const double a : values[i]) {
        for (const double b : values[j]) {
          SearchPoint point = first;
          point[j] = b;
          point[i] = a;
          rows.push_back(RowAt(plan, point));
        }
      }
    }
  }
  return rows;
}

std::string ComplaintAboutShortRuns(const SearchPlan& plan, StudyJob job,
                                    const Experiment& experiment) {
  const auto* halving = std::get_if<HalvingSearch>(&plan.options.method);
  if (!halving || !halving->short_runs.empty()) {
    return "";
  }
  if (job == StudyJob::kDepth) {
    return "halving shortens the fit, and job: depth has none; say in method.short_runs what makes "
           "a run short";
  }
  SchedulePlan shortest = experiment.fit.plan;
  std::visit(Shortener{Searcher::CostsOfRungs(plan.options.method).front()}, shortest);
  if (ToYaml(ConfigTreeOf(shortest)) == ToYaml(ConfigTreeOf(experiment.fit.plan))) {
    return "halving shortens the fit, and this one has a single step; give it a longer schedule, "
           "or say in method.short_runs what makes a run short";
  }
  return "";
}

std::vector<StudyTrial> TrialsAt(const SearchPlan& plan, const SearchAsk& ask,
                                 const std::vector<SubjectTree>& subjects, TrialFaults& faults) {
  std::vector<StudyTrial> trials;
  for (const SubjectTree& subject : subjects) {
    trials.push_back(TrialAt(plan, ask, subject, faults));
  }
  return trials;
}

}  // namespace semblance
