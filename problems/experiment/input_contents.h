// SPDX-License-Identifier: GPL-3.0-or-later
// The contents of input files. Results depend on them and on options, never on paths: two machines
// that hold equal files at different places get equal results, and a changed byte may change one.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "problems/config/config_binder.h"
#include "problems/io/file_hashes.h"

namespace semblance::problems {

// All files that are read with an input, each once: the file itself, the voxels that a volume's
// header names, the files of a folder with its subfolders (sorted), the bases of a YAML file, the
// materials and textures of a bust. A file that is named but missing is listed too.
std::vector<std::filesystem::path> ListParts(const NamedFile& input);

// HashContent by option and path.
using InputHashes = std::map<std::pair<std::string, std::filesystem::path>, std::string>;

// The hash of an input's contents and of the ending of its name, because the ending decides how the
// file is read. The hash of a missing or unreadable file differs from that of every other one.
std::string HashContent(const NamedFile& input, FileHashes& hashes);

// The options with the result of `text` in place of each input's path. With HashContent the result
// is the same on all machines, and differs if any option or any input differs.
ConfigNode WithInputs(ConfigNode options, std::span<const NamedFile> inputs,
                      const std::function<std::string(const NamedFile&)>& text);

}  // namespace semblance::problems
