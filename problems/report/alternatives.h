// SPDX-License-Identifier: GPL-3.0-or-later
// Other answers to the same skull (Experiment::alternatives), beside a run's own.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "problems/config/config_tree.h"
#include "problems/inputs/input_files.h"
#include "problems/output/files.h"
#include "problems/pipeline/stage_cache.h"
#include "problems/run.h"

namespace semblance {

struct NamedExperiment {
  std::string name;
  Experiment experiment;  // without alternatives of its own
};

// folder: of the configuration, empty for the working folder; relative paths in what alternatives
// set start there. tree: what the experiment was read from, for the lines of faults. Throws
// ConfigError with a line for each fault of each alternative: a name that appears twice or is no
// name of a folder, a setting that is none, another skull.
std::vector<NamedExperiment> AlternativesOf(const Experiment& experiment,
                                            const std::filesystem::path& folder,
                                            const ConfigNode& tree);

// What is found of the alternatives' inputs beside `own`, which is what is found of the
// experiment's; each line names its alternative.
CheckFindings LookAtAlternatives(const std::vector<NamedExperiment>& named,
                                 const CheckFindings& own, InputCheck& inputs);

// Makes each alternative and writes it into alternatives/NAME below the folder, as WriteRun does.
// Then, for the report of the run itself: alternatives.json (what is otherwise, the errors where
// the truth is known, how far each face lies outside the run's own, which landmarks and which sites
// of the run's own dowels have no dowel, notes) and pictures/alternatives_front.png,
// _three_quarter.png, _side.png and _difference.png, the run's own first, all under one camera.
// Nothing without alternatives. What they share with the run is taken from `cache`. Returns the
// faults of those that are not usable. Throws as Run does.
// named: AlternativesOf(experiment, ...).
std::vector<std::string> RunAlternatives(const Experiment& experiment,
                                         const std::vector<NamedExperiment>& named,
                                         const RunResult& own, StageCache& cache,
                                         OutputFolder& folder, const RunContext& context);

}  // namespace semblance
