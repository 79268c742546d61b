// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/trial_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <span>

#include "problems/output/staged_folder.h"
#include "surfaces/base/encoding.h"
#include "surfaces/base/error.h"
#include "surfaces/base/json_text.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kTrialFile = "trial.json";

// Null for what is no JSON.
Json ParsedOrNull(const fs::path& file) {
  try {
    return ParseJson(ReadFileBytes(file), file.string());
  } catch (const IoError&) {
    return nullptr;
  }
}

bool IsThere(const fs::path& file) {
  std::error_code ignored;
  return fs::exists(file, ignored);
}

// A member that is a text, if it is there at all.
bool IsTextOrMissing(const Json& json, const char* key) {
  return !json.contains(key) || json[key].is_string();
}

// Why the hashes that `list` states do not hold; empty if they do.
std::string FaultOfHashes(const fs::path& trial, std::span<const fs::path> files,
                          const Json& list) {
  for (const Json& entry : list.is_array() ? list : Json::array()) {
    const bool is_named = entry.is_object() && entry.contains("file") && entry["file"].is_string();
    const std::string name = is_named ? entry["file"].get<std::string>() : "";
    if (std::ranges::find(files, fs::path(name)) == files.end()) {
      return fmt::format("{} is missing", name);
    }
    if (entry.value("sha256", Json()) != Sha256OfFile(trial / name)) {
      return fmt::format("{} is not what was written", name);
    }
  }
  return "";
}

std::string FaultOfFiles(const fs::path& trial, std::span<const fs::path> files,
                         const Json& trial_json) {
  const std::string fault = FaultOfHashes(trial, files, trial_json.value("files", Json()));
  const Json manifest = fault.empty() && IsThere(trial / "manifest.json")
                            ? ParsedOrNull(trial / "manifest.json")
                            : Json::object();
  if (!fault.empty() || !manifest.is_object()) {
    return fault.empty() ? "manifest.json cannot be read" : fault;
  }
  return FaultOfHashes(trial, files, manifest.value("outputs", Json()));
}

// The files of a folder, relative to it, trial.json last; a complaint where not all are plain
// files.
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

std::optional<Json> ReadTrialFile(const fs::path& study, const std::string& id) {
  const fs::path file = TrialFolder(study, id) / kTrialFile;
  if (!IsThere(file)) {
    return std::nullopt;
  }
  Json json = ParsedOrNull(file);
  const bool is_whole = json.is_object() && json.value("id", Json()) == id &&
                        IsTextOrMissing(json, "status") && IsTextOrMissing(json, "reason");
  return is_whole ? std::optional(std::move(json)) : std::nullopt;
}

PlanThere ReadPlanThere(const fs::path& study) {
  const fs::path file = study / "plan.json";
  if (!IsThere(file)) {
    return {};
  }
  const Json json = ParsedOrNull(file);
  if (!json.is_object() || !json.contains("hash") || !json["hash"].is_string()) {
    throw IoError(fmt::format(
        "{}: not the plan of a study; choose another folder, or delete this file, and the study "
        "goes on with the trials that are there",
        file.string()));
  }
  PlanThere there{.hash = json["hash"].get<std::string>(), .ids = {}};
  const Json trials = json.value("trials", Json());
  for (const Json& trial : trials.is_array() ? trials : Json::array()) {
    if (trial.is_object() && trial.contains("id") && trial["id"].is_string()) {
      there.ids.push_back(trial["id"].get<std::string>());
    }
  }
  return there;
}

std::string PlanHashOf(const fs::path& study) { return ReadPlanThere(study).hash; }

Json HashesOf(const fs::path& trial, const std::vector<std::string>& names) {
  Json list = Json::array();
  for (const std::string& name : names) {
    list.push_back({{"file", name}, {"sha256", Sha256OfFile(trial / name)}});
  }
  return list;
}

std::string CopyTrial(const fs::path& from, const fs::path& to, const std::string& id) {
  const fs::path trial = TrialFolder(from, id);
  const std::optional<Json> json = ReadTrialFile(from, id);
  std::vector<fs::path> files;
  std::string fault = json ? ListFiles(trial, files) : "it is not whole";
  if (fault.empty()) {
    fault = FaultOfFiles(trial, files, *json);
  }
  if (!fault.empty()) {
    return fault;
  }
  StagedFolder copy(TrialFolder(to, id), WhenNotEmpty::kReplaceFiles);
  for (const fs::path& name : files) {
    copy.Files().Write(name.generic_string(), ReadFileBytes(trial / name), Durability::kUnsynced);
  }
  copy.Publish(Durability::kUnsynced);  // what a power failure takes can be copied again
  return "";
}

}  // namespace semblance
