// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/population/population_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "problems/config/config.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/csv.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> Sorted(const fs::path& folder) {
  std::vector<fs::path> entries;
  for (const auto& entry : fs::directory_iterator(folder)) {
    entries.push_back(entry.path());
  }
  std::ranges::sort(entries);
  return entries;
}

// The one file of that name with some ending; none if there is none.
fs::path OneFile(const fs::path& folder, const std::string& name,
                 const std::vector<std::string>& endings) {
  std::vector<fs::path> found;
  for (const std::string& ending : endings) {
    if (fs::exists(folder / (name + ending))) {
      found.push_back(folder / (name + ending));
    }
  }
  if (found.size() > 1) {
    throw InputError(fmt::format("{}: both {} and {} are there; keep one", folder.string(),
                                 found[0].filename().string(), found[1].filename().string()));
  }
  return found.empty() ? fs::path() : found[0];
}

fs::path VolumeIn(const fs::path& folder) {
  for (const char* name : {"ct", "dicom"}) {
    if (fs::is_directory(folder / name)) {
      return folder / name;
    }
  }
  return OneFile(folder, "volume", {".nii", ".nii.gz", ".nrrd", ".nhdr", ".mha", ".mhd", ".inv3"});
}

// Nothing where the folder holds no subject.
std::optional<Subject> SubjectIn(const fs::path& folder) {
  const std::vector<std::string> meshes = {".ply", ".obj", ".stl", ".off"};
  const fs::path landmarks = OneFile(
      folder, "landmarks", {".yaml", ".yml", ".mrk.json", ".fcsv", ".pp", ".txt", ".asc", ".csv"});
  const fs::path skull = OneFile(folder, "skull", meshes), skin = OneFile(folder, "skin", meshes);
  if (skull.empty() != skin.empty()) {
    throw InputError(fmt::format("{}: it has a {} and no {}; a depth needs both", folder.string(),
                                 skull.empty() ? "skin" : "skull",
                                 skull.empty() ? "skull" : "skin"));
  }
  if (!skull.empty()) {
    FileSubject files;
    files.skull = skull;
    files.skin = skin;
    files.landmarks = landmarks;
    return files;
  }
  const fs::path volume = VolumeIn(folder);
  if (volume.empty()) {
    return std::nullopt;
  }
  CtSubject ct;
  ct.volume = volume;
  ct.landmarks = landmarks;
  return ct;
}

template <class E>
std::optional<E> WordIn(const CsvReader& csv, const char* column) {
  const auto at = csv.Find(column);
  if (!at || csv.Cell(*at).empty()) {
    return std::nullopt;
  }
  const auto names = EnumNames(E{});
  const auto word = std::ranges::find(names, csv.Cell(*at));
  if (word == names.end()) {
    csv.Fail(fmt::format("{} is '{}'; it must be one of {}, or empty", column, csv.Cell(*at),
                         fmt::join(names, ", ")));
  }
  return static_cast<E>(word - names.begin());
}

std::optional<double> NumberIn(const CsvReader& csv, const char* column) {
  const auto at = csv.Find(column);
  const double number = at ? csv.NumberOrNan(*at) : kNaN;
  return std::isfinite(number) ? std::optional(number) : std::nullopt;
}

void AddPersons(const fs::path& file, std::vector<PopulationSubject>& subjects) {
  const std::string text = ReadFileBytes(file);
  CsvReader csv(text, file.string());
  const std::size_t name = csv.ColumnOf("name");
  while (csv.NextRow()) {
    const auto subject = std::ranges::find(subjects, csv.Cell(name), &PopulationSubject::name);
    if (subject == subjects.end()) {
      csv.Fail(fmt::format("there is no subject '{}' in the folder", csv.Cell(name)));
    }
    subject->sex = WordIn<Sex>(csv, "sex");
    subject->build = WordIn<Build>(csv, "build");
    subject->age_years = NumberIn(csv, "age_years");
    subject->bmi = NumberIn(csv, "bmi");
  }
}

}  // namespace

PopulationFile FolderPopulation(const fs::path& given) {
  const fs::path folder = fs::absolute(given).lexically_normal();
  PopulationFile file;
  if (fs::exists(folder / "population.yaml")) {
    file = ReadConfig<PopulationFile>(folder / "population.yaml");
  } else {
    file.title = fs::absolute(folder / "").lexically_normal().parent_path().filename().string();
  }
  for (const fs::path& entry : Sorted(folder)) {
    if (fs::is_directory(entry)) {
      if (auto subject = SubjectIn(entry)) {
        file.subjects.push_back(
            {.name = entry.filename().string(), .subject = std::move(*subject)});
      }
    }
  }
  if (file.subjects.empty() && file.phantoms.count == 0) {
    throw InputError(fmt::format(
        "{}: no subject in it; each needs a folder with skull.ply and skin.ply, or with "
        "volume.nii.gz or ct/ (DICOM)",
        folder.string()));
  }
  if (fs::exists(folder / "subjects.csv")) {
    AddPersons(folder / "subjects.csv", file.subjects);
  }
  return file;
}

}  // namespace semblance
