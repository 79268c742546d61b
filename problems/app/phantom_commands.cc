// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/all_commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "problems/app/exit_code.h"
#include "problems/app/work_options.h"
#include "problems/config/terminal_text.h"
#include "problems/io/output_folder.h"
#include "problems/io/staged_folder.h"
#include "problems/io/volumes/itk_files.h"
#include "problems/io/volumes/read_volume.h"
#include "problems/subject/landmark_files/read_landmarks.h"
#include "problems/subject/phantom.h"
#include "problems/subject/phantom_ct.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance::problems {
namespace {

// The arguments of the command.
struct PhantomArguments {
  std::string out;
  std::string volume;  // further file with the whole CT; empty: none
  PhantomOptions phantom;
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

int WritePhantom(const PhantomArguments& a) {
  const std::optional<VolumeFormat> format = CheckVolumeName(a.volume);
  const Phantom phantom = MakePhantom(a.phantom);
  const LostBone lost(phantom,
                      a.ct.defect);  // throws for an unknown site before the folder is made
  StagedFolder staged(a.out, a.force ? WhenNotEmpty::kReplaceFiles : WhenNotEmpty::kRefuse);
  OutputFolder& folder = staged.Files();
  const CtVolume volume = VoxelisePhantom(phantom, a.ct);
  WriteSlices(volume, a.phantom.random_seed, folder);
  LandmarkFile landmarks = PhantomLandmarks(phantom, a.phantom.random_seed);
  std::erase_if(landmarks.landmarks, [&](const Landmark& l) { return lost.Holds(l.Position()); });
  folder.Write("landmarks.yaml", EncodeLandmarks(landmarks, "landmarks.yaml"));
  folder.Write("true_skin.ply", EncodeMesh(phantom.face, ".ply"));
  Tell(
      "ct: {} DICOM slices of {} x {} voxels, {} x {} x {} mm\n"
      "landmarks.yaml: {} sites, with their true depths\n"
      "true_skin.ply: {} triangles\n",
      volume.slices, volume.columns, volume.rows, a.ct.pixel_mm, a.ct.pixel_mm, a.ct.slice_mm,
      landmarks.landmarks.size(), phantom.face.triangles.size());
  if (format) {
    WriteVolumeFile(volume, a.volume, *format, folder);
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
  command.add_option("--random-seed,--seed", a.phantom.random_seed, "number of the head")
      ->check(WholeNumber())
      ->capture_default_str();
  AddChoice(command, "--bone", "smooth; like_people: rough, with hollows and ridges",
            a.phantom.bone);
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
