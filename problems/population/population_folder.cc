// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/population/population_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

#include "problems/config/config.h"
#include "problems/config/spelling_suggestion.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/csv.h"
#include "surfaces/base/error.h"
#include "surfaces/base/lower_case.h"

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

// The one of the entries of that name, in capitals or not, with some ending; none if there is none.
fs::path OneOf(const std::vector<fs::path>& entries, const std::string& name,
               const std::vector<std::string>& endings) {
  std::vector<fs::path> found;
  for (const fs::path& entry : entries) {
    const std::string lower = LowerCase(entry.filename().string());
    if (std::ranges::any_of(endings, [&](const auto& ending) { return lower == name + ending; })) {
      found.push_back(entry);
    }
  }
  if (found.size() > 1) {
    throw InputError(fmt::format("{}: both {} and {} are there; keep one",
                                 found[0].parent_path().string(), found[0].filename().string(),
                                 found[1].filename().string()));
  }
  return found.empty() ? fs::path() : found[0];
}

fs::path VolumeIn(const std::vector<fs::path>& entries) {
  std::vector<fs::path> folders;
  std::ranges::copy_if(entries, std::back_inserter(folders),
                       [](const fs::path& entry) { return fs::is_directory(entry); });
  for (const char* name : {"ct", "dicom"}) {
    if (fs::path folder = OneOf(folders, name, {""}); !folder.empty()) {
      return folder;
    }
  }
  return OneOf(entries, "volume", {".nii", ".nii.gz", ".nrrd", ".nhdr", ".mha", ".mhd", ".inv3"});
}

// Nothing where the folder holds no subject.
std::optional<Subject> SubjectIn(const fs::path& folder) {
  const std::vector<std::string> meshes = {".ply", ".obj", ".stl", ".off"};
  const std::vector<fs::path> entries = Sorted(folder);
  const fs::path landmarks = OneOf(
      entries, "landmarks", {".yaml", ".yml", ".mrk.json", ".fcsv", ".pp", ".txt", ".asc", ".csv"});
  const fs::path skull = OneOf(entries, "skull", meshes), skin = OneOf(entries, "skin", meshes);
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
  const fs::path volume = VolumeIn(entries);
  if (volume.empty()) {
    return std::nullopt;
  }
  CtSubject ct;
  ct.volume = volume;
  ct.landmarks = landmarks;
  return ct;
}

bool IsHidden(const fs::path& entry) { return entry.filename().string().starts_with('.'); }

// The subjects of the folders in a folder; a note for each folder that holds none.
void AddSubjects(const fs::path& folder, PopulationFile& file, std::vector<std::string>& notes) {
  for (const fs::path& entry : Sorted(folder)) {
    if (!fs::is_directory(entry)) {
      continue;
    }
    const std::string name = entry.filename().string();
    if (auto subject = SubjectIn(entry)) {
      file.subjects.push_back({.name = name, .subject = std::move(*subject)});
    } else if (!IsHidden(entry)) {
      notes.push_back(fmt::format(
          "{}: passed over; there are no skull and skin in it, and no volume, ct or dicom", name));
    }
  }
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

// What Fields says of one option.
struct FieldFinder {
  std::string_view name;
  FieldInfo found = {};

  template <class T>
  void operator()(const FieldInfo& info, const T&) {
    if (info.name == name) {
      found = info;
    }
  }
};

FieldInfo PersonField(std::string_view name) {
  PopulationSubject any;
  FieldFinder finder{.name = name};
  Fields(finder, any);
  return finder.found;
}

// As a configuration allows it.
std::optional<double> NumberIn(const CsvReader& csv, const char* column) {
  const auto at = csv.Find(column);
  const double number = at ? csv.NumberOrNan(*at) : kNaN;
  const FieldInfo range = PersonField(column);
  if (number < range.min || number > range.max) {
    csv.Fail(fmt::format("{} is {}; it must be {} to {}, or empty", column, csv.Cell(*at),
                         range.min, range.max));
  }
  return std::isfinite(number) ? std::optional(number) : std::nullopt;
}

void CheckColumns(const CsvReader& csv) {
  const std::vector<std::string>& columns = csv.Columns();
  if (columns.size() == 1 && columns[0].find_first_of(";\t") != std::string::npos) {
    csv.Fail(
        "semicolons or tabs separate the columns; save the table with commas between them, "
        "and with decimal points");
  }
  std::vector<std::string> known = CovariateNames();
  known.insert(known.begin(), "name");
  for (const std::string& column : columns) {
    if (std::ranges::find(known, column) == known.end()) {
      csv.Fail(fmt::format("unknown column '{}'{}", column, Suggestion(LowerCase(column), known)));
    }
  }
  csv.ColumnOf("name");
}

// Whose row it is; each has one.
PopulationSubject& PersonOf(const CsvReader& csv, std::set<std::string>& had,
                            std::vector<PopulationSubject>& subjects) {
  const std::string name(csv.Cell(csv.ColumnOf("name")));
  const auto subject = std::ranges::find(subjects, name, &PopulationSubject::name);
  if (subject == subjects.end()) {
    std::vector<std::string> names;
    std::ranges::transform(subjects, std::back_inserter(names), &PopulationSubject::name);
    csv.Fail(
        fmt::format("there is no subject '{}' in the folder{}", name, Suggestion(name, names)));
  }
  if (!had.insert(name).second) {
    csv.Fail(fmt::format("'{}' has a row above; leave one out", name));
  }
  return *subject;
}

template <class T>
void SetIfKnown(const std::optional<T>& value, std::optional<T>& out) {
  out = value ? value : out;
}

void AddPersons(const fs::path& file, std::vector<PopulationSubject>& subjects) {
  const std::string text = ReadFileBytes(file);
  CsvReader csv(text, file.string());
  CheckColumns(csv);
  std::set<std::string> had;
  while (csv.NextRow()) {
    PopulationSubject& subject = PersonOf(csv, had, subjects);
    SetIfKnown(WordIn<Sex>(csv, "sex"), subject.sex);
    SetIfKnown(WordIn<Build>(csv, "build"), subject.build);
    SetIfKnown(NumberIn(csv, "age_years"), subject.age_years);
    SetIfKnown(NumberIn(csv, "bmi"), subject.bmi);
  }
}

}  // namespace

PopulationFile FolderPopulation(const fs::path& given, std::vector<std::string>& notes) {
  const fs::path folder = fs::absolute(given).lexically_normal();
  PopulationFile file;
  if (fs::exists(folder / "population.yaml")) {
    file = ReadConfig<PopulationFile>(folder / "population.yaml");
  } else {
    file.title = fs::absolute(folder / "").lexically_normal().parent_path().filename().string();
  }
  AddSubjects(folder, file, notes);
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
