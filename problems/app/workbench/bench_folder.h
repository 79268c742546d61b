// SPDX-License-Identifier: GPL-3.0-or-later
// The folder of a workbench. It holds the whole work, so that a crash or a reload of the page loses
// nothing.
//
//   workbench.yaml   the history of states, which all else follows from; each action replaces it
//   start.yaml       the configuration that it began with; start-2.yaml ...: those opened later
//   config.yaml, landmarks.yaml, edits.yaml   input of `semblance run`; made from those two
//   subject/, tables/, networks/, features/   files that they name
//   run/             the last full run
//   variants/        full faces of other builds and depths
//   incoming/        uploads of the browser, one folder per batch, until they are opened
//   .address         the last port and token, so that a restarted server has the address of a page
//                    that is still open; only this user can read it
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "problems/app/workbench/bench_state.h"
#include "problems/experiment/experiment.h"
#include "problems/io/staged_folder.h"

namespace semblance::problems {

class BenchFolder {
 public:
  // Creates the folder if necessary and locks it against other workbenches until the process ends.
  // Throws IoError if another workbench has locked it, or if it cannot be created.
  explicit BenchFolder(const std::filesystem::path& root);

  const std::filesystem::path& Root() const { return root_; }

  // True if a workbench has worked in this folder before.
  bool HasWork() const;

  // Throws IoError if the folder holds files that no workbench made.
  void CheckFree() const;

  // Writes the first files. start: text of a resolved configuration.
  void Begin(const std::string& start, const BenchState& state);

  // Reads the history that the last workbench left. Throws IoError, ConfigError.
  BenchHistory Read() const;

  // Writes the history, then the files that follow from its current state. experiment: of the
  // current state.
  void Write(const BenchHistory& history, const Experiment& experiment) const;

  // Adds a resolved configuration to start from, next to the present ones. Returns its file name.
  std::string AddStart(const std::string& text) const;

  // Makes the experiment of any state. Throws ConfigError, IoError.
  Experiment ReadExperiment(const BenchState& state) const;

  // Reads config.yaml as `semblance run config.yaml` does. Throws ConfigError.
  Experiment ReadSavedExperiment() const;

 private:
  std::filesystem::path root_;
  FolderClaim claim_;
};

// Returns `wanted`, or "NAME-2.EXT", "NAME-3.EXT" ... if that exists, so that no file is replaced.
std::filesystem::path FreePath(const std::filesystem::path& wanted);

// The texts of landmarks.yaml and edits.yaml; empty if the state has no landmarks or edits.
std::string LandmarksText(const BenchState& state);
std::string EditsText(const BenchState& state);

// The address at which the folder's page was served last.
struct BenchAddress {
  int port = 0;       // 0: none
  std::string token;  // empty: none
};

// Reads the stored address; none if there is none, or if anyone else can read or write the file.
BenchAddress ReadAddress(const std::filesystem::path& root);

// Stores the address in a file that only this user can read. Throws IoError.
void StoreAddress(const std::filesystem::path& root, const BenchAddress& address);

// Writes a file that only this user can read, in place of an earlier one. Throws IoError.
void WriteSecret(const std::filesystem::path& file, std::string_view text);

// ---------------------------------------------------------------------------------------------
// Uploads of the browser in FOLDER/incoming
// ---------------------------------------------------------------------------------------------

// Writes a file of a batch and returns its path. name: relative path from the browser, with folders
// if a whole folder was dropped ("slices/1.dcm"). Throws IoError as WriteFileAtomically, and
// InputError for a batch or a name that could lead out of the folder or is not valid on every
// system: each part has 1 to 200 bytes of UTF-8, no control characters, no backslash and no dot in
// front.
std::filesystem::path SaveIncoming(const std::filesystem::path& root, const std::string& batch,
                                   const std::string& name, std::string_view bytes);

// Folder of a batch. Throws InputError as SaveIncoming.
std::filesystem::path IncomingBatch(const std::filesystem::path& root, const std::string& batch);

// Folder of the batch that contains `path`; empty for a path outside FOLDER/incoming.
std::filesystem::path FindBatch(const std::filesystem::path& root,
                                const std::filesystem::path& path);

// Delete one batch, or all of them. Opened files have been moved elsewhere by then.
void DropIncoming(const std::filesystem::path& root, const std::string& batch);
void DropAllIncoming(const std::filesystem::path& root);

}  // namespace semblance::problems
