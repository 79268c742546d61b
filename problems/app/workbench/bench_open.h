// SPDX-License-Identifier: GPL-3.0-or-later
// Opens a file or a folder in a running workbench: a mesh, a volume, a configuration or landmarks.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "problems/app/workbench/bench_folder.h"
#include "problems/experiment/experiment.h"
#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

enum class ImportKind { kMesh, kVolume, kConfig, kLandmarks };
constexpr auto EnumNames(ImportKind) {
  return std::to_array<std::string_view>({"mesh", "volume", "config", "landmarks"});
}

struct ImportedFile {
  ImportKind kind = ImportKind::kMesh;
  std::filesystem::path path;  // the file to open; in a folder of several files, the main one
};

// Finds the kind of a file by its name and its first bytes. In a folder it picks the one
// configuration, else the one file that can be opened, else it takes the folder as the slices of a
// volume. Throws IoError or InputError with one line that lists what can be opened.
ImportedFile IdentifyImport(const std::filesystem::path& path);

// The role of an opened file.
enum class OpenAs {
  kHead,       // a mesh of a skull, a CT or a configuration: replaces the head
  kSkull,      // a mesh: replaces the skull, the landmarks stay
  kSkin,       // a mesh, or the skin in a volume, in the frame of the present skull
  kOptions,    // a configuration: its options for the present head
  kLandmarks,  // replace the present landmarks
};
constexpr auto EnumNames(OpenAs) {
  return std::to_array<std::string_view>({"head", "skull", "skin", "options", "landmarks"});
}

// The roles that a kind of file may have; the first is the default.
std::vector<OpenAs> WaysToOpen(ImportKind kind);

struct OpenRequest {
  std::filesystem::path path;
  OpenAs as = OpenAs::kHead;
  CtSubject volume;          // options for reading a volume; its path is ignored
  std::optional<Axes> axes;  // of landmarks whose file does not state them
};

// The workbench before the opening.
struct OpenBase {
  const BenchFolder& folder;
  const BenchState& state;
  const Experiment& experiment;  // of that state
};

struct Opened {
  std::string what;                // description for the history
  BenchState state;                // after the opening
  std::vector<std::string> notes;  // remarks on reading the file, for people
};

// Reads the file and passes the new state to `commit`. Files that the state needs are added to the
// folder under free names; they are removed again if anything throws, `commit` included. An upload
// of the browser is deleted once it is opened. Throws as ReadVolume, ImportCt, ReadConfig,
// ReadLandmarks and `commit`; InputError if the kind of file cannot have the requested role.
void OpenImportedFile(const OpenRequest& request, const OpenBase& base, const RunContext& context,
                      const std::function<void(Opened)>& commit);

// Passes the state with `skull` (mm, LPS) as the skull of the same head to `commit`. The mesh
// becomes a new file in the folder, which is removed again if `commit` throws. Throws InputError if
// the mandible has a file of its own.
void ReplaceSkull(const TriMesh& skull, const OpenBase& base,
                  const std::function<void(Opened)>& commit);

}  // namespace semblance::problems
