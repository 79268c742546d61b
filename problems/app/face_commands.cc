// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/all_commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <iterator>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "problems/app/exit_code.h"
#include "problems/app/work_options.h"
#include "problems/config/config.h"
#include "problems/config/terminal_text.h"
#include "problems/face/edit_script.h"
#include "problems/face/hspline_prior.h"
#include "problems/face/template_source.h"
#include "problems/io/given_files.h"
#include "problems/report/export_file.h"
#include "problems/report/turntable.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline/feature.h"
#include "surfaces/hspline_files/hspline_json.h"
#include "surfaces/mesh/fuse_meshes.h"
#include "surfaces/mesh/mesh_check.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

// The arguments of all commands of this file. Each command reads its part.
struct FaceArguments {
  std::string face, script, inverse, out, name, library;
  std::vector<std::string> features;
  std::vector<double> weights;
  std::optional<double> chord_mm;
  std::array<double, 2> u = {0, 1}, v = {0, 1};
  std::array<int, 2> levels = {1, 8};
  ModesPrior prior;
  std::string template_folder;
  int level = 2;
  int threads = 1;
  bool force = false;
};

// given: the files that the command reads.
void CheckFree(const fs::path& path, const FaceArguments& a, std::span<const fs::path> given) {
  RefuseToReplace(path, given);
  RefuseExisting(path, a.force);
}

// Throws InputError if two outputs have the same name, because one would be lost.
void RefuseSameName(const std::string& out, const std::string& other) {
  const auto resolved = [](const std::string& name) {
    return fs::weakly_canonical(fs::absolute(name));
  };
  if (!other.empty() && resolved(out) == resolved(other)) {
    throw InputError(
        fmt::format("{}: --out and --inverse name the same file; give two names", out));
  }
}

// Adds the name of the file to the message if it lacks it.
InputError WithFileName(const InputError& error, const std::string& file) {
  const std::string words = error.what();
  return InputError(words.find(file) == words.npos ? fmt::format("{}: {}", file, words) : words);
}

EditScript ApplyScript(const std::string& script, HSplineSurface& face) {
  const EditScript edits = ReadEditScript(script);
  try {
    return ApplyEdits(edits, face);
  } catch (const InputError& error) {
    throw WithFileName(error, script);
  }
}

int Edit(const FaceArguments& a) {
  const std::array<fs::path, 2> given = {a.face, a.script};
  CheckFree(a.out, a, given);
  RefuseSameName(a.out, a.inverse);
  if (!a.inverse.empty()) {
    CheckFree(a.inverse, a, given);
  }
  HSplineSurface face = ReadHSpline(a.face);
  const EditScript inverse = ApplyScript(a.script, face);
  std::vector<FileBytes> files = {{a.out, HSplineToJson(face)}};
  if (!a.inverse.empty()) {
    files.push_back({a.inverse, WriteConfig(inverse)});
  }
  WriteFilesTogether(files);
  Tell("{}: {} vertices changed\n", a.out, inverse.edits.size());
  return kDone;
}

int Export(const FaceArguments& a) try {
  CheckFree(a.out, a, std::array<fs::path, 1>{a.face});
  const std::string bytes =
      ExportedBytes(a.face, {.extension = fs::path(a.out).extension().string(),
                             .chord_mm = a.chord_mm,
                             .threads = a.threads});
  WriteFileAtomically(a.out, bytes);
  Tell("{}: {} bytes\n", a.out, bytes.size());
  return kDone;
} catch (const InputError& error) {
  throw WithFileName(error, a.face);
}

struct TurntableArguments {
  std::string run;
  TurntableOptions options;
  WorkOptions work;
};

int TurntableCommand(const TurntableArguments& a) {
  const Turntable table = MakeTurntable(a.run, a.options, MakeRunContext(a.work));
  StagedFolder folder = MakeStagedFolder(a.work, "", {.files = {fs::path(a.run) / "scene.json"}});
  folder.Files().Write("turntable.glb", table.glb);
  for (const TurntableFrame& frame : table.frames) {
    folder.Files().Write(frame.name, frame.png);
  }
  folder.Publish();
  Tell("{}: turntable.glb and {} frames\n", folder.Root().string(), table.frames.size());
  return kDone;
}

int Store(const Feature& feature, const FaceArguments& a, std::span<const fs::path> given) {
  CheckFree(fs::path(a.library) / fmt::format("{}.json", feature.name), a, given);
  const fs::path path = StoreFeature(a.library, feature);
  Tell("{}: {} vertices\n", path.string(), feature.offsets.size());
  return kDone;
}

std::vector<fs::path> FeatureFiles(const FaceArguments& a) {
  return {a.features.begin(), a.features.end()};
}

int ExtractCommand(const FaceArguments& a) {
  const FeatureRegion region{a.u[0], a.u[1], a.v[0], a.v[1], a.levels[0], a.levels[1]};
  const Feature feature = ExtractFeature(ReadHSpline(a.face), a.name, region);
  if (feature.offsets.empty()) {
    throw InputError(fmt::format(
        "{}: no vertex of levels {} to {} with u in {}..{} and v in {}..{} has detail; widen them",
        a.face, a.levels[0], a.levels[1], a.u[0], a.u[1], a.v[0], a.v[1]));
  }
  return Store(feature, a, std::array<fs::path, 1>{a.face});
}

int ApplyCommand(const FaceArguments& a) {
  std::vector<fs::path> given = FeatureFiles(a);
  given.emplace_back(a.face);
  CheckFree(a.out, a, given);
  HSplineSurface face = ReadHSpline(a.face);
  std::size_t vertices = 0;
  for (const std::string& path : a.features) {
    const Feature feature = ReadFeature(path);
    ApplyFeature(feature, face);
    vertices += feature.offsets.size();
  }
  WriteHSpline(a.out, face);
  Tell("{}: {} vertices given\n", a.out, vertices);
  return kDone;
}

int BlendCommand(const FaceArguments& a) {
  std::vector<Feature> features;
  for (const std::string& path : a.features) {
    features.push_back(ReadFeature(path));
  }
  const FeatureBlend blend = BlendFeatures(a.name, features, a.weights);
  for (const std::string& warning : blend.warnings) {
    Tell(stderr, "warning: {}\n", warning);
  }
  return Store(blend.feature, a, FeatureFiles(a));
}

int MirrorCommand(const FaceArguments& a) {
  Feature feature = MirrorFeature(ReadFeature(a.features.at(0)));
  feature.name = a.name;
  return Store(feature, a, FeatureFiles(a));
}

int FuseCommand(const FaceArguments& a) {
  const std::array<fs::path, 2> given = {a.face, a.features.at(0)};
  CheckFree(a.out, a, given);
  std::vector<std::string> notes;
  const TriMesh body = ReadMeshInLps(given[0], notes);
  const TriMesh feature = ReadMeshInLps(given[1], notes);
  std::ranges::copy(CheckHeadMesh(body, a.face), std::back_inserter(notes));
  const FusedMesh fused = [&] {
    try {
      return FuseMeshes(body, feature);
    } catch (const InputError& error) {
      throw InputError(fmt::format("{} and {}: {}", a.face, a.features[0], error.what()));
    }
  }();
  WriteFileAtomically(a.out, EncodeMesh(fused.mesh, fs::path(a.out).extension().string()));
  for (const std::string& note : notes) {
    Tell(stderr, "note: {}\n", note);
  }
  Tell("{}: {} triangles; seam {:.1f} mm, {:.0f} mm2 covered, {:.0f} mm2 added\n", a.out,
       fused.mesh.triangles.size(), fused.seam_mm, fused.covered_mm2, fused.added_mm2);
  return kDone;
}

int ListCommand(const FaceArguments& a) {
  for (const auto& [name, feature] : ReadFeatureLibrary(a.library)) {
    Tell("{}: {} vertices, {} x {} patches\n", name, feature.offsets.size(),
         feature.shape.patches_u, feature.shape.patches_v);
  }
  return kDone;
}

// The files that `semblance template` writes into a folder.
FileTemplate TemplateFiles(const fs::path& folder) {
  return {.surface = folder / "head.hspline.json",
          .sites = folder / "sites.csv",
          .features = folder / "features.json"};
}

int PriorCommand(const FaceArguments& a) {
  const FileTemplate files = TemplateFiles(a.template_folder);
  std::vector<fs::path> given = ModesPriorFiles(a.prior);
  given.insert(given.end(), {files.surface, files.sites, files.features});
  CheckFree(a.out, a, given);
  const TemplateFace face = ReadTemplate(files);
  const FacePrior prior = LoadPrior(a.prior);
  RunContext context;
  context.threads = a.threads;
  const PriorOnTemplate on_template = LayOnTemplate(prior, face, context);
  ModesMisfit misfit;
  const HSplineModes modes =
      ModesOnTemplate(prior, on_template, face, a.level, a.prior.count, &misfit);
  const std::string bytes = HSplineModesToJson(modes);
  WriteFileAtomically(a.out, bytes);
  Tell(
      "{}: {} modes of level {}, {} bytes; from the mean {:.3f} mm RMS, from the modes {:.3f} mm "
      "RMS, at most {:.3f} mm\n",
      a.out, modes.modes.size(), modes.level, bytes.size(), on_template.rms_mm, misfit.rms_mm,
      misfit.max_mm);
  return kDone;
}

void AddForce(CLI::App& command, FaceArguments& a) {
  command.add_flag("--force", a.force, "replace a file of the same name");
}

void AddFace(CLI::App& command, FaceArguments& a) {
  command.add_option("FACE", a.face, "H-spline (.json)")->required();
}

// Adds the options for storing a new feature.
void AddStore(CLI::App& command, FaceArguments& a) {
  command.add_option("--name", a.name, "name of the new feature: letters, digits, '-' and '_'")
      ->required();
  command.add_option("--library", a.library, "folder to store it in")->required();
  AddForce(command, a);
}

void DeclareEdit(CLI::App& edit, CommandLine& line) {
  FaceArguments& a = *Bind(edit, line, &Edit);
  AddFace(edit, a);
  edit.add_option("SCRIPT", a.script, "edit script: vertices to reset and to move (.yaml)")
      ->required();
  edit.add_option("--out", a.out, "file for the edited face")->required();
  edit.add_option("--inverse", a.inverse, "file for the script that reverses the edits");
  AddForce(edit, a);
}

void DeclareExport(CLI::App& to, CommandLine& line) {
  FaceArguments& a = *Bind(to, line, &Export);
  to.add_option("FROM", a.face,
                "an H-spline (.json), a mesh (.ply .obj .off .stl) or the folder of a run")
      ->required();
  to.add_option(
        "--to", a.out,
        "file; for an H-spline exact: .vtu .step .iges, triangles: .glb .vtp .ply .obj .off "
        ".stl; for a mesh with its values: .vtp .vtu .ply, with colours: .glb, shape alone: "
        ".obj .off .stl; for a run: .glb with skull, face and depth markers")
      ->required();
  to.add_option(
        "--chord_mm", a.chord_mm,
        "largest distance of a triangle from the surface of an H-spline [0.1, or 1/5000 of its "
        "extent if that is more]")
      ->check(Finite());
  AddThreads(to, a.threads);
  AddForce(to, a);
}

void DeclareTurntable(CLI::App& turntable, CommandLine& line) {
  TurntableArguments& a = *Bind(turntable, line, &TurntableCommand);
  turntable.add_option("RUN", a.run, "folder of a run")->required();
  turntable.add_option("--frames", a.options.frames, "pictures of one turn [36]")
      ->check(CLI::Range(1, 720));
  turntable.add_option("--seconds", a.options.seconds, "time of one turn in turntable.glb [8]")
      ->check(Finite());
  turntable.add_option("--height_px", a.options.height_px, "height of a picture in pixels [640]")
      ->check(CLI::Range(64, 2160));
  AddOutput(turntable, a.work);
  turntable.get_option("--out")->required();
  AddWork(turntable, line, a.work);
}

void DeclareExtract(CLI::App& extract, CommandLine& line) {
  FaceArguments& a = *Bind(extract, line, &ExtractCommand);
  AddFace(extract, a);
  extract
      .add_option("--u", a.u,
                  "lowest and highest u; lowest > highest means a range across the seam")
      ->check(Finite())
      ->check(CLI::Range(0.0, 1.0));
  extract.add_option("--v", a.v, "lowest and highest v")
      ->check(Finite())
      ->check(CLI::Range(0.0, 1.0));
  extract.add_option("--levels", a.levels, "first and last level")->check(CLI::Range(1, 8));
  AddStore(extract, a);
}

void DeclareApply(CLI::App& apply, CommandLine& line) {
  FaceArguments& a = *Bind(apply, line, &ApplyCommand);
  AddFace(apply, a);
  apply.add_option("FEATURE", a.features, "files of a library; later ones replace earlier ones")
      ->required();
  apply.add_option("--out", a.out, "file for the new face")->required();
  AddForce(apply, a);
}

void DeclareBlend(CLI::App& blend, CommandLine& line) {
  FaceArguments& a = *Bind(blend, line, &BlendCommand);
  blend.add_option("FEATURE", a.features, "files of a library")->required();
  blend.add_option("--weights", a.weights, "one per feature; a weight outside 0..1 extrapolates")
      ->required()
      ->check(Finite());
  AddStore(blend, a);
}

void DeclareMirror(CLI::App& mirror, CommandLine& line) {
  FaceArguments& a = *Bind(mirror, line, &MirrorCommand);
  mirror.add_option("FEATURE", a.features, "file of a library")->required()->expected(1);
  AddStore(mirror, a);
}

void DeclareFuse(CLI::App& fuse, CommandLine& line) {
  FaceArguments& a = *Bind(fuse, line, &FuseCommand);
  fuse.add_option("BODY", a.face,
                  "mesh to add to, such as a run's implicit.ply (.ply .obj .off .stl)")
      ->required();
  fuse.add_option("FEATURE", a.features,
                  "mesh of the feature at its place, in mm; its border, if any, inside the body")
      ->required()
      ->expected(1);
  fuse.add_option("--out", a.out, "file for the fused mesh (.ply .obj .off .stl)")->required();
  AddForce(fuse, a);
}

void DeclareList(CLI::App& list, CommandLine& line) {
  FaceArguments& a = *Bind(list, line, &ListCommand);
  list.add_option("LIBRARY", a.library, "folder")->required();
}

// Checks the range of prior.scale. CLI::Range would print its lower end as 0.000000, which is not
// allowed.
CLI::Validator AsPriorScale() {
  return {[](std::string& text) -> std::string {
            double scale = 0;
            return CLI::detail::lexical_cast(text, scale) && !(scale >= 1e-9 && scale <= 1e9)
                       ? fmt::format("'{}' is not a number from 1e-9 to 1e9", text)
                       : "";
          },
          "1e-9 to 1e9"};
}

void DeclarePrior(CLI::App& prior, CommandLine& line) {
  FaceArguments& a = *Bind(prior, line, &PriorCommand);
  prior.add_option("MEAN", a.prior.mean, "mesh of the mean face")->required();
  prior
      .add_option("MODES", a.prior.modes,
                  "its modes: k x n x 3 (.npy), or a folder of meshes, each the mean moved by one "
                  "standard deviation of one mode")
      ->required();
  prior.add_option("--sites", a.prior.sites, "sites on the mean (.csv: site,x_mm,y_mm,z_mm)")
      ->required();
  prior
      .add_option("--features", a.prior.features,
                  "the 68 facial landmarks on the mean (.csv: i_multipie,x,y,z)")
      ->required();
  prior
      .add_option("--template", a.template_folder,
                  "folder that `semblance template MEAN` has written")
      ->required();
  prior.add_option("--out", a.out, "file for the modes (.json)")->required();
  prior.add_option("--scale", a.prior.scale, "mm per unit of an array of modes [1]")
      ->check(AsPriorScale());
  prior.add_option("--modes", a.prior.count, "largest number of modes [60]")
      ->check(CLI::Range(1, 10000));
  prior.add_option("--level", a.level, "level of the B-splines that represent them [2]")
      ->check(CLI::Range(0, 8));
  AddThreads(prior, a.threads);
  a.prior.count = 60;
  AddForce(prior, a);
}

constexpr std::array kFeatureCommands = {
    ProgramCommand{"extract", "extract detail from a face", &DeclareExtract},
    ProgramCommand{"apply", "apply features to a face", &DeclareApply},
    ProgramCommand{"blend", "make a weighted sum of features", &DeclareBlend},
    ProgramCommand{"mirror", "make a feature for the other side", &DeclareMirror},
    ProgramCommand{"fuse", "fuse a modelled or scanned feature with a mesh (thesis 3.4)",
                   &DeclareFuse},
    ProgramCommand{"list", "list the features of a library", &DeclareList},
};

void DeclareFeature(CLI::App& feature, CommandLine& line) {
  feature.require_subcommand(1);
  Declare(kFeatureCommands, feature, line);
}

}  // namespace

std::span<const ProgramCommand> FaceCommands() {
  static constexpr std::array kCommands = {
      ProgramCommand{"edit", "move vertices of an H-spline face by a script", &DeclareEdit},
      ProgramCommand{"export", "write a face, a mesh or a run for other programs", &DeclareExport},
      ProgramCommand{"turntable", "make a turning skull and face as .glb and pictures",
                     &DeclareTurntable},
      ProgramCommand{"prior", "transfer the modes of a face model to the H-spline of its mean",
                     &DeclarePrior},
      ProgramCommand{"feature", "transfer detail from one face to another (thesis 4.3)",
                     &DeclareFeature},
  };
  return kCommands;
}

}  // namespace semblance::problems
