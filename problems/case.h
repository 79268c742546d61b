// SPDX-License-Identifier: GPL-3.0-or-later
// A subject made ready for reconstruction: DESIGN's Case{skull, dowels, network, truth?}.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "interp/dowel_network.h"
#include "problems/experiment.h"

namespace semblance {

struct Case {
  std::string name;
  TriMesh skull;                   // mm, outward
  std::optional<TriMesh> skin;     // the true skin, in the skull's frame, where it is known
  std::vector<Dowel> dowels;       // with depths
  DowelNetwork network;            // of those dowels
  std::vector<std::string> notes;  // what a reader of the result should know, a line each
  std::vector<std::filesystem::path> inputs;  // files that were read, for the manifest
};

// Reads or makes the subject, checks its meshes, places the dowels on the bone and gives them their
// depths. Throws InputError, IoError or ConfigError with one clear line for what cannot be used.
Case LoadCase(const Experiment& experiment, const RunContext& context);

}  // namespace semblance
