// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/population/population_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "problems/config/config.h"
#include "problems/output/file_hashes.h"
#include "problems/population/population_folder.h"
#include "problems/subject/sites.h"
#include "surfaces/base/encoding.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kIdDigits = 12;

bool IsMissing(const PopulationSubject& subject) {
  const std::vector<NamedFile> files = NamedFiles(subject);
  return std::ranges::any_of(files, [](const NamedFile& named) { return !fs::exists(named.file); });
}

std::vector<fs::path> FilesBehind(const fs::path& path) {
  return fs::is_directory(path) ? VolumeFiles(path) : std::vector{path};
}

// The options as text, each file by its content and not by where it lies.
template <class Options>
std::string Fingerprint(const Options& options, FileHashes& hashes) {
  std::string text = ToFlowYaml(ConfigTreeOf(options));
  for (const NamedFile& named : NamedFiles(options)) {
    std::string content;
    for (const fs::path& part : FilesBehind(named.file)) {
      content += hashes.Of(part);
    }
    const std::string name = named.file.string();
    for (std::size_t at = text.find(name); at != text.npos; at = text.find(name, at)) {
      text.replace(at, name.size(), content);
    }
  }
  return text;
}

// The same whatever the population says of the person, who is not measured anew for it.
PopulationSubject WithoutPerson(PopulationSubject subject) {
  subject.optional = false;
  subject.sex.reset();
  subject.build.reset();
  subject.age_years.reset();
  subject.bmi.reset();
  return subject;
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
    if (entry.subject.name.empty() || !names.insert(entry.subject.name).second) {
      throw InputError(fmt::format(
          "subjects: the name '{}' is empty or appears twice; each subject needs one of its own",
          entry.subject.name));
    }
  }
}

// Subjects that can serve those without landmarks.
void FindReferences(const std::vector<PopulationSubject>& subjects, PopulationFile& file) {
  constexpr std::size_t kMost = 3;
  for (const PopulationSubject& subject : subjects) {
    const auto* files = std::get_if<FileSubject>(&subject.subject);
    if (files != nullptr && !files->landmarks.empty() && file.measure.references.size() < kMost) {
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

}  // namespace

std::string ComplaintAboutCodes(const std::vector<std::string>& codes) {
  for (const std::string& code : codes) {
    const bool is_known = std::ranges::any_of(
        AllSites(), [&](const Site& site) { return site.code == code || site.landmark == code; });
    if (!is_known) {
      return ComplaintAboutLandmark(code);
    }
  }
  return "";
}

PopulationPlan ReadPopulation(const fs::path& path) {
  PopulationPlan plan;
  plan.file = fs::is_directory(path) ? FolderPopulation(path, plan.notes)
                                     : ReadConfig<PopulationFile>(path);
  std::vector<PopulationSubject> subjects;
  for (const PopulationSubject& subject : plan.file.subjects) {
    if (subject.optional && IsMissing(subject)) {
      plan.notes.push_back(fmt::format("{}: its files are not there; left out", subject.name));
    } else {
      subjects.push_back(subject);
    }
  }
  if (plan.file.measure.references.empty()) {
    FindReferences(subjects, plan.file);
  }
  std::ranges::copy(Phantoms(plan.file.phantoms), std::back_inserter(subjects));
  FileHashes hashes;
  MeasureOptions without = plan.file.measure;
  without.references.clear();
  const std::string marked = Fingerprint(without, hashes);
  const bool all_marked = std::ranges::all_of(subjects, HasLandmarks);
  const std::string open = all_marked ? marked : Fingerprint(plan.file.measure, hashes);
  for (const PopulationSubject& subject : subjects) {
    const std::string text = Fingerprint(WithoutPerson(subject), hashes) + "\n" +
                             (HasLandmarks(subject) ? marked : open);
    plan.entries.push_back({subject, Sha256OfText(text).substr(0, kIdDigits)});
  }
  CheckNames(plan.entries);
  if (plan.file.subjects.empty() && plan.file.phantoms.count == 0) {
    throw InputError(fmt::format("{}: it names no subjects and no phantoms", path.string()));
  }
  return plan;
}

std::vector<NamedFile> NamedInputsOf(const PopulationFile& file) {
  PopulationFile needed = file;
  for (PopulationSubject& subject : needed.subjects) {
    if (subject.optional) {
      subject.subject = PhantomOptions{};
    }
  }
  return NamedFiles(needed);
}

}  // namespace semblance
