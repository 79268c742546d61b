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

// ---------------------------------------------------------------------------------------------
// The hash of a trial.json
// ---------------------------------------------------------------------------------------------

constexpr const char* kOwnHash = "trial_sha256";
constexpr std::array kMadeBy = {"version", "program", "libraries"};

std::string ThisBuild() {
  constexpr std::size_t kDigits = 12;
  return ProgramHash().substr(0, kDigits);
}

// JSON without the blanks between its tokens, so that a program that writes the same members in
// other lines keeps the hash.
std::string WithoutBlanks(std::string_view json) {
  std::string bare;
  bool in_text = false;
  for (std::size_t k = 0; k < json.size(); ++k) {
    const char c = json[k];
    if (in_text && c == '\\' && k + 1 < json.size()) {
      bare.append(json.substr(k++, 2));
      continue;
    }
    in_text ^= c == '"';
    if (in_text || (c != ' ' && c != '\n' && c != '\r' && c != '\t')) {
      bare += c;
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
    } else if (path_ == "files.file") {
      trial_.files.emplace_back().name = std::move(value);
    } else if (path_ == "files.sha256" && !trial_.files.empty()) {
      trial_.files.back().sha256 = std::move(value);
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
           : path_ == "version"      ? &trial_.version
           : path_ == "program"      ? &trial_.program
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
    } else if (path_ == "files.bytes" && !trial_.files.empty()) {
      trial_.files.back().bytes = value;
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

StoredTrial ReadTrial(const fs::path& study, const std::string& id, TrialCheck check) {
  const fs::path file = TrialFolder(study, id) / kTrialFile;
  if (!FileExists(file)) {
    return {};
  }
  StoredTrial stored;
  try {
    const std::string text = ReadFileBytes(file);
    std::optional<TrialNumbers> numbers = ReadTrialNumbers(text);
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
  constexpr TrialCheck kFast = TrialCheck::kSizes;
  return ReadTrial(study, id, kFast).numbers
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
  fault = fault.empty() ? ReadTrial(from, id, TrialCheck::kAll).fault : fault;
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
