// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/program/phantom_commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>

#include "problems/command_line/exit_code.h"
#include "problems/landmark_files/read_landmarks.h"
#include "problems/output/output_folder.h"
#include "problems/output/staged_folder.h"
#include "problems/phantom/phantom_ct.h"
#include "problems/program/work_options.h"
#include "problems/subject/phantom.h"
#include "problems/volumes/itk_files.h"
#include "problems/volumes/read_volume.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance {
namespace {

// What the user typed.
struct PhantomArguments {
  std::string out;
  std::string volume;  // the CT in one file too; empty: not
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

// Nothing where no file is asked for.
std::optional<VolumeFormat> FormatOfVolume(const std::string& name) {
  constexpr std::array kWhole = {".nii", ".nii.gz", ".nrrd", ".mha"};  // voxels and all
  const bool is_whole =
      std::ranges::any_of(kWhole, [&](const char* e) { return name.ends_with(e); });
  if (!name.empty() && (!is_whole || name.find('/') != name.npos || name.starts_with('.'))) {
    throw InputError(fmt::format(
        "--volume {}: not a plain name that ends in .nii, .nii.gz, .nrrd or .mha", name));
  }
  return VolumeFormatOf(name);
}

// Whole or not at all: written under another name, then renamed.
void WriteOneFile(const CtVolume& volume, const std::string& name, VolumeFormat format,
                  OutputFolder& folder) {
  const std::filesystem::path part = folder.Root() / ("part-" + name);
  WriteImageVolume(volume, part, format);
  std::filesystem::rename(part, folder.Root() / name);
  fmt::print("{}: the CT in one file\n", name);
}

int WritePhantom(const PhantomArguments& a) {
  const std::optional<VolumeFormat> format = FormatOfVolume(a.volume);
  const Phantom phantom = MakePhantom(a.phantom);
  const LostBone lost(phantom, a.ct.defect);  // an unknown site is told before a folder is made
  StagedFolder staged(a.out, a.force ? WhenNotEmpty::kReplaceFiles : WhenNotEmpty::kRefuse);
  OutputFolder& folder = staged.Files();
  const CtVolume volume = VoxelisePhantom(phantom, a.ct);
  WriteSlices(volume, a.phantom.random_seed, folder);
  LandmarkFile landmarks = PhantomLandmarks(phantom, a.phantom.random_seed);
  std::erase_if(landmarks.landmarks, [&](const Landmark& l) {
    return lost.Holds({l.point[0], l.point[1], l.point[2]});
  });
  folder.Write("landmarks.yaml", EncodeLandmarks(landmarks, "landmarks.yaml"));
  folder.Write("true_skin.ply", EncodeMesh(phantom.face, ".ply"));
  fmt::print(
      "ct: {} DICOM slices of {} x {} voxels, {} x {} x {} mm\n"
      "landmarks.yaml: {} sites, with their true depths\n"
      "true_skin.ply: {} triangles\n",
      volume.slices, volume.columns, volume.rows, a.ct.pixel_mm, a.ct.pixel_mm, a.ct.slice_mm,
      landmarks.landmarks.size(), phantom.face.triangles.size());
  if (format) {
    WriteOneFile(volume, a.volume, *format, folder);
  }
  staged.Publish();
  fmt::print("next: semblance import-ct {}\n", (staged.Root() / "ct").string());
  return kDone;
}

void DeclarePhantom(CLI::App& command, CommandLine& line) {
  PhantomArguments& a = *Bind(command, line, &WritePhantom);
  a.ct.threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  command.add_option("--out", a.out, "folder for ct/, landmarks.yaml and true_skin.ply")
      ->required();
  command.add_option("--random-seed,--seed", a.phantom.random_seed, "which head")
      ->check(WholeNumber())
      ->capture_default_str();
  AddChoice(command, "--bone", "smooth; like_people: with hollows and ridges, and rough",
            a.phantom.bone);
  command.add_option("--pixel-mm", a.ct.pixel_mm, "between columns and rows")
      ->check(Finite())
      ->check(CLI::Range(0.3, 5.0))
      ->capture_default_str();
  command.add_option("--slice-mm", a.ct.slice_mm, "between slices")
      ->check(Finite())
      ->check(CLI::Range(0.3, 10.0))
      ->capture_default_str();
  CLI::Option* const lost =
      command.add_option("--lost", a.ct.defect.site,
                         "the skull lacks its bone around this site; sites there are in no file");
  command.add_option("--lost-radius-mm", a.ct.defect.radius_mm, "how far around it")
      ->needs(lost)
      ->check(Finite())
      ->check(CLI::Range(1.0, 60.0))
      ->capture_default_str();
  command.add_option("--volume", a.volume,
                     "the CT in one file too: NIfTI, NRRD or MetaImage by the name's ending, e.g. "
                     "head.nii.gz");
  command.add_flag("--force", a.force,
                   "replace files of the same name in a folder that is not empty");
}

}  // namespace

std::span<const ProgramCommand> PhantomCommands() {
  static constexpr std::array kCommands = {
      ProgramCommand{"phantom", "write a made-up head as a CT in DICOM, with its landmarks",
                     &DeclarePhantom},
  };
  return kCommands;
}

}  // namespace semblance
