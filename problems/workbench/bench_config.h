// SPDX-License-Identifier: GPL-3.0-or-later
// From the file that a workbench began with and a person's decisions to the experiment that
// `semblance run` takes.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "problems/config/config_tree.h"
#include "problems/pipeline/experiment.h"
#include "problems/workbench/bench_state.h"

namespace semblance {

// start: the resolved configuration that the workbench began with. Paths in settings are relative
// to `folder`, which also holds landmarks.yaml and edits.yaml; each counts where the state has any.
// Throws ConfigError with all that is wrong.
Experiment ExperimentOf(std::string_view start, const std::filesystem::path& folder,
                        const BenchState& state);

// Only what differs from the defaults, with the paths in `folder` relative to it: the folder may be
// moved. Reading it in the folder gives the same experiment.
std::string ShortConfig(const Experiment& experiment, const std::filesystem::path& folder);

// All options, with the paths in `folder` relative to it: for a state to start from.
std::string StartConfig(const Experiment& experiment, const std::filesystem::path& folder);

// Texts of the tree that are paths in `folder` become relative to it.
void MakeRelative(ConfigNode& tree, const std::filesystem::path& folder);

// {path of an option: value} as one JSON object in the form of the schema's defaults.
std::string ExperimentJson(const Experiment& experiment);

}  // namespace semblance
