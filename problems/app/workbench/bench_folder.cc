// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/workbench/bench_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <memory>
#include <sstream>
#include <string_view>
#include <system_error>

#include "problems/app/workbench/bench_assets.h"
#include "problems/app/workbench/bench_config.h"
#include "problems/config/config_tree.h"
#include "problems/config/utf8_check.h"
#include "problems/experiment/experiment_config.h"
#include "problems/io/output_folder.h"
#include "problems/subject/landmark_files/read_landmarks.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHistory = "workbench.yaml";
constexpr const char* kStart = "start.yaml";
constexpr const char* kClaim = ".semblance-workbench";
constexpr const char* kAddress = ".address";

fs::path MakeFolder(const fs::path& root) {
  std::error_code error;
  fs::create_directories(root, error);
  if (error) {
    throw IoError(fmt::format("{}: the folder cannot be created: {}; choose another one",
                              root.string(), error.message()));
  }
  return fs::canonical(root);
}

// Writes the text if the file differs from it. Removes the file if the text is empty.
void WriteOrRemove(const fs::path& path, const std::string& text) {
  if (text.empty()) {
    fs::remove(path);
  } else if (!fs::exists(path) || ReadFileBytes(path) != text) {
    WriteFileAtomically(path, text);
  }
}

constexpr const char* kIncoming = "incoming";
constexpr std::size_t kMaxName_bytes = 200;  // most file systems allow 255

bool IsSafeName(const std::string& name) {
  ConfigErrors errors;
  const auto nowhere = std::make_shared<const ConfigSource>();
  return !name.empty() && name.size() <= kMaxName_bytes && name[0] != '.' &&
         name.find_first_of("/\\\n\r\t") == std::string::npos &&
         RequireReadableBytes(name, nowhere, errors);
}

std::string RequireSafeName(const std::string& name) {
  if (!IsSafeName(name)) {
    throw InputError(
        fmt::format("upload: a file's name has 1 to {} bytes, no control characters, no slashes "
                    "and no dot in front; rename the file",
                    kMaxName_bytes));
  }
  return name;
}

}  // namespace

std::string LandmarksText(const BenchState& state) {
  return state.landmarks.empty() ? "" : EncodeLandmarks(ToLandmarkFile(state), "landmarks.yaml");
}

std::string EditsText(const BenchState& state) {
  return state.edits.edits.empty() && state.edits.resets.empty() ? "" : WriteConfig(state.edits);
}

fs::path FreePath(const fs::path& wanted) {
  fs::path path = wanted;
  for (int n = 2; fs::exists(path); ++n) {
    path.replace_filename(
        fmt::format("{}-{}{}", wanted.stem().string(), n, wanted.extension().string()));
  }
  return path;
}

BenchFolder::BenchFolder(const fs::path& root) : root_(MakeFolder(root)) {
  claim_.Take(root_ / kClaim, root_.string());
}

bool BenchFolder::HasWork() const { return fs::exists(root_ / kHistory); }

void BenchFolder::CheckFree() const {
  // A workbench that ended during its start may have left these.
  constexpr std::array<std::string_view, 6> kOwn = {kClaim,   kStart,     "subject",
                                                    "tables", "networks", "incoming"};
  for (const auto& entry : fs::directory_iterator(root_)) {
    const std::string name = entry.path().filename().string();
    if (std::ranges::find(kOwn, name) == kOwn.end()) {
      throw IoError(
          fmt::format("{}: the folder holds other files ({}); give an empty or a new folder",
                      root_.string(), name));
    }
  }
}

void BenchFolder::Begin(const std::string& start, const BenchState& state) {
  for (const BenchAsset& file : StarterFiles()) {
    const fs::path path = root_ / file.name;
    MakeFolderBelow(root_, fs::path(file.name).parent_path());
    if (!fs::exists(path)) {
      WriteFileAtomically(path, file.text);
    }
  }
  WriteFileAtomically(root_ / kStart, start);
  Write(BeginHistory(state), ReadExperiment(state));
}

std::string BenchFolder::AddStart(const std::string& text) const {
  const fs::path path = FreePath(root_ / kStart);
  WriteFileAtomically(path, text);
  return path.filename().string();
}

BenchHistory BenchFolder::Read() const {
  const fs::path path = root_ / kHistory;
  return HistoryFromText(ReadFileBytes(path), path.string());
}

void BenchFolder::Write(const BenchHistory& history, const Experiment& experiment) const {
  const BenchState& state = CurrentState(history);
  const std::string text = HistoryText(history);
  if (text.size() > kMaxConfig_bytes) {
    throw InputError(fmt::format(
        "{}: the state and its last {} steps would take {} MB, too much to be read back; "
        "shorten the notes",
        kHistory, history.steps.size(), text.size() / 1'000'000));
  }
  WriteFileAtomically(root_ / kHistory, text);
  WriteOrRemove(root_ / "landmarks.yaml", LandmarksText(state));
  WriteOrRemove(root_ / "edits.yaml", EditsText(state));
  WriteOrRemove(root_ / "config.yaml", ShortConfig(experiment, root_));
}

Experiment BenchFolder::ReadExperiment(const BenchState& state) const {
  if (state.start != fs::path(state.start).filename()) {
    throw IoError(fmt::format("{}: start: '{}' is not a file of the folder",
                              (root_ / kHistory).string(), state.start));
  }
  return MakeExperiment(ReadFileBytes(root_ / state.start), root_, state);
}

Experiment BenchFolder::ReadSavedExperiment() const {
  return ReadConfig<Experiment>(root_ / "config.yaml");
}

void WriteSecret(const fs::path& file, std::string_view text) {
  ::unlink(file.c_str());
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  const bool written = descriptor >= 0 && ::write(descriptor, text.data(), text.size()) ==
                                              static_cast<ssize_t>(text.size());
  ::close(descriptor);
  if (!written) {
    throw IoError(fmt::format("{}: cannot be written; check the folder's rights and the disk",
                              file.string()));
  }
}

BenchAddress ReadAddress(const fs::path& root) {
  const fs::path file = root / kAddress;
  struct ::stat about {};
  const bool is_ours = ::lstat(file.c_str(), &about) == 0 && S_ISREG(about.st_mode) &&
                       about.st_uid == ::geteuid() && (about.st_mode & 077) == 0;
  if (!is_ours) {
    return {};
  }
  BenchAddress address;
  std::istringstream text(ReadFileBytes(file));
  text >> address.port >> address.token;
  const bool is_token = address.token.size() == 64 &&
                        address.token.find_first_not_of("0123456789abcdef") == std::string::npos;
  return text && is_token && address.port > 0 && address.port < 65536 ? address : BenchAddress();
}

void StoreAddress(const fs::path& root, const BenchAddress& address) {
  WriteSecret(root / kAddress, fmt::format("{} {}\n", address.port, address.token));
}

fs::path IncomingBatch(const fs::path& root, const std::string& batch) {
  return root / kIncoming / RequireSafeName(batch);
}

fs::path SaveIncoming(const fs::path& root, const std::string& batch, const std::string& name,
                      std::string_view bytes) {
  fs::path path = IncomingBatch(root, batch);
  for (std::size_t from = 0; from <= name.size();) {
    const std::size_t slash = std::min(name.find('/', from), name.size());
    path /= RequireSafeName(name.substr(from, slash - from));
    from = slash + 1;
  }
  MakeFolderBelow(root, path.parent_path().lexically_relative(root));
  WriteFileAtomically(path, bytes);
  return path;
}

fs::path FindBatch(const fs::path& root, const fs::path& path) {
  const fs::path inside =
      fs::absolute(path).lexically_normal().lexically_relative(root / kIncoming);
  const std::string batch = inside.empty() ? "" : inside.begin()->string();
  return IsSafeName(batch) ? root / kIncoming / batch : fs::path();
}

void DropIncoming(const fs::path& root, const std::string& batch) {
  fs::remove_all(IncomingBatch(root, batch));
}

void DropAllIncoming(const fs::path& root) { fs::remove_all(root / kIncoming); }

}  // namespace semblance::problems
