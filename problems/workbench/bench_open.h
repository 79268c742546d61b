// SPDX-License-Identifier: GPL-3.0-or-later
// Opening what a person brings to a workbench that is at work: a mesh, a volume, a configuration,
// landmarks.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "problems/pipeline/experiment.h"
#include "problems/workbench/bench_folder.h"
#include "surfaces/base/run_context.h"

namespace semblance {

enum class BroughtKind { kMesh, kVolume, kConfig, kLandmarks };
constexpr auto EnumNames(BroughtKind) {
  return std::to_array<std::string_view>({"mesh", "volume", "config", "landmarks"});
}

struct Brought {
  BroughtKind kind = BroughtKind::kMesh;
  std::filesystem::path path;  // what is opened: of files brought together, the one that counts
};

// What a file or a folder is, by its name and its first bytes. Of a folder: the one configuration
// in it, else the one file in it that can be opened, else the slices of a volume. Throws IoError or
// InputError with one line that says what can be opened instead.
Brought LookAtBrought(const std::filesystem::path& path);

// As what it is taken.
enum class OpenAs {
  kHead,       // a mesh of a skull, a CT, a configuration: another head, in place of this one
  kSkull,      // a mesh: of this head, its landmarks stay
  kSkin,       // a mesh, or the skin in a volume, in the frame of this head's skull
  kOptions,    // a configuration's options, for this head
  kLandmarks,  // in place of those that are there
};
constexpr auto EnumNames(OpenAs) {
  return std::to_array<std::string_view>({"head", "skull", "skin", "options", "landmarks"});
}

// What can be made of that kind; the first is the usual one.
std::vector<OpenAs> WaysToOpen(BroughtKind kind);

struct OpenRequest {
  std::filesystem::path path;
  OpenAs as = OpenAs::kHead;
  CtSubject volume;          // how a volume is read; its path counts not
  std::optional<Axes> axes;  // of landmarks whose file does not say
};

// What an opening starts from.
struct OpenBase {
  const BenchFolder& folder;
  const BenchState& state;
  const Experiment& experiment;  // of that state
};

struct Opened {
  std::string what;                // for the history
  BenchState state;                // after it
  std::vector<std::string> notes;  // what people should know of how it was read
};

// Reads what was brought and hands the new state to `take`. Files that the state needs are put into
// the folder under names that are free; they are gone again if anything throws, `take` too. What
// the browser had sent is forgotten once it is opened. Throws as ReadVolume, ImportCt, ReadConfig,
// ReadLandmarks and `take`; InputError for a kind that cannot be taken so.
void OpenBrought(const OpenRequest& request, const OpenBase& base, const RunContext& context,
                 const std::function<void(Opened)>& take);

}  // namespace semblance
