// SPDX-License-Identifier: GPL-3.0-or-later
// A search as it runs. It keeps no state of its own: each call asks for the same treatments from
// the first on and reads the values of those that are there, so that it goes on wherever it was
// stopped.
#pragma once

#include <filesystem>
#include <functional>

#include "problems/study/study_plan.h"

namespace semblance {

// Runs the plan's trials from `first` on that are not done yet; some may be another shard's.
using TrialRunner = std::function<void(std::size_t first)>;

// Generation by generation: adds the treatments to the plan, has them run, and reads from the
// folder what they gave, the mean of the metric over the subjects (a treatment with a trial that is
// not done has none). Then the best one in full on the subjects held out. A trial that is in the
// plan already is not added again. Returns whether the search has ended; if not, a trial is
// missing. Throws ConfigError if an experiment cannot be read.
bool RunSearch(StudyPlan& plan, const std::filesystem::path& folder, const TrialRunner& run);

}  // namespace semblance
