// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/input_contents.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <map>
#include <string_view>
#include <system_error>

#include "problems/config/config.h"
#include "problems/face/bust/bust_model.h"
#include "problems/io/volumes/read_volume.h"
#include "surfaces/base/encoding.h"
#include "surfaces/base/lower_case.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

bool IsRegularFile(const fs::path& file) {
  std::error_code ignored;  // a file that cannot be reached counts as missing
  return fs::is_regular_file(file, ignored);
}

// A YAML file may have `base: FILE` or `base: [FILE, ...]`, whatever its name is. Files of these
// kinds are never read as YAML; some of them are large.
bool MayNameBases(const fs::path& file) {
  constexpr std::array<std::string_view, 11> kOther = {
      ".ply", ".obj", ".off", ".stl", ".npy", ".csv", ".json", ".fcsv", ".dcm", ".raw", ".img"};
  std::error_code ignored;
  return std::ranges::find(kOther, LowerCase(file.extension().string())) == kOther.end() &&
         !FindVolumeFormat(file) && IsRegularFile(file) &&
         fs::file_size(file, ignored) <= kMaxConfig_bytes;
}

// Adds the files that are named under `base`, and their own bases. A file that is no YAML has none.
void AddBases(const fs::path& file, std::vector<fs::path>& parts) {
  std::string text;
  try {
    text = MayNameBases(file) ? ReadFileBytes(file) : "";
  } catch (const IoError&) {
    return;
  }
  if (text.find("base") == text.npos || text.find('\0') != text.npos) {
    return;
  }
  ConfigErrors ignored;  // the reader of the file reports them
  const ConfigNode tree =
      ParseConfigText(text, {.name = file.string(), .folder = file.parent_path()}, ignored);
  const ConfigNode* const named = tree.Find("base");
  const std::vector<ConfigNode> bases = named == nullptr  ? std::vector<ConfigNode>()
                                        : named->IsList() ? named->items
                                                          : std::vector{*named};
  for (const ConfigNode& base : bases) {
    const fs::path path = (file.parent_path() / base.text).lexically_normal();
    if (std::ranges::find(parts, path) == parts.end() && parts.size() <= kMaxConfigDepth) {
      parts.push_back(path);
      AddBases(path, parts);
    }
  }
}

// A bust's mesh in OBJ names materials, and these name textures. A faulty one is reported by the
// reader of the bust.
void AddMaterials(const NamedFile& input, std::vector<fs::path>& parts) {
  try {
    std::ranges::copy(
        input.option.ends_with("bust.mesh") ? MaterialFiles(input.file) : std::vector<fs::path>(),
        std::back_inserter(parts));
  } catch (const Error&) {
    return;
  }
}

// Replaces the nodes whose option is a key of `texts`.
void ReplaceTexts(const std::map<std::string, std::string>& texts, const std::string& option,
                  ConfigNode& node) {
  const auto found = texts.find(option);
  if (found != texts.end()) {
    node = ConfigNode::Quoted(found->second);
  }
  for (ConfigNode::Entry& entry : node.entries) {
    ReplaceTexts(texts, JoinPath(option, entry.key), entry.value);
  }
  for (std::size_t k = 0; k < node.items.size(); ++k) {
    ReplaceTexts(texts, JoinPath(option, k), node.items[k]);
  }
}

}  // namespace

std::vector<fs::path> ListParts(const NamedFile& input) {
  std::vector<fs::path> parts = VolumeFiles(input.file);
  AddBases(input.file, parts);
  AddMaterials(input, parts);
  return parts;
}

std::string HashContent(const NamedFile& input, FileHashes& hashes) {
  std::string all = LowerCase(input.file.extension().string());
  for (const fs::path& part : ListParts(input)) {
    try {
      all += "\n" + (IsRegularFile(part) ? hashes.Of(part) : "missing");
    } catch (const IoError&) {
      all += "\nnot readable";
    }
  }
  return Sha256OfText(all);
}

ConfigNode WithInputs(ConfigNode options, std::span<const NamedFile> inputs,
                      const std::function<std::string(const NamedFile&)>& text) {
  std::map<std::string, std::string> texts;
  for (const NamedFile& input : inputs) {
    texts[input.option] = text(input);
  }
  ReplaceTexts(texts, "", options);
  return options;
}

}  // namespace semblance::problems
