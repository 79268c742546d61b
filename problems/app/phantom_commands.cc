// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/all_commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "problems/app/exit_code.h"
#include "problems/app/work_options.h"
#include "problems/config/terminal_text.h"
#include "problems/face/person_scan.h"
#include "problems/io/output_folder.h"
#include "problems/io/staged_folder.h"
#include "problems/io/volumes/itk_files.h"
#include "problems/io/volumes/read_volume.h"
#include "problems/subject/landmark_files/read_landmarks.h"
#include "problems/subject/phantom.h"
#include "problems/subject/phantom_ct.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance::problems {
namespace {

// The head that the command writes: a person's, or one by formula with one of the bones of
// PhantomBone.
enum class PhantomKind { kPerson, kSmooth, kLikePeople };
constexpr auto EnumNames(PhantomKind) {
  return std::to_array<std::string_view>({"person", "smooth", "like_people"});
}

// The arguments of the command.
struct PhantomArguments {
  std::string out;
  std::string volume;  // further file with the whole CT; empty: none
  PhantomKind kind = PhantomKind::kPerson;
  std::uint64_t random_seed = 1;
  PhantomCtOptions ct;
  bool force = false;
};

void WriteSlices(const CtVolume& volume, std::uint64_t random_seed, OutputFolder& folder) {
  const DicomSeriesNames names{.patient = fmt::format("Phantom^{}", random_seed),
                               .description = fmt::format("phantom head {}", random_seed),
                               .number = random_seed};
  for (int slice = 0; slice < volume.slices; ++slice) {
    folder.Write(fmt::format("ct/slice{:04}.dcm", slice + 1),
                 EncodeDicomSlice(volume, slice, names), Durability::kUnsynced);
  }
}

// Returns the format of --volume, or none if the name is empty. Throws InputError for a bad name.
std::optional<VolumeFormat> CheckVolumeName(const std::string& name) {
  constexpr std::array kWhole = {".nii", ".nii.gz", ".nrrd", ".mha"};  // one file with the voxels
  const bool is_whole =
      std::ranges::any_of(kWhole, [&](const char* e) { return name.ends_with(e); });
  if (!name.empty() && (!is_whole || name.find('/') != name.npos || name.starts_with('.'))) {
    throw InputError(fmt::format(
        "--volume {}: not a plain name that ends in .nii, .nii.gz, .nrrd or .mha", name));
  }
  return FindVolumeFormat(name);
}

// Writes under another name and renames the file, so that no incomplete file has the name.
void WriteVolumeFile(const CtVolume& volume, const std::string& name, VolumeFormat format,
                     OutputFolder& folder) {
  const std::filesystem::path part = folder.Root() / ("part-" + name);
  WriteImageVolume(volume, part, format);
  std::filesystem::rename(part, folder.Root() / name);
  Tell("{}: the CT in one file\n", name);
}

// A phantom as the command writes it.
struct ScannedPhantom {
  CtVolume volume;
  std::vector<PhantomSite> sites;
  TriMesh skin;
};

ScannedPhantom ScanPerson(const PhantomArguments& a) {
  RunContext context;
  context.threads = a.ct.threads;
  PersonPhantom person = MakePersonPhantom(a.random_seed, context);
  Tell("a made-up person, {:+.1f} standard deviations of tissue from the mean of people\n",
       person.build);
  return {VoxelisePerson(person, a.ct), std::move(person.sites), std::move(person.true_skin)};
}

ScannedPhantom ScanFormula(const PhantomArguments& a) {
  Phantom phantom = MakePhantom(
      {.random_seed = a.random_seed,
       .bone = a.kind == PhantomKind::kSmooth ? PhantomBone::kSmooth : PhantomBone::kLikePeople});
  return {VoxelisePhantom(phantom, a.ct), std::move(phantom.sites), std::move(phantom.face)};
}

// Throws InputError, before anything is computed, for a defect at a site that no head has.
void CheckDefect(const BoneDefect& defect) {
  if (!defect.site.empty() && !IsStandardSite(defect.site)) {
    LostBone({}, defect);
  }
}

int WritePhantom(const PhantomArguments& a) {
  const std::optional<VolumeFormat> format = CheckVolumeName(a.volume);
  CheckDefect(a.ct.defect);
  StagedFolder staged(a.out, a.force ? WhenNotEmpty::kReplaceFiles : WhenNotEmpty::kRefuse);
  OutputFolder& folder = staged.Files();
  const ScannedPhantom scan = a.kind == PhantomKind::kPerson ? ScanPerson(a) : ScanFormula(a);
  const LostBone lost(scan.sites, a.ct.defect);
  WriteSlices(scan.volume, a.random_seed, folder);
  LandmarkFile landmarks = PhantomLandmarks(scan.sites, a.random_seed);
  std::erase_if(landmarks.landmarks, [&](const Landmark& l) { return lost.Holds(l.Position()); });
  folder.Write("landmarks.yaml", EncodeLandmarks(landmarks, "landmarks.yaml"));
  folder.Write("true_skin.ply", EncodeMesh(scan.skin, ".ply"));
  Tell(
      "ct: {} DICOM slices of {} x {} voxels, {} x {} x {} mm\n"
      "landmarks.yaml: {} sites, with their true depths\n"
      "true_skin.ply: {} triangles\n",
      scan.volume.slices, scan.volume.columns, scan.volume.rows, a.ct.pixel_mm, a.ct.pixel_mm,
      a.ct.slice_mm, landmarks.landmarks.size(), scan.skin.triangles.size());
  if (format) {
    WriteVolumeFile(scan.volume, a.volume, *format, folder);
  }
  staged.Publish();
  Tell("next: semblance import-ct {}\n", (staged.Root() / "ct").string());
  return kDone;
}

void DeclarePhantom(CLI::App& command, CommandLine& line) {
  PhantomArguments& a = *Bind(command, line, &WritePhantom);
  a.ct.threads = DefaultThreads();
  command.add_option("--out", a.out, "folder for ct/, landmarks.yaml and true_skin.ply")
      ->required();
  command.add_option("--random-seed,--seed", a.random_seed, "number of the head")
      ->check(WholeNumber())
      ->capture_default_str();
  AddChoice(
      command, "--head",
      "person: skull and face drawn from models of people, with nose, lips, eyes and ears; by "
      "formula: smooth, or like_people with rough bone, hollows and ridges",
      a.kind);
  command.add_option("--pixel-mm", a.ct.pixel_mm, "distance of columns and of rows")
      ->check(Finite())
      ->check(CLI::Range(0.3, 5.0))
      ->capture_default_str();
  command.add_option("--slice-mm", a.ct.slice_mm, "distance of slices")
      ->check(Finite())
      ->check(CLI::Range(0.3, 10.0))
      ->capture_default_str();
  CLI::Option* const lost = command.add_option(
      "--lost", a.ct.defect.site,
      "remove the bone around this site; the landmark file omits the sites there");
  command.add_option("--lost-radius-mm", a.ct.defect.radius_mm, "radius of the removed bone")
      ->needs(lost)
      ->check(Finite())
      ->check(CLI::Range(1.0, 60.0))
      ->capture_default_str();
  command.add_option(
      "--volume", a.volume,
      "write the CT into one file too: NIfTI, NRRD or MetaImage by the ending of the "
      "name, e.g. head.nii.gz");
  command.add_flag("--force", a.force,
                   "replace files of the same name in a folder that is not empty");
}

}  // namespace

std::span<const ProgramCommand> PhantomCommands() {
  static constexpr std::array kCommands = {
      ProgramCommand{"phantom", "write a phantom head as a CT in DICOM, with its landmarks",
                     &DeclarePhantom},
  };
  return kCommands;
}

}  // namespace semblance::problems
