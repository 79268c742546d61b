// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/workbench/bench_subject.h"

#include <fmt/format.h>

#include <algorithm>
#include <initializer_list>
#include <set>

#include "problems/app/workbench/bench_actions.h"
#include "problems/experiment/case.h"
#include "problems/experiment/experiment_config.h"
#include "problems/io/output_folder.h"
#include "problems/io/volumes/read_volume.h"
#include "problems/report/view/view_mesh.h"
#include "problems/subject/landmark_files/read_landmarks.h"
#include "problems/subject/phantom.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/base/lower_case.h"
#include "surfaces/mesh/join_copies.h"
#include "surfaces/mesh/mesh_check.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

// Size of the shown skull, on which landmarks are clicked. Fewer triangles show less detail of the
// bone, more make the page slow. Landmarks are placed on the full mesh in any case.
constexpr int kSkullTriangles = 60000;

void AppendMesh(const TriMesh& more, TriMesh& mesh) {
  const auto first = static_cast<std::int32_t>(mesh.points.size());
  mesh.points.insert(mesh.points.end(), more.points.begin(), more.points.end());
  for (const Triangle& t : more.triangles) {
    mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
}

// Adds faults of the mesh to the subject instead of throwing, so that the page can show the mesh.
void CheckMesh(TriMesh& mesh, const fs::path& path, BenchSubject& subject) {
  std::ranges::move(JoinCopies(mesh, path.filename().string()), std::back_inserter(subject.notes));
  try {
    std::ranges::move(CheckHeadMesh(mesh, path.filename().string()),
                      std::back_inserter(subject.notes));
  } catch (const InputError& error) {
    subject.faults.emplace_back(error.what());
  }
}

void AddLandmarks(const fs::path& path, BenchState& state) {
  if (!path.empty()) {
    state = ReplaceLandmarks(std::move(state), ReadLandmarks(path).file);
  }
}

FileSubject WriteMeshes(const TriMesh& skull, const TriMesh& skin, const fs::path& folder) {
  FileSubject files;
  files.skull = folder / "skull.ply";
  files.skin = folder / "skin.ply";
  fs::create_directories(folder);
  WriteFileAtomically(files.skull, EncodeMesh(skull, ".ply"));
  WriteFileAtomically(files.skin, EncodeMesh(skin, ".ply"));
  return files;
}

FileSubject ToFiles(const FileSubject& subject, const fs::path&, BenchState& state,
                    const RunContext&, std::vector<std::string>&) {
  AddLandmarks(subject.landmarks, state);
  FileSubject files = WithStatedAxes(subject);
  files.landmarks.clear();
  return files;
}

FileSubject ToFiles(const PhantomOptions& subject, const fs::path& meshes, BenchState& state,
                    const RunContext&, std::vector<std::string>&) {
  const Phantom phantom = MakePhantom(subject);
  state = ReplaceLandmarks(std::move(state), PhantomLandmarks(phantom.sites, subject.random_seed));
  return WriteMeshes(phantom.skull, phantom.face, meshes);
}

FileSubject ToFiles(const CtSubject& subject, const fs::path& meshes, BenchState& state,
                    const RunContext& context, std::vector<std::string>& notes) {
  const VolumeReading reading = ReadVolume(subject.volume, subject.read, context);
  if (reading.modality == Modality::kMr) {
    throw InputError(fmt::format(
        "{}: an MR shows no bone, and the workbench needs a skull; give a CT or a mesh of "
        "the skull first, and open the MR as its skin afterwards",
        subject.volume.string()));
  }
  const CtImport import = ImportCt(reading.volume, subject.import, context);
  notes = reading.notes;
  notes.insert(notes.end(), import.notes.begin(), import.notes.end());
  AddLandmarks(subject.landmarks, state);
  FileSubject files = WriteMeshes(import.skull, import.skin, meshes);
  files.mirror = subject.mirror;
  return files;
}

std::string LowerExtension(const fs::path& path) { return LowerCase(path.extension().string()); }

bool IsAnyOf(const std::string& extension, std::initializer_list<const char*> extensions) {
  return std::ranges::find(extensions, extension) != extensions.end();
}

// The experiment of a workbench that begins without a configuration.
Experiment DefaultExperiment(const fs::path& folder) {
  Experiment experiment;
  experiment.title = "Facial approximation";  // the page asks for the person of such a case
  experiment.tissue.table = folder / "tables/rhine_caucasoid.yaml";
  experiment.network = folder / "networks/standard32.yaml";
  return experiment;
}

Subject SubjectFromSource(const fs::path& source) {
  FileSubject files;
  if (source.empty()) {
    return files;
  }
  if (IsAnyOf(LowerExtension(source), {".ply", ".obj", ".stl", ".off"})) {
    files.skull = fs::absolute(source);
    return WithStatedAxes(files);
  }
  CtSubject ct;
  ct.volume = fs::absolute(source);
  return ct;
}

}  // namespace

FileSubject WithStatedAxes(FileSubject files) {
  std::set<Axes> stated;
  for (const fs::path& mesh : {files.skull, files.skin, files.mandible.mesh}) {
    if (!mesh.empty()) {
      stated.insert(ReadStatedAxes(mesh) == MeshAxes::kRas ? Axes::kRas : Axes::kLps);
    }
  }
  if (!files.axes && stated.size() == 1) {
    files.axes = *stated.begin();
  }
  return files;
}

TriMesh WithoutPiece(const TriMesh& mesh, int triangle) {
  const Components pieces = ConnectedComponents(mesh);
  const int piece = pieces.of_triangle.at(static_cast<std::size_t>(triangle));
  double area = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    area += pieces.of_triangle[t] == piece ? TriangleAreaVector(mesh, mesh.triangles[t]).norm() : 0;
  }
  if (area > Area(mesh) / 2) {
    throw InputError(
        "removal: this piece is the skull itself, because what should go is connected with it; "
        "remove the bone around the point instead");
  }
  std::vector<bool> keep(mesh.triangles.size());
  std::transform(pieces.of_triangle.begin(), pieces.of_triangle.end(), keep.begin(),
                 [&](int of) { return of != piece; });
  return Submesh(mesh, keep);
}

TriMesh WithoutBall(const TriMesh& mesh, const Vec3& centre, double radius_mm) {
  constexpr double kLeast_mm = 0.5, kMost_mm = 30;
  if (!(radius_mm >= kLeast_mm && radius_mm <= kMost_mm)) {
    throw InputError(fmt::format("removal: a radius of {} mm; give {} to {} mm", radius_mm,
                                 kLeast_mm, kMost_mm));
  }
  std::vector<bool> keep(mesh.triangles.size());
  std::transform(mesh.triangles.begin(), mesh.triangles.end(), keep.begin(),
                 [&](const Triangle& t) {
                   return std::ranges::none_of(
                       t, [&](int v) { return (mesh.points[v] - centre).norm() < radius_mm; });
                 });
  return Submesh(mesh, keep);
}

BenchSubject LoadBenchSubject(const FileSubject& files, const RunContext& context) {
  BenchSubject subject;
  if (files.skull.empty()) {
    return subject;
  }
  context.Report("read skull");
  subject.skull.mesh = ReadSubjectMesh(files, files.skull, subject.notes);
  if (!files.mandible.mesh.empty()) {
    AppendMesh(ReadSubjectMesh(files, files.mandible.mesh, subject.notes), subject.skull.mesh);
  }
  CheckMesh(subject.skull.mesh, files.skull, subject);
  subject.skull.view = SimplifyForView(subject.skull.mesh, kSkullTriangles);
  subject.bone = std::make_shared<const MeshQuery>(subject.skull.mesh);
  subject.ends = std::make_shared<const SurfaceEnds>(subject.skull.mesh);
  subject.view_bone = std::make_shared<const MeshQuery>(subject.skull.view);
  if (!files.skin.empty()) {
    context.Report("read skin");
    BenchMesh skin{.mesh = ReadSubjectMesh(files, files.skin, subject.notes), .view = {}};
    CheckMesh(skin.mesh, files.skin, subject);
    skin.view = SimplifyForView(skin.mesh);
    subject.skin = std::move(skin);
  }
  return subject;
}

FileSubject SubjectAsFiles(const Subject& subject, const fs::path& meshes, BenchState& state,
                           const RunContext& context, std::vector<std::string>& notes) {
  return std::visit(
      [&](const auto& given) { return ToFiles(given, meshes, state, context, notes); }, subject);
}

BenchBeginning BeginFromConfig(const fs::path& config, const fs::path& meshes,
                               const RunContext& context) {
  BenchBeginning beginning{.experiment = ReadConfig<Experiment>(config), .state = {}, .notes = {}};
  Experiment& experiment = beginning.experiment;
  if (!experiment.edits.empty()) {
    beginning.state.edits = ReadEditScript(experiment.edits);
    experiment.edits.clear();
  }
  experiment.subject =
      SubjectAsFiles(experiment.subject, meshes, beginning.state, context, beginning.notes);
  if (beginning.state.subject.empty()) {
    beginning.state.subject = PlainName(config);
  }
  return beginning;
}

BenchBeginning BeginBench(const fs::path& source, const fs::path& folder,
                          const RunContext& context) {
  const fs::path meshes = folder / "subject";
  if (IsAnyOf(LowerExtension(source), {".yaml", ".yml"})) {
    return BeginFromConfig(source, meshes, context);
  }
  BenchBeginning beginning{.experiment = DefaultExperiment(folder), .state = {}, .notes = {}};
  beginning.experiment.subject =
      SubjectAsFiles(SubjectFromSource(source), meshes, beginning.state, context, beginning.notes);
  beginning.state.subject = source.empty() ? "subject" : PlainName(source);
  return beginning;
}

}  // namespace semblance::problems
