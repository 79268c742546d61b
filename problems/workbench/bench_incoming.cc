// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/workbench/bench_incoming.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "problems/config/utf8_check.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;

constexpr const char* kIncoming = "incoming";
constexpr std::size_t kLongestName = 200;  // bytes; most file systems take 255

bool IsSafe(const std::string& name) {
  ConfigErrors errors;
  const auto nowhere = std::make_shared<const ConfigSource>();
  return !name.empty() && name.size() <= kLongestName && name[0] != '.' &&
         name.find_first_of("/\\\n\r\t") == std::string::npos &&
         RequireReadableBytes(name, nowhere, errors);
}

std::string Safe(const std::string& name) {
  if (!IsSafe(name)) {
    throw InputError(
        fmt::format("upload: a file's name has 1 to {} bytes, no control characters, no slashes "
                    "and no dot in front; rename the file",
                    kLongestName));
  }
  return name;
}

}  // namespace

fs::path IncomingBatch(const fs::path& root, const std::string& batch) {
  return root / kIncoming / Safe(batch);
}

fs::path SaveIncoming(const fs::path& root, const std::string& batch, const std::string& name,
                      std::string_view bytes) {
  fs::path path = IncomingBatch(root, batch);
  for (std::size_t from = 0; from <= name.size();) {
    const std::size_t slash = std::min(name.find('/', from), name.size());
    path /= Safe(name.substr(from, slash - from));
    from = slash + 1;
  }
  fs::create_directories(path.parent_path());
  WriteFileAtomically(path, bytes);
  return path;
}

fs::path BatchOf(const fs::path& root, const fs::path& path) {
  const fs::path inside =
      fs::absolute(path).lexically_normal().lexically_relative(root / kIncoming);
  const std::string batch = inside.empty() ? "" : inside.begin()->string();
  return IsSafe(batch) ? root / kIncoming / batch : fs::path();
}

void DropIncoming(const fs::path& root, const std::string& batch) {
  fs::remove_all(IncomingBatch(root, batch));
}

void DropAllIncoming(const fs::path& root) { fs::remove_all(root / kIncoming); }

}  // namespace semblance
