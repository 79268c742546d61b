// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/workbench/bench_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <system_error>

#include "problems/config/config_tree.h"
#include "problems/landmark_files/read_landmarks.h"
#include "problems/pipeline/experiment_config.h"
#include "problems/workbench/bench_assets.h"
#include "problems/workbench/bench_config.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHistory = "workbench.yaml";
constexpr const char* kStart = "start.yaml";
constexpr const char* kClaim = ".semblance-workbench";

fs::path Made(const fs::path& root) {
  std::error_code error;
  fs::create_directories(root, error);
  if (error) {
    throw IoError(fmt::format("{}: the folder cannot be created: {}; choose another one",
                              root.string(), error.message()));
  }
  return fs::canonical(root);
}

// Replaced where it differs, removed where there is nothing to say.
void WriteOrRemove(const fs::path& path, const std::string& text) {
  if (text.empty()) {
    fs::remove(path);
  } else if (!fs::exists(path) || ReadFileBytes(path) != text) {
    WriteFileAtomically(path, text);
  }
}

}  // namespace

std::string LandmarksText(const BenchState& state) {
  return state.landmarks.empty() ? "" : EncodeLandmarks(LandmarksOf(state), "landmarks.yaml");
}

std::string EditsText(const BenchState& state) {
  return state.edits.edits.empty() && state.edits.resets.empty() ? "" : WriteConfig(state.edits);
}

fs::path FreePath(const fs::path& wanted) {
  fs::path path = wanted;
  for (int n = 2; fs::exists(path); ++n) {
    path.replace_filename(
        fmt::format("{}-{}{}", wanted.stem().string(), n, wanted.extension().string()));
  }
  return path;
}

BenchFolder::BenchFolder(const fs::path& root) : root_(Made(root)) {
  claim_.Take(root_ / kClaim, root_.string());
}

bool BenchFolder::HasWork() const { return fs::exists(root_ / kHistory); }

void BenchFolder::CheckFree() const {
  // What a beginning that was cut short may have left.
  constexpr std::array<std::string_view, 6> kOwn = {kClaim,   kStart,     "subject",
                                                    "tables", "networks", "incoming"};
  for (const auto& entry : fs::directory_iterator(root_)) {
    const std::string name = entry.path().filename().string();
    if (std::ranges::find(kOwn, name) == kOwn.end()) {
      throw IoError(fmt::format(
          "{}: the folder holds other things ({}); give one that is empty or not there yet",
          root_.string(), name));
    }
  }
}

void BenchFolder::Begin(const std::string& start, const BenchState& state) {
  for (const BenchAsset& file : StarterFiles()) {
    const fs::path path = root_ / file.name;
    fs::create_directories(path.parent_path());
    if (!fs::exists(path)) {
      WriteFileAtomically(path, file.text);
    }
  }
  WriteFileAtomically(root_ / kStart, start);
  Write(BeginHistory(state), ExperimentOf(state));
}

std::string BenchFolder::AddStart(const std::string& text) const {
  const fs::path path = FreePath(root_ / kStart);
  WriteFileAtomically(path, text);
  return path.filename().string();
}

BenchHistory BenchFolder::Read() const {
  const fs::path path = root_ / kHistory;
  return HistoryFromText(ReadFileBytes(path), path.string());
}

void BenchFolder::Write(const BenchHistory& history, const Experiment& experiment) const {
  const BenchState& state = Now(history);
  const std::string text = HistoryText(history);
  if (text.size() > kLargestConfig_bytes) {
    throw InputError(
        fmt::format("{}: the work and its last {} steps would take {} MB, more than could be read "
                    "again; shorten the notes",
                    kHistory, history.steps.size(), text.size() / 1'000'000));
  }
  WriteFileAtomically(root_ / kHistory, text);
  WriteOrRemove(root_ / "landmarks.yaml", LandmarksText(state));
  WriteOrRemove(root_ / "edits.yaml", EditsText(state));
  WriteOrRemove(root_ / "config.yaml", ShortConfig(experiment, root_));
}

Experiment BenchFolder::ExperimentOf(const BenchState& state) const {
  if (state.start != fs::path(state.start).filename()) {
    throw IoError(fmt::format("{}: start: '{}' is not a file of the folder",
                              (root_ / kHistory).string(), state.start));
  }
  return semblance::ExperimentOf(ReadFileBytes(root_ / state.start), root_, state);
}

Experiment BenchFolder::ExperimentAsSaved() const {
  return ReadConfig<Experiment>(root_ / "config.yaml");
}

}  // namespace semblance
