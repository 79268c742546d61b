// SPDX-License-Identifier: GPL-3.0-or-later
// Converts the file that a workbench began with and a person's decisions to the experiment that
// `semblance run` takes.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "problems/app/workbench/bench_state.h"
#include "problems/config/config_tree.h"
#include "problems/experiment/experiment.h"

namespace semblance::problems {

// start: text of the resolved configuration that the workbench began with. Paths in settings are
// relative to `folder`. If the state has landmarks or edits, the experiment names the folder's
// landmarks.yaml or edits.yaml. Throws ConfigError with all faults.
Experiment MakeExperiment(std::string_view start, const std::filesystem::path& folder,
                          const BenchState& state);

// The options that differ from the defaults. Paths inside `folder` are relative to it, so that the
// folder may be moved. Reading the text in the folder gives the same experiment.
std::string ShortConfig(const Experiment& experiment, const std::filesystem::path& folder);

// All options, as a file for a state to start from. Paths as in ShortConfig.
std::string StartConfig(const Experiment& experiment, const std::filesystem::path& folder);

// Makes the paths inside `folder` relative to it.
void MakeRelative(ConfigNode& tree, const std::filesystem::path& folder);

// {path of an option: value} as one JSON object in the form of the schema's defaults.
std::string ExperimentJson(const Experiment& experiment);

}  // namespace semblance::problems
