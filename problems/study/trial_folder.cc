// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/trial_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "problems/config/terminal_text.h"
#include "problems/io/manifest.h"
#include "problems/io/staged_folder.h"
#include "surfaces/base/encoding.h"
#include "surfaces/base/error.h"
#include "surfaces/base/json_text.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kTrialFile = "trial.json";

// Returns null if the file is not JSON.
Json ParsedOrNull(const fs::path& file) {
  try {
    return ParseJson(ReadFileBytes(file), file.string());
  } catch (const IoError&) {
    return nullptr;
  }
}

bool FileExists(const fs::path& file) {
  std::error_code ignored;
  return fs::exists(file, ignored);
}

// ---------------------------------------------------------------------------------------------
// The hash of a trial.json
// ---------------------------------------------------------------------------------------------

constexpr const char* kOwnHash = "trial_sha256";
constexpr std::array kMadeBy = {"version", "program", "libraries"};

std::string ThisBuild() {
  constexpr std::size_t kDigits = 12;
  return ProgramHash().substr(0, kDigits);
}

bool IsBlank(char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; }

// Returns the place after the text in quotes that begins at `at`.
std::size_t FindTextEnd(std::string_view json, std::size_t at) {
  for (++at; at < json.size() && json[at] != '"'; ++at) {
    at += json[at] == '\\' ? 1 : 0;
  }
  return std::min(at + 1, json.size());
}

// JSON without the blanks between its tokens, so that a program that writes the same members in
// other lines keeps the hash.
std::string WithoutBlanks(std::string_view json) {
  std::string bare;
  bare.reserve(json.size());
  for (std::size_t begin = 0, at = 0; at < json.size(); begin = at) {
    while (at < json.size() && !IsBlank(json[at])) {
      at = json[at] == '"' ? FindTextEnd(json, at) : at + 1;
    }
    bare.append(json.substr(begin, at - begin));
    while (at < json.size() && IsBlank(json[at])) {
      ++at;
    }
  }
  return bare;
}

// Compares the text with its own hash. Trials of versions before 1.1 have none; the tables report
// them by their version.
bool HasOwnHash(std::string_view text, const std::string& version) {
  const std::string bare = WithoutBlanks(text), mark = fmt::format(",\"{}\":\"", kOwnHash);
  const std::size_t at = bare.rfind(mark);
  if (at == bare.npos) {
    return !version.empty() && version != SEMBLANCE_VERSION;
  }
  const std::string hash = Sha256OfText(bare.substr(0, at));
  return bare.compare(at + mark.size(), hash.size(), hash) == 0;
}

// ---------------------------------------------------------------------------------------------
// The files of a trial
// ---------------------------------------------------------------------------------------------

// True for a name that leads to a file below the trial's folder by no link.
bool IsFileBelow(const fs::path& trial, const fs::path& name) {
  std::error_code ignored;
  fs::path at = trial;
  for (const fs::path& part : name) {
    at /= part;
    if (part == ".." || fs::is_symlink(fs::symlink_status(at, ignored))) {
      return false;
    }
  }
  return !name.is_absolute() && fs::is_regular_file(at, ignored);
}

// Returns the first mismatch between a file and its entry, or "".
std::string FindFileFault(const fs::path& trial, const TrialFile& file, bool reads_bytes) {
  const fs::path path = trial / file.name;
  if (!IsFileBelow(trial, file.name)) {
    return fmt::format("{} is missing", file.name);
  }
  const auto bytes = static_cast<double>(fs::file_size(path));
  if (std::isfinite(file.bytes) && bytes != file.bytes) {
    return fmt::format("{} has {} bytes instead of {}", file.name, bytes, file.bytes);
  }
  return reads_bytes && Sha256OfFile(path) != file.sha256
             ? fmt::format("{} is not what was written", file.name)
             : "";
}

std::string FindFileFault(const fs::path& trial, std::span<const TrialFile> files,
                          TrialCheck check) {
  constexpr std::array<std::string_view, 2> kShown = {"scene.json", "depth.png"};
  for (const TrialFile& file : files) {
    const bool reads_bytes =
        check == TrialCheck::kAll ||
        (check == TrialCheck::kShown && std::ranges::find(kShown, file.name) != kShown.end());
    if (std::string fault = FindFileFault(trial, file, reads_bytes); !fault.empty()) {
      return fault;
    }
  }
  return "";
}

// The outputs that the manifest of a run lists.
std::vector<TrialFile> ListOutputs(const Json& manifest) {
  std::vector<TrialFile> files;
  const Json list = manifest.value("outputs", Json());
  for (const Json& entry : list.is_array() ? list : Json::array()) {
    const auto text = [&](const char* key) {
      const Json value = entry.is_object() ? entry.value(key, Json()) : Json();
      return value.is_string() ? value.get<std::string>() : "";
    };
    files.push_back({.name = text("file"), .sha256 = text("sha256")});
  }
  return files;
}

std::string FindManifestFault(const fs::path& trial) {
  if (!FileExists(trial / "manifest.json")) {
    return "";
  }
  const Json manifest = ParsedOrNull(trial / "manifest.json");
  return manifest.is_object() ? FindFileFault(trial, ListOutputs(manifest), TrialCheck::kAll)
                              : "manifest.json cannot be read";
}

// Lists the files of a folder, relative to it, trial.json last. Returns a fault if the folder holds
// anything but plain files and folders, else "".
std::string ListFiles(const fs::path& trial, std::vector<fs::path>& files) {
  if (fs::is_symlink(trial)) {
    return "it is a link";
  }
  for (const auto& entry : fs::recursive_directory_iterator(trial)) {
    const fs::path name = entry.path().lexically_relative(trial);
    const fs::file_status status = entry.symlink_status();
    if (fs::is_regular_file(status) && name != kTrialFile) {
      files.push_back(name);
    } else if (!fs::is_regular_file(status) && !fs::is_directory(status)) {
      return fmt::format("{} is a link or a device", name.string());
    }
  }
  std::sort(files.begin(), files.end());
  files.emplace_back(kTrialFile);
  return "";
}

}  // namespace

fs::path TrialFolder(const fs::path& study, const std::string& id) { return study / "trials" / id; }

fs::path WritableTrialFolder(const fs::path& study, const std::string& id) {
  RefuseLinksBelow(study, fs::path("trials") / id);
  return TrialFolder(study, id);
}

bool IsOfThisProgram(const TrialNumbers& trial) {
  return trial.version == SEMBLANCE_VERSION && trial.program == ThisBuild();
}

std::string TrialText(Json json, Maker maker) {
  Json made_by = Json::object();
  if (maker == Maker::kThisProgram) {
    made_by = {
        {"version", SEMBLANCE_VERSION}, {"program", ThisBuild()}, {"libraries", Json::object()}};
    for (const auto& [name, version] : LibraryVersions()) {
      made_by["libraries"][name] = version;
    }
  }
  for (const char* name : kMadeBy) {
    if (maker == Maker::kAsBefore && json.contains(name)) {
      made_by[name] = json[name];
    }
    json.erase(name);
  }
  json.erase(kOwnHash);
  json = WithPlainTexts(json);
  std::string before = json.dump();
  before.pop_back();  // the brace at the end
  json[kOwnHash] = Sha256OfText(before);
  json.update(made_by);
  return json.dump(1) + "\n";
}

StoredTrial ReadTrial(const fs::path& study, const std::string& id, TrialCheck check,
                      SharedNames& names) {
  const fs::path file = TrialFolder(study, id) / kTrialFile;
  if (!FileExists(file)) {
    return {};
  }
  StoredTrial stored;
  try {
    const std::string text = ReadFileBytes(file);
    std::optional<TrialNumbers> numbers = ReadTrialNumbers(text, names);
    stored.fault = !numbers                              ? "trial.json cannot be read"
                   : numbers->id != id                   ? "trial.json is of another trial"
                   : !HasOwnHash(text, numbers->version) ? "trial.json is not what was written"
                                                         : "";
    if (stored.fault.empty()) {
      stored.fault = FindFileFault(TrialFolder(study, id), numbers->files, check);
    }
    if (stored.fault.empty()) {
      stored.numbers = std::move(numbers);
    }
  } catch (const std::exception& error) {  // of IoError and of the file system
    stored.fault = error.what();
  }
  return stored;
}

std::optional<Json> ReadTrialFile(const fs::path& study, const std::string& id) {
  SharedNames none([](std::string_view) { return false; });
  return ReadTrial(study, id, TrialCheck::kSizes, none).numbers
             ? std::optional(ParsedOrNull(TrialFolder(study, id) / kTrialFile))
             : std::nullopt;
}

StoredPlan ReadStoredPlan(const fs::path& study) {
  const fs::path file = study / "plan.json";
  if (!FileExists(file)) {
    return {};
  }
  const Json json = ParsedOrNull(file);
  if (!json.is_object() || !json.contains("hash") || !json["hash"].is_string()) {
    throw IoError(fmt::format(
        "{}: not the plan of a study; choose another folder, or delete this file: the study then "
        "continues with the existing trials",
        file.string()));
  }
  StoredPlan plan{.hash = json["hash"].get<std::string>(), .ids = {}};
  const Json trials = json.value("trials", Json());
  for (const Json& trial : trials.is_array() ? trials : Json::array()) {
    if (trial.is_object() && trial.contains("id") && trial["id"].is_string()) {
      plan.ids.push_back(trial["id"].get<std::string>());
    }
  }
  return plan;
}

std::string ReadPlanHash(const fs::path& study) { return ReadStoredPlan(study).hash; }

Json ListHashes(const fs::path& trial, const std::vector<std::string>& names) {
  Json list = Json::array();
  for (const std::string& name : names) {
    list.push_back({{"file", name},
                    {"bytes", fs::file_size(trial / name)},
                    {"sha256", Sha256OfFile(trial / name)}});
  }
  return list;
}

std::string CopyTrial(const fs::path& from, const fs::path& to, const std::string& id) {
  const fs::path trial = TrialFolder(from, id);
  if (!FileExists(trial / kTrialFile)) {
    return "trial.json is missing";
  }
  std::vector<fs::path> files;
  std::string fault = ListFiles(trial, files);
  SharedNames none([](std::string_view) { return false; });
  fault = fault.empty() ? ReadTrial(from, id, TrialCheck::kAll, none).fault : fault;
  fault = fault.empty() ? FindManifestFault(trial) : fault;
  if (!fault.empty()) {
    return fault;
  }
  StagedFolder copy(WritableTrialFolder(to, id), WhenNotEmpty::kReplaceFiles);
  for (const fs::path& name : files) {
    copy.Files().Write(name.generic_string(), ReadFileBytes(trial / name), Durability::kUnsynced);
  }
  copy.Publish(Durability::kUnsynced);  // what a power failure takes can be copied again
  return "";
}

}  // namespace semblance::problems
