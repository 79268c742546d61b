// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/trial_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "problems/io/staged_folder.h"
#include "surfaces/base/encoding.h"
#include "surfaces/base/error.h"
#include "surfaces/base/geometry.h"
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

// Returns true if the member is a text or missing.
bool IsTextOrMissing(const Json& json, const char* key) {
  return !json.contains(key) || json[key].is_string();
}

// Returns the first mismatch between the files and the hashes in `list`, or "".
std::string FindHashFault(const fs::path& trial, std::span<const fs::path> files,
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

std::string FindFileFault(const fs::path& trial, std::span<const fs::path> files,
                          const Json& trial_json) {
  const std::string fault = FindHashFault(trial, files, trial_json.value("files", Json()));
  const Json manifest = fault.empty() && FileExists(trial / "manifest.json")
                            ? ParsedOrNull(trial / "manifest.json")
                            : Json::object();
  if (!fault.empty() || !manifest.is_object()) {
    return fault.empty() ? "manifest.json cannot be read" : fault;
  }
  return FindHashFault(trial, files, manifest.value("outputs", Json()));
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

// Collects TrialNumbers during the parse of a trial.json. A member that returns false ends the
// parse.
class TrialHandler : public nlohmann::json_sax<Json> {
 public:
  TrialNumbers TakeNumbers() { return std::move(trial_); }

  bool null() override { return lists_open_ > 0 ? Number(kNaN) : IsInObject() && IsNotText(); }
  bool boolean(bool) override { return IsInObject() && IsNotText(); }
  bool number_integer(number_integer_t value) override {
    return Number(static_cast<double>(value));
  }
  bool number_unsigned(number_unsigned_t value) override {
    return Number(static_cast<double>(value));
  }
  bool number_float(number_float_t value, const string_t&) override { return Number(value); }
  bool binary(binary_t&) override { return false; }

  bool string(string_t& value) override {
    if (std::string* place = TextPlace()) {
      *place = std::move(value);
    }
    return IsInObject();
  }
  bool key(string_t& name) override {
    path_.resize(path_lengths_.back());
    path_ += (path_.empty() ? "" : ".") + name;
    return true;
  }

  bool start_object(std::size_t) override {
    const bool go_on = IsNotText();
    path_lengths_.push_back(path_.size());
    return go_on;
  }
  bool end_object() override { return End(); }
  bool start_array(std::size_t) override {
    ++lists_open_;
    const bool go_on = IsInObject() && IsNotText();
    path_lengths_.push_back(path_.size());
    return go_on;
  }
  bool end_array() override {
    --lists_open_;
    return End();
  }

  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override {
    return false;
  }

 private:
  // Returns the place for the text at the current path, or null if that text is not kept.
  std::string* TextPlace() {
    return path_lengths_.size() != 1 ? nullptr
           : path_ == "id"           ? &trial_.id
           : path_ == "status"       ? &trial_.status
           : path_ == "reason"       ? &trial_.reason
                                     : nullptr;
  }
  bool IsInObject() const { return !path_lengths_.empty(); }  // trial.json itself is an object
  bool IsNotText() { return TextPlace() == nullptr; }

  bool Number(double value) {
    constexpr std::string_view kResult = "result.";
    if (path_.starts_with(kResult)) {
      if (lists_open_ > 0) {
        trial_.lists[path_.substr(kResult.size())].push_back(value);
      } else {
        trial_.metrics[path_.substr(kResult.size())] = value;
      }
    }
    return IsInObject() && IsNotText();
  }

  bool End() {
    path_.resize(path_lengths_.back());
    path_lengths_.pop_back();
    return true;
  }

  TrialNumbers trial_;
  std::string path_;  // path of the next value
  std::vector<std::size_t>
      path_lengths_;  // length of path_ at the start of each open list or object
  int lists_open_ = 0;
};

}  // namespace

fs::path TrialFolder(const fs::path& study, const std::string& id) { return study / "trials" / id; }

fs::path WritableTrialFolder(const fs::path& study, const std::string& id) {
  RefuseLinksBelow(study, fs::path("trials") / id);
  return TrialFolder(study, id);
}

std::optional<Json> ReadTrialFile(const fs::path& study, const std::string& id) {
  const fs::path file = TrialFolder(study, id) / kTrialFile;
  if (!FileExists(file)) {
    return std::nullopt;
  }
  Json json = ParsedOrNull(file);
  const bool is_whole = json.is_object() && json.value("id", Json()) == id &&
                        IsTextOrMissing(json, "status") && IsTextOrMissing(json, "reason");
  return is_whole ? std::optional(std::move(json)) : std::nullopt;
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
    fault = FindFileFault(trial, files, *json);
  }
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

std::optional<TrialNumbers> ReadTrialNumbers(std::string_view text) {
  try {
    CheckJsonDepth(text);
  } catch (const IoError&) {
    return std::nullopt;
  }
  TrialHandler handler;
  return Json::sax_parse(text, &handler) ? std::optional(handler.TakeNumbers()) : std::nullopt;
}

}  // namespace semblance::problems
