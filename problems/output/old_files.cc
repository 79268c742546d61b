// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/output/old_files.h"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <system_error>

#include "surfaces/base/encoding.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

bool IsRegular(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

// A manifest may say anything.
bool LeadsOut(const fs::path& name) {
  return name.is_absolute() || std::ranges::find(name, fs::path("..")) != name.end();
}

bool HasBytes(const fs::path& file, const std::string& sha256) try {
  return IsRegular(file) && Sha256OfFile(file) == sha256;
} catch (const Error&) {  // it cannot be read, so it is not known
  return false;
}

struct ManifestLine {
  std::string file, sha256;
};

std::vector<ManifestLine> ManifestLines(const fs::path& manifest) {
  std::ifstream text(manifest);
  const Json json = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object() || !json.contains("outputs") || !json["outputs"].is_array()) {
    return {};
  }
  std::vector<ManifestLine> lines;
  for (const Json& line : json["outputs"]) {
    const bool is_known = line.is_object() && line.contains("file") && line["file"].is_string() &&
                          line.contains("sha256") && line["sha256"].is_string();
    if (is_known) {
      lines.push_back({line["file"], line["sha256"]});
    }
  }
  return lines;
}

bool HasMark(const fs::path& file, const FileMark& mark) {
  if (!IsRegular(file) || !std::regex_match(file.filename().string(), std::regex(mark.name))) {
    return false;
  }
  std::string head(std::size_t{1} << 16, '\0');
  std::ifstream(file, std::ios::binary).read(head.data(), std::ssize(head));
  return head.find(mark.words) != std::string::npos;
}

}  // namespace

std::vector<std::string> OldFiles(const fs::path& folder, const GivenFiles& job,
                                  const std::vector<fs::path>& written) {
  const auto may_go = [&](const fs::path& name) {
    return std::ranges::find(written, name) == written.end() && !IsOneOf(job.files, folder / name);
  };
  std::vector<std::string> old;
  for (const ManifestLine& line : ManifestLines(folder / "manifest.json")) {
    if (IsAmong(job.outputs, line.file) && !LeadsOut(line.file) && may_go(line.file) &&
        HasBytes(folder / line.file, line.sha256)) {
      old.push_back(line.file);
    }
  }
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const fs::path name = at->path().filename();
    const auto has = [&](const FileMark& mark) { return HasMark(at->path(), mark); };
    if (may_go(name) && std::ranges::any_of(job.marks, has)) {
      old.push_back(name.string());
    }
  }
  return old;
}

void RemoveFiles(const fs::path& folder, const std::vector<std::string>& names) {
  std::error_code ignored;
  for (const std::string& name : names) {
    fs::remove(folder / name, ignored);
    for (fs::path above = fs::path(name).parent_path(); !above.empty();
         above = above.parent_path()) {
      fs::remove(folder / above, ignored);  // which does nothing to one that holds something
    }
  }
}

}  // namespace semblance
