// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/search_run.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "problems/search/searcher.h"
#include "problems/study/study_metrics.h"
#include "problems/study/trial_folder.h"
#include "surfaces/base/geometry.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// The number at a dotted path of a trial's result; NaN where there is none.
double MetricIn(const Json& trial, std::string metric) {
  std::ranges::replace(metric, '.', '/');
  const Json::json_pointer path("/result/" + metric);
  return trial.value("status", "") == "done" && trial.contains(path) && trial[path].is_number()
             ? trial[path].get<double>()
             : kNaN;
}

class SearchRun {
 public:
  SearchRun(StudyPlan& plan, const fs::path& folder, const TrialRunner& run)
      : plan_(plan), search_(*plan.search), folder_(folder), run_(run) {
    for (const StudyTrial& trial : plan.trials) {
      ids_.insert(trial.id);
    }
  }

  bool Run() {
    run_(0);
    Searcher searcher(
        search_.options.method, search_.space,
        {.full_runs = search_.options.budget, .random_seed = search_.options.random_seed});
    for (int generation = 0;; ++generation) {
      const std::vector<SearchAsk> asks = searcher.Ask();
      if (asks.empty()) {
        break;
      }
      const std::size_t first_trial = plan_.trials.size(), first_step = plan_.steps.size();
      AddSteps(asks, generation);
      run_(first_trial);
      if (!ReadCosts(first_step)) {
        return false;
      }
      searcher.Tell({costs_.begin() + static_cast<std::ptrdiff_t>(first_step), costs_.end()});
    }
    return RunHeldOut();
  }

 private:
  void AddSteps(const std::vector<SearchAsk>& asks, int generation) {
    const std::vector<double> rungs = Searcher::CostsOfRungs(search_.options.method);
    TrialFaults faults;
    for (const SearchAsk& ask : asks) {
      SearchStep step{.generation = generation,
                      .cost = rungs[static_cast<std::size_t>(ask.rung)],
                      .values = {},
                      .trials = {}};
      for (StudyTrial& trial : TrialsAt(search_, ask, search_.subjects, faults)) {
        step.values = trial.values;
        step.trials.push_back(AddTrial(std::move(trial)));
      }
      plan_.steps.push_back(std::move(step));
      asks_.push_back(ask);
    }
    faults.ThrowIfAny();
  }

  std::string AddTrial(StudyTrial trial) {
    trial.id = TrialId(trial.experiment, plan_.common, hash_);
    std::string id = trial.id;
    if (ids_.insert(id).second) {
      plan_.trials.push_back(std::move(trial));
    }
    return id;
  }

  // Of the steps from there on; false if a trial is not there.
  bool ReadCosts(std::size_t first_step) {
    const Preference preference = PreferenceFor(plan_.metric, search_.options.better);
    for (std::size_t n = first_step; n < plan_.steps.size(); ++n) {
      double sum = 0;
      for (const std::string& id : plan_.steps[n].trials) {
        const std::optional<Json> trial = ReadTrialFile(folder_, id);
        if (!trial) {
          return false;
        }
        sum += preference.CostOf(MetricIn(*trial, plan_.metric));
      }
      costs_.push_back(sum / static_cast<double>(plan_.steps[n].trials.size()));
      const bool is_full = plan_.steps[n].cost == 1;
      if (is_full && std::isfinite(costs_.back()) && (best_ < 0 || costs_[n] < costs_[Best()])) {
        best_ = static_cast<int>(n);
      }
    }
    return true;
  }

  bool RunHeldOut() {
    const std::size_t first = plan_.trials.size();
    TrialFaults faults;
    if (best_ >= 0) {
      for (StudyTrial& trial : TrialsAt(search_, asks_[Best()], search_.held_out, faults)) {
        trial.aside = true;
        AddTrial(std::move(trial));
      }
    }
    faults.ThrowIfAny();
    run_(first);
    plan_.best_step = best_;
    plan_.search_ended = std::ranges::all_of(plan_.trials, [&](const StudyTrial& trial) {
      return ReadTrialFile(folder_, trial.id).has_value();
    });
    return plan_.search_ended;
  }

  std::size_t Best() const { return static_cast<std::size_t>(best_); }

  StudyPlan& plan_;
  const SearchPlan& search_;
  const fs::path& folder_;
  const TrialRunner& run_;
  ExperimentHash hash_;
  std::set<std::string> ids_;
  std::vector<SearchAsk> asks_;  // of the steps
  std::vector<double> costs_;    // of the steps, less is better
  int best_ = -1;                // of the steps in full
};

}  // namespace

bool RunSearch(StudyPlan& plan, const fs::path& folder, const TrialRunner& run) {
  return SearchRun(plan, folder, run).Run();
}

}  // namespace semblance
