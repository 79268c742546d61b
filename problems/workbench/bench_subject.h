// SPDX-License-Identifier: GPL-3.0-or-later
// The head on the workbench: its meshes in mm and LPS, also where they cannot be used yet, for it
// is by looking that a person finds the right frame and unit.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "problems/pipeline/experiment.h"
#include "problems/workbench/bench_state.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance {

struct BenchMesh {
  TriMesh mesh;  // all of it
  TriMesh view;  // thinned out
};

struct BenchSubject {
  BenchMesh skull;                // with the mandible, where that is a mesh of its own, as it lies
  std::optional<BenchMesh> skin;  // where it is known
  std::shared_ptr<const MeshQuery> bone;       // of the whole skull
  std::shared_ptr<const MeshQuery> view_bone;  // of the thinned-out one
  std::vector<std::string> faults;             // why a run would refuse the meshes
  std::vector<std::string> notes;
};

// Throws IoError or InputError if a file cannot be read at all.
BenchSubject LoadBenchSubject(const FileSubject& files, const RunContext& context);

// A subject of any kind as files: phantoms and volumes become meshes in the folder `meshes`, which
// is made; the subject's landmarks move into `state`; how a volume was read is told in `notes`.
// Throws as LoadSubject does.
FileSubject SubjectAsFiles(const Subject& subject, const std::filesystem::path& meshes,
                           BenchState& state, const RunContext& context,
                           std::vector<std::string>& notes);

// What a workbench begins with.
struct BenchBeginning {
  Experiment experiment;  // its subject is of files
  BenchState state;
  std::vector<std::string> notes;  // how a volume was read
};

// A configuration with its subject, landmarks and edits; meshes as above. Throws ConfigError, and
// as LoadSubject does.
BenchBeginning BeginFromConfig(const std::filesystem::path& config,
                               const std::filesystem::path& meshes, const RunContext& context);

// source: empty (nothing yet), a mesh of a skull, a volume (CT), or a configuration. Phantoms and
// volumes become meshes below folder/subject; landmarks move into the state. Throws as LoadSubject
// does.
BenchBeginning BeginBench(const std::filesystem::path& source, const std::filesystem::path& folder,
                          const RunContext& context);

}  // namespace semblance
