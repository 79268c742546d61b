// SPDX-License-Identifier: GPL-3.0-or-later
// The head on the workbench: its meshes in mm and LPS. Meshes with faults are loaded too, because a
// person finds the right frame and unit by looking at them.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "problems/app/workbench/bench_state.h"
#include "problems/experiment/experiment.h"
#include "problems/subject/propose/suggestion_check.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {

struct BenchMesh {
  TriMesh mesh;  // in full
  TriMesh view;  // decimated, for display
};

struct BenchSubject {
  BenchMesh skull;                // with the mandible as it lies, if that is a separate mesh
  std::optional<BenchMesh> skin;  // if known
  std::shared_ptr<const MeshQuery> bone;       // of skull.mesh; null without a skull
  std::shared_ptr<const SurfaceEnds> ends;     // of skull.mesh; null without a skull
  std::shared_ptr<const MeshQuery> view_bone;  // of skull.view; null without a skull
  std::vector<std::string> faults;             // reasons why a run would refuse the meshes
  std::vector<std::string> notes;
};

// The subject with the axes that its meshes state, or LPS, in words, so that people see and correct
// them; unchanged if it has axes already or the meshes differ. Throws IoError if a mesh cannot be
// read.
FileSubject WithStatedAxes(FileSubject files);

// The mesh without the piece (component) of the triangle. Throws InputError if the piece has more
// than half of the mesh's area, because it is the skull itself then.
TriMesh WithoutPiece(const TriMesh& mesh, int triangle);

// The mesh without the triangles that have a corner within the radius, 0.5 to 30 mm. Throws
// InputError for another radius.
TriMesh WithoutBall(const TriMesh& mesh, const Vec3& centre, double radius_mm);

// Throws IoError or InputError if a file cannot be read at all.
BenchSubject LoadBenchSubject(const FileSubject& files, const RunContext& context);

// Converts any subject to files. Phantoms and volumes are written as meshes to the new folder
// `meshes`. The subject's landmarks move into `state`. `notes` receives remarks on reading a
// volume. Throws as LoadSubject does.
FileSubject SubjectAsFiles(const Subject& subject, const std::filesystem::path& meshes,
                           BenchState& state, const RunContext& context,
                           std::vector<std::string>& notes);

// The first state of a workbench.
struct BenchBeginning {
  Experiment experiment;  // its subject is a FileSubject
  BenchState state;
  std::vector<std::string> notes;  // remarks on reading a volume
};

// Reads a configuration with its subject, landmarks and edits. meshes: as in SubjectAsFiles. Throws
// ConfigError, and as LoadSubject does.
BenchBeginning BeginFromConfig(const std::filesystem::path& config,
                               const std::filesystem::path& meshes, const RunContext& context);

// source: empty (no head yet), a mesh of a skull, a volume (CT), or a configuration. Phantoms and
// volumes become meshes in folder/subject; landmarks move into the state. Throws as LoadSubject
// does.
BenchBeginning BeginBench(const std::filesystem::path& source, const std::filesystem::path& folder,
                          const RunContext& context);

}  // namespace semblance::problems
