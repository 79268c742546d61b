// SPDX-License-Identifier: GPL-3.0-or-later
// The files that an experiment reads.
#pragma once

#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include "problems/config/config_binder.h"
#include "problems/output/given_files.h"
#include "problems/pipeline/experiment.h"

namespace semblance {

// With the option that names each, in the order of the options. A table that no depth is taken from
// (`depths: measured`) is not among them.
std::vector<NamedFile> NamedInputsOf(const Experiment& experiment);

// The same, the files alone.
std::vector<std::filesystem::path> InputFilesOf(const Experiment& experiment);

// What a job of the experiment must not replace: its configuration and these. outputs: what the job
// may write; they are referred to.
GivenFiles GivenTo(const Experiment& experiment, const std::filesystem::path& config,
                   std::span<const std::string_view> outputs);

}  // namespace semblance
