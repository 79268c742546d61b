// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/population/population_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>

#include "problems/config/config.h"
#include "problems/config/spelling_suggestion.h"
#include "problems/config/utf8_check.h"
#include "problems/experiment/input_contents.h"
#include "problems/io/volumes/read_volume.h"
#include "problems/subject/propose/mean_skull_files.h"
#include "problems/subject/sites.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/csv.h"
#include "surfaces/base/encoding.h"
#include "surfaces/base/error.h"
#include "surfaces/base/lower_case.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kIdDigits = 12;

bool IsMissing(const PopulationSubject& subject) {
  const std::vector<NamedFile> files = NamedFiles(subject);
  return std::ranges::any_of(files, [](const NamedFile& named) { return !fs::exists(named.file); });
}

// The options as text, in which the contents of files replace their paths.
template <class Options>
std::string Fingerprint(const Options& options, FileHashes& hashes) {
  return ToFlowYaml(WithInputs(MakeConfigTree(options), NamedFiles(options),
                               [&](const NamedFile& input) { return HashContent(input, hashes); }));
}

// Removes the fields that do not affect the measurement, so that a change of them keeps the id.
PopulationSubject WithoutPerson(PopulationSubject subject) {
  subject.optional = false;
  subject.sex.reset();
  subject.build.reset();
  subject.age_years.reset();
  subject.bmi.reset();
  return subject;
}

// A subject with a fault is not read; its name stands for its content.
std::string DescribeSubject(const PopulationSubject& subject, FileHashes& hashes) {
  return subject.fault.empty() ? Fingerprint(WithoutPerson(subject), hashes)
                               : subject.name + "\n" + subject.fault;
}

// The options by which subjects with landmarks are measured, as text.
std::string DescribeMarked(MeasureOptions options, FileHashes& hashes) {
  options.references.clear();
  return Fingerprint(options, hashes);
}

// The options by which subjects without landmarks are measured, as text. The mean skull is part of
// it if it proposes them.
std::string DescribeOpen(const MeasureOptions& options, FileHashes& hashes) {
  std::string text = Fingerprint(options, hashes);
  if (options.references.empty()) {
    for (const std::string_view file : {MeanSkullMesh(), MeanSkullModes(), MeanSkullSites()}) {
      text += "\n" + Sha256OfText(file);
    }
  }
  return text;
}

std::vector<PopulationSubject> Phantoms(const PhantomCrowd& crowd) {
  std::vector<PopulationSubject> subjects;
  for (int k = 0; k < crowd.count; ++k) {
    PhantomOptions one = crowd.like;
    one.random_seed += k;
    subjects.push_back(
        {.name = fmt::format("phantom {}", one.random_seed), .subject = one, .scan = crowd.scan});
  }
  return subjects;
}

void CheckNames(const std::vector<PopulationEntry>& entries) {
  std::set<std::string> names;
  for (const PopulationEntry& entry : entries) {
    if (entry.subject.name.empty() || !names.insert(Normalized(entry.subject.name)).second) {
      throw InputError(fmt::format(
          "subjects: the name '{}' is empty or appears twice; each subject needs one of its own",
          entry.subject.name));
    }
  }
}

// Chooses subjects with landmarks as references for subjects without.
void FindReferences(const std::vector<PopulationSubject>& subjects, PopulationFile& file) {
  constexpr std::size_t kMaxReferences = 3;  // each costs a warp per subject without landmarks
  for (const PopulationSubject& subject : subjects) {
    const auto* files = std::get_if<FileSubject>(&subject.subject);
    if (files != nullptr && !files->landmarks.empty() &&
        file.measure.references.size() < kMaxReferences) {
      file.measure.references.push_back({files->skull, files->landmarks});
    }
  }
}

bool HasLandmarks(const PopulationSubject& subject) {
  if (const auto* files = std::get_if<FileSubject>(&subject.subject)) {
    return !files->landmarks.empty();
  }
  const auto* ct = std::get_if<CtSubject>(&subject.subject);
  return ct == nullptr || !ct->landmarks.empty();
}

bool IsFolder(const fs::path& entry) {
  std::error_code ignored;  // an entry that cannot be reached is reported when it is read
  return fs::is_directory(entry, ignored);
}

std::vector<fs::path> Sorted(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> entries;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    entries.push_back(at->path());
  }
  if (error) {
    throw IoError(fmt::format("the folder cannot be read: {}", error.message()));
  }
  std::ranges::sort(entries);
  return entries;
}

// Finds the entry of that name, in upper or lower case, with one of the endings; empty if there is
// none.
fs::path FindEntry(const std::vector<fs::path>& entries, const std::string& name,
                   const std::vector<std::string>& endings) {
  std::vector<fs::path> found;
  for (const fs::path& entry : entries) {
    const std::string lower = LowerCase(entry.filename().string());
    if (std::ranges::any_of(endings, [&](const auto& ending) { return lower == name + ending; })) {
      found.push_back(entry);
    }
  }
  if (found.size() > 1) {
    throw InputError(fmt::format("both {} and {} are there; keep one", found[0].filename().string(),
                                 found[1].filename().string()));
  }
  return found.empty() ? fs::path() : found[0];
}

fs::path FindVolume(const std::vector<fs::path>& entries) {
  std::vector<fs::path> folders;
  std::ranges::copy_if(entries, std::back_inserter(folders),
                       [](const fs::path& entry) { return IsFolder(entry); });
  for (const char* name : {"ct", "dicom"}) {
    if (fs::path folder = FindEntry(folders, name, {""}); !folder.empty()) {
      return folder;
    }
  }
  return FindEntry(entries, "volume",
                   {".nii", ".nii.gz", ".nrrd", ".nhdr", ".mha", ".mhd", ".inv3"});
}

// The subject in a folder; nothing if the folder contains none. Throws InputError if the folder
// contains a part of a subject, or a part twice.
std::optional<Subject> FindSubject(const fs::path& folder, const CtImportOptions& import) {
  const std::vector<std::string> meshes = {".ply", ".obj", ".stl", ".off"};
  const std::vector<fs::path> entries = Sorted(folder);
  const fs::path landmarks = FindEntry(
      entries, "landmarks", {".yaml", ".yml", ".mrk.json", ".fcsv", ".pp", ".txt", ".asc", ".csv"});
  const fs::path skull = FindEntry(entries, "skull", meshes),
                 skin = FindEntry(entries, "skin", meshes);
  if (skull.empty() != skin.empty()) {
    throw InputError(fmt::format("it has a {} and no {}; a depth needs both",
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
  const fs::path volume = FindVolume(entries);
  if (volume.empty()) {
    return std::nullopt;
  }
  CtSubject ct;
  ct.volume = volume;
  ct.landmarks = landmarks;
  ct.import = import;
  return ct;
}

bool IsHidden(const fs::path& entry) { return entry.filename().string().starts_with('.'); }

bool IsVolumeFile(const fs::path& entry) {
  return !IsFolder(entry) && !IsHidden(entry) &&
         (FindVolumeFormat(entry) || LowerCase(entry.extension().string()) == ".inv3");
}

// The file's name without its ending, of which ".nii.gz" is one.
std::string VolumeName(const fs::path& file) {
  const bool is_packed = LowerCase(file.extension().string()) == ".gz";
  return (is_packed ? file.stem() : file).stem().string();
}

PopulationSubject MakeVolumeSubject(const fs::path& file, const CtImportOptions& import) {
  CtSubject ct;
  ct.volume = file;
  ct.import = import;
  return {.name = VolumeName(file), .subject = ct};
}

// The subject of a folder. Nothing, with a note, if the folder contains none.
std::optional<PopulationSubject> ReadSubjectFolder(const fs::path& folder,
                                                   const CtImportOptions& import,
                                                   std::vector<std::string>& notes) try {
  const std::string name = folder.filename().string();
  if (auto subject = FindSubject(folder, import)) {
    return PopulationSubject{.name = name, .subject = std::move(*subject)};
  }
  if (!IsHidden(folder)) {
    notes.push_back(fmt::format(
        "{}: skipped; it contains no skull and skin, and no volume, ct or dicom", name));
  }
  return std::nullopt;
} catch (const Error& error) {
  if (IsHidden(folder)) {
    return std::nullopt;
  }
  CtSubject unread;
  unread.volume = folder;
  return PopulationSubject{
      .name = folder.filename().string(), .subject = unread, .fault = error.what()};
}

// The subject of an entry of the folder; nothing for other files, such as a text or a table.
std::optional<PopulationSubject> ReadEntry(const fs::path& entry, const CtImportOptions& import,
                                           std::vector<std::string>& notes) {
  if (IsFolder(entry)) {
    return ReadSubjectFolder(entry, import, notes);
  }
  return IsVolumeFile(entry) ? std::optional(MakeVolumeSubject(entry, import)) : std::nullopt;
}

// Adds the subjects in a folder, and a note for each folder without a subject.
void AddSubjects(const fs::path& folder, PopulationFile& file, std::vector<std::string>& notes) {
  std::map<std::string, fs::path> entry_of_name;
  for (const fs::path& entry : Sorted(folder)) {
    auto subject = ReadEntry(entry, file.import, notes);
    if (!subject) {
      continue;
    }
    const auto [other, is_new] = entry_of_name.emplace(Normalized(subject->name), entry.filename());
    if (!is_new) {
      throw InputError(fmt::format(
          "{}: {} and {} are both the subject '{}'; rename one of them or move it away",
          folder.string(), other->second.string(), entry.filename().string(), subject->name));
    }
    file.subjects.push_back(std::move(*subject));
  }
}

template <class E>
std::optional<E> ReadWord(const CsvReader& csv, const char* column) {
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

// A visitor that finds the FieldInfo of one option.
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

// Reads a number within the range that a configuration allows.
std::optional<double> ReadNumber(const CsvReader& csv, const char* column) {
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
  csv.RequireColumn("name");
}

// The subject of a row; each subject may have one row.
PopulationSubject& FindPerson(const CsvReader& csv, std::set<std::string>& had,
                              std::vector<PopulationSubject>& subjects) {
  const std::string name(csv.Cell(csv.RequireColumn("name")));
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
    PopulationSubject& subject = FindPerson(csv, had, subjects);
    SetIfKnown(ReadWord<Sex>(csv, "sex"), subject.sex);
    SetIfKnown(ReadWord<Build>(csv, "build"), subject.build);
    SetIfKnown(ReadNumber(csv, "age_years"), subject.age_years);
    SetIfKnown(ReadNumber(csv, "bmi"), subject.bmi);
  }
}

PopulationFile ReadPopulationFolder(const fs::path& given, std::vector<std::string>& notes) {
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
        "{}: it contains no subject; each subject needs a volume (.nrrd, .nii.gz, .mha ...), or a "
        "folder with skull.ply and skin.ply, or with volume.nii.gz or ct/ (DICOM)",
        folder.string()));
  }
  if (fs::exists(folder / "subjects.csv")) {
    AddPersons(folder / "subjects.csv", file.subjects);
  }
  return file;
}

}  // namespace

std::string SiteCodesFault(const std::vector<std::string>& codes) {
  for (const std::string& code : codes) {
    const bool is_known = std::ranges::any_of(
        AllSites(), [&](const Site& site) { return site.code == code || site.landmark == code; });
    if (!is_known) {
      return SiteFault(code);
    }
  }
  return "";
}

PopulationPlan ReadPopulation(const fs::path& path) {
  PopulationPlan plan;
  plan.file = fs::is_directory(path) ? ReadPopulationFolder(path, plan.notes)
                                     : ReadConfig<PopulationFile>(path);
  std::vector<PopulationSubject> subjects;
  for (const PopulationSubject& subject : plan.file.subjects) {
    if (subject.optional && IsMissing(subject)) {
      plan.notes.push_back(fmt::format("{}: its files are missing; left out", subject.name));
    } else {
      subjects.push_back(subject);
    }
  }
  if (plan.file.measure.references.empty()) {
    FindReferences(subjects, plan.file);
  }
  std::ranges::copy(Phantoms(plan.file.phantoms), std::back_inserter(subjects));
  FileHashes hashes;
  const std::string marked = DescribeMarked(plan.file.measure, hashes);
  const bool all_marked = std::ranges::all_of(subjects, HasLandmarks);
  const std::string open = all_marked ? marked : DescribeOpen(plan.file.measure, hashes);
  for (const PopulationSubject& subject : subjects) {
    const std::string text =
        DescribeSubject(subject, hashes) + "\n" + (HasLandmarks(subject) ? marked : open);
    plan.entries.push_back({subject, Sha256OfText(text).substr(0, kIdDigits)});
  }
  CheckNames(plan.entries);
  if (plan.file.subjects.empty() && plan.file.phantoms.count == 0) {
    throw InputError(
        fmt::format("{}: it names no subjects and no phantoms; name at least one", path.string()));
  }
  return plan;
}

std::vector<NamedFile> NamedInputs(const PopulationFile& file) {
  PopulationFile needed = file;
  for (PopulationSubject& subject : needed.subjects) {
    if (subject.optional) {
      subject.subject = PhantomOptions{};
    }
  }
  return NamedFiles(needed);
}

}  // namespace semblance::problems
