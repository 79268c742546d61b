// SPDX-License-Identifier: GPL-3.0-or-later
// The folder of a workbench: it holds all, so that a crash or a reload of the page loses nothing.
//
//   workbench.yaml   the states, undone ones too: the truth, replaced as a whole at each action
//   start.yaml       the configuration that it began with; start-2.yaml ...: those opened later
//   config.yaml, landmarks.yaml, edits.yaml   what `semblance run` takes; made from those two
//   subject/, tables/, networks/, features/   files that they name
//   run/             the last full run
//   variants/        full faces of other builds and depths
//   incoming/        what the browser has sent, until it is opened
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "problems/output/staged_folder.h"
#include "problems/pipeline/experiment.h"
#include "problems/workbench/bench_history.h"

namespace semblance {

class BenchFolder {
 public:
  // Makes the folder where it is not there, and holds it against other workbenches until the
  // process ends. Throws IoError if another has it, or if it cannot be made.
  explicit BenchFolder(const std::filesystem::path& root);

  const std::filesystem::path& Root() const { return root_; }

  // Whether a workbench has been here before.
  bool HasWork() const;

  // Throws IoError if the folder holds things that are no workbench's.
  void CheckFree() const;

  // The first files. start: resolved.
  void Begin(const std::string& start, const BenchState& state);

  // What the last workbench left. Throws IoError, ConfigError.
  BenchHistory Read() const;

  // Writes the history, then the files that follow from its present state. experiment: of that.
  void Write(const BenchHistory& history, const Experiment& experiment) const;

  // Adds a configuration (resolved) to start from, beside those that are there; returns its name.
  std::string AddStart(const std::string& text) const;

  // Of any state. Throws ConfigError, IoError.
  Experiment ExperimentOf(const BenchState& state) const;

  // The same as `semblance run config.yaml` reads it. Throws ConfigError.
  Experiment ExperimentAsSaved() const;

 private:
  std::filesystem::path root_;
  FolderClaim claim_;
};

// `wanted`, or where that is taken "NAME-2.EXT" and so on: no file is replaced.
std::filesystem::path FreePath(const std::filesystem::path& wanted);

// A landmark file and an edit script as the folder has them; empty where there is none.
std::string LandmarksText(const BenchState& state);
std::string EditsText(const BenchState& state);

}  // namespace semblance
