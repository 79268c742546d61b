// SPDX-License-Identifier: GPL-3.0-or-later
// Alternatives of a run (Experiment::alternatives): the same skull with other options.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "problems/config/config_tree.h"
#include "problems/experiment/input_files.h"
#include "problems/experiment/stage_cache.h"
#include "problems/io/output_folder.h"
#include "problems/run.h"

namespace semblance::problems {

struct NamedExperiment {
  std::string name;
  Experiment experiment;  // without alternatives of its own
};

// The experiments of all alternatives. Relative paths in the settings of alternatives start at
// `folder`, the folder of the configuration (empty: the working folder). `tree` is the
// configuration as read, which gives faults their lines. Throws ConfigError with a line for each
// fault of each alternative: a name that appears twice or cannot name a folder, a setting that does
// not exist, another skull.
std::vector<NamedExperiment> MakeAlternatives(const Experiment& experiment,
                                              const std::filesystem::path& folder,
                                              const ConfigNode& tree);

// Checks the inputs of the alternatives. Returns the findings that `own`, the findings of the
// experiment itself, does not hold. Each line names its alternative.
CheckFindings CheckAlternatives(const std::vector<NamedExperiment>& named, const CheckFindings& own,
                                InputCheck& inputs);

// Runs each alternative of `named` (from MakeAlternatives) and writes it into alternatives/NAME
// below the folder, as WriteRun does. Stages that an alternative shares with the run come from
// `cache`. Then writes for the report of the run, with the run's own answer first and all pictures
// under one camera:
// - alternatives.json: the changed options, the errors if the truth is known, how far each face
// lies
//   outside the run's own, the landmarks and the run's own sites that have no dowel, and notes;
// - pictures/alternatives_front.png, _three_quarter.png, _side.png and _difference.png.
// With `report: false` no pictures. Does nothing without alternatives. Returns the faults of
// unusable alternatives. Throws as Run.
std::vector<std::string> RunAlternatives(const Experiment& experiment,
                                         const std::vector<NamedExperiment>& named,
                                         const RunResult& own, StageCache& cache,
                                         OutputFolder& folder, const RunContext& context);

}  // namespace semblance::problems
