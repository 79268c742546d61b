// SPDX-License-Identifier: GPL-3.0-or-later
// The files that an experiment reads.
#pragma once

#include <filesystem>
#include <vector>

#include "problems/config/named_files.h"
#include "problems/pipeline/experiment.h"

namespace semblance {

// With the option that names each, in the order of the options. A table that no depth is taken from
// (`depths: measured`) is not among them.
std::vector<NamedFile> NamedInputsOf(const Experiment& experiment);

// The same, the files alone.
std::vector<std::filesystem::path> InputFilesOf(const Experiment& experiment);

}  // namespace semblance
