// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/workbench/bench_open.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <map>
#include <span>
#include <system_error>
#include <utility>

#include "problems/ct/import_ct.h"
#include "problems/landmark_files/read_landmarks.h"
#include "problems/output/output_folder.h"
#include "problems/pipeline/experiment_config.h"
#include "problems/volumes/read_volume.h"
#include "problems/workbench/bench_actions.h"
#include "problems/workbench/bench_config.h"
#include "problems/workbench/bench_incoming.h"
#include "problems/workbench/bench_subject.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/base/lower_case.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;

constexpr const char* kKinds =
    "what can be opened: a mesh (.ply, .obj, .stl, .off), a CT or MR (a folder of DICOM slices, "
    ".nii, .nii.gz, .nrrd, .nhdr, .mha, .mhd, .inv3), landmarks (.yaml, .mrk.json, .fcsv, .pp, "
    ".csv, .txt), a configuration (.yaml)";

template <class Enum>
std::string_view WordOf(Enum value) {
  constexpr auto kNames = EnumNames(Enum{});
  return kNames.at(static_cast<std::size_t>(value));
}

// ---------------------------------------------------------------------------------------------
// What a file is
// ---------------------------------------------------------------------------------------------

std::string LowerName(const fs::path& path) { return LowerCase(path.filename().string()); }

bool EndsWithOneOf(const std::string& name, std::span<const std::string_view> endings) {
  return std::ranges::any_of(endings, [&](std::string_view end) { return name.ends_with(end); });
}

constexpr std::array<std::string_view, 4> kMeshes = {".ply", ".obj", ".stl", ".off"};
constexpr std::array<std::string_view, 7> kVolumes = {".nii", ".nii.gz", ".nrrd", ".nhdr",
                                                      ".mha", ".mhd",    ".inv3"};
constexpr std::array<std::string_view, 6> kLandmarkFiles = {".json", ".fcsv", ".pp",
                                                            ".csv",  ".txt",  ".asc"};
constexpr std::array<std::string_view, 2> kYaml = {".yaml", ".yml"};
constexpr std::array<std::string_view, 8> kPacked = {".zip", ".gz",  ".tar", ".tgz",
                                                     ".7z",  ".rar", ".bz2", ".xz"};

std::optional<BroughtKind> KindByName(const std::string& name) {
  return EndsWithOneOf(name, kMeshes)          ? std::optional(BroughtKind::kMesh)
         : EndsWithOneOf(name, kVolumes)       ? std::optional(BroughtKind::kVolume)
         : EndsWithOneOf(name, kLandmarkFiles) ? std::optional(BroughtKind::kLandmarks)
                                               : std::nullopt;
}

// By its keys; a file of another kind is refused with what to do with it.
BroughtKind KindOfYaml(const fs::path& path) {
  ConfigErrors errors;
  const ConfigNode tree = ParseConfigText(
      ReadFileBytes(path), {.name = path.string(), .folder = path.parent_path()}, errors);
  errors.ThrowIfAny();
  const ConfigNode* landmarks = tree.Find("landmarks");
  if (landmarks != nullptr && landmarks->IsList()) {
    return BroughtKind::kLandmarks;
  }
  for (const char* key : {"grid", "zip", "list", "sample", "search", "subjects"}) {
    if (tree.Find(key) != nullptr) {
      throw InputError(
          fmt::format("{}: a study, and the workbench holds one head: run it with `semblance "
                      "study`, and open the `base` of it here",
                      path.string()));
    }
  }
  if (tree.Find("rows") != nullptr) {
    throw InputError(
        fmt::format("{}: a table of depths: open a head first, then give the table's path as "
                    "tissue.table (tab Face, All options)",
                    path.string()));
  }
  if (tree.Find("base") == nullptr && OwnKeys<Experiment>(path) == 0) {
    throw InputError(
        fmt::format("{}: no key at its top is an experiment's or a landmark file's; {}",
                    path.string(), kKinds));
  }
  return BroughtKind::kConfig;
}

bool IsDicom(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::array<char, 132> bytes{};
  file.read(bytes.data(), bytes.size());
  return file && std::string_view(&bytes[128], 4) == "DICM";
}

Brought LookAtFile(const fs::path& path) {
  const std::string name = LowerName(path);
  if (const auto kind = KindByName(name)) {
    return {*kind, path};
  }
  if (EndsWithOneOf(name, kYaml)) {
    return {KindOfYaml(path), path};
  }
  if (EndsWithOneOf(name, kPacked)) {
    throw InputError(
        fmt::format("{}: an archive; unpack it, and open what is in it", path.string()));
  }
  if (IsDicom(path)) {
    throw InputError(
        fmt::format("{}: one slice of a volume; bring all slices of the series together, or the "
                    "folder that holds them",
                    path.string()));
  }
  throw InputError(
      fmt::format("{}: not a kind of file that is known here; {}", path.string(), kKinds));
}

// ---------------------------------------------------------------------------------------------
// What a folder is
// ---------------------------------------------------------------------------------------------

// The files in a folder that can be opened by themselves.
std::map<BroughtKind, std::vector<fs::path>> OpenableFiles(const fs::path& folder) {
  std::map<BroughtKind, std::vector<fs::path>> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = LowerName(entry.path());
    if (!entry.is_regular_file() || name.starts_with('.')) {
      continue;
    }
    std::optional<BroughtKind> kind = KindByName(name);
    if (EndsWithOneOf(name, kYaml)) {
      try {
        kind = KindOfYaml(entry.path());
      } catch (const Error&) {  // a table, say, that a configuration names
      }
    }
    if (kind) {
      files[*kind].push_back(entry.path());
    }
  }
  for (auto& [kind, paths] : files) {
    std::ranges::sort(paths);
  }
  return files;
}

std::string NamesOf(const std::vector<fs::path>& paths) {
  constexpr std::size_t kMost = 6;
  std::vector<std::string> names;
  for (const fs::path& path : paths) {
    names.push_back(path.filename().string());
  }
  const std::size_t more = names.size() - std::min(names.size(), kMost);
  names.resize(names.size() - more);
  return fmt::format("{}{}", fmt::join(names, ", "),
                     more > 0 ? fmt::format(" and {} more", more) : "");
}

// A folder that holds nothing but another one stands for it.
fs::path Innermost(fs::path folder) {
  constexpr int kDeepest = 8;
  for (int depth = 0; depth < kDeepest; ++depth) {
    const std::vector<fs::directory_entry> entries{fs::directory_iterator(folder), {}};
    if (entries.size() != 1 || !entries[0].is_directory()) {
      break;
    }
    folder = entries[0].path();
  }
  return folder;
}

// The only file of a folder; empty where there are more, or none.
fs::path OnlyFile(const fs::path& folder) {
  const std::vector<fs::directory_entry> entries{fs::directory_iterator(folder), {}};
  return entries.size() == 1 && entries[0].is_regular_file() ? entries[0].path() : fs::path();
}

Brought LookAtFolder(const fs::path& given) {
  const fs::path folder = Innermost(given);
  if (const fs::path only = OnlyFile(folder); !only.empty()) {
    return LookAtFile(only);
  }
  if (fs::exists(folder / "workbench.yaml")) {
    throw InputError(
        fmt::format("{}: the folder of a workbench; open it from the terminal: semblance "
                    "workbench {}",
                    folder.string(), folder.string()));
  }
  auto files = OpenableFiles(folder);
  // A configuration names the others; a volume may have its voxels in a file of their own.
  for (const BroughtKind kind : {BroughtKind::kConfig, BroughtKind::kVolume}) {
    if (files[kind].size() == 1) {
      return {kind, files[kind].front()};
    }
  }
  std::vector<fs::path> all;
  for (const auto& [kind, paths] : files) {
    all.insert(all.end(), paths.begin(), paths.end());
  }
  if (all.size() > 1) {
    throw InputError(
        fmt::format("{} files that are opened one by one: {}; bring one of them, or a "
                    "configuration with the files that it names, or all slices of a volume",
                    all.size(), NamesOf(all)));
  }
  return all.empty() ? Brought{BroughtKind::kVolume, folder} : LookAtFile(all.front());
}

// ---------------------------------------------------------------------------------------------
// Files that go into the folder
// ---------------------------------------------------------------------------------------------

// What an opening adds to the folder; gone again, and moved back, unless it is kept.
class Additions {
 public:
  explicit Additions(const BenchFolder& folder) : root_(folder.Root()) {}
  ~Additions() {
    std::error_code ignored;
    for (auto path = added_.rbegin(); !kept_ && path != added_.rend(); ++path) {
      fs::remove_all(*path, ignored);
    }
    for (auto move = moved_.rbegin(); !kept_ && move != moved_.rend(); ++move) {
      fs::rename(move->second, move->first, ignored);
    }
  }
  Additions(const Additions&) = delete;
  Additions& operator=(const Additions&) = delete;

  void Keep() { kept_ = true; }

  // A path below subject/ that is free.
  fs::path NewPath(const std::string& name) {
    fs::create_directories(root_ / "subject");
    added_.push_back(FreePath(root_ / "subject" / name));
    return added_.back();
  }

  void Add(const fs::path& path) { added_.push_back(path); }

  // Where a file stays: one of the browser's moves into subject/, alone or with all that came
  // along; another one stays where it is.
  fs::path Settled(const fs::path& path) {
    return !BatchOf(root_, path).empty() ? Move(path, FreePath(root_ / "subject" / path.filename()))
                                         : fs::absolute(path).lexically_normal();
  }
  fs::path SettledWithAll(const fs::path& path) {
    const fs::path batch = BatchOf(root_, path);
    return batch.empty() ? fs::absolute(path).lexically_normal()
                         : Move(batch, FreePath(root_ / "subject" / path.stem())) /
                               fs::absolute(path).lexically_normal().lexically_relative(batch);
  }

 private:
  fs::path Move(const fs::path& from, const fs::path& to) {
    fs::create_directories(to.parent_path());
    fs::rename(from, to);
    moved_.emplace_back(from, to);
    return to;
  }

  fs::path root_;
  std::vector<fs::path> added_;
  std::vector<std::pair<fs::path, fs::path>> moved_;  // from, to
  bool kept_ = false;
};

// ---------------------------------------------------------------------------------------------
// States
// ---------------------------------------------------------------------------------------------

// Within the folder relative to it, so that the folder can be moved.
std::string PathForState(const fs::path& path, const fs::path& root) {
  const fs::path inside = path.lexically_relative(root);
  const bool is_inside = !inside.empty() && inside.begin()->string() != "..";
  return ToFlowYaml(ConfigNode::Quoted((is_inside ? inside : path).string()));
}

// The options stay, but for what is of the former head alone.
BenchState WithHead(BenchState state, const FileSubject& files, const std::string& name,
                    const fs::path& root) {
  Experiment experiment;
  experiment.subject = files;
  ConfigNode tree = *ConfigTreeOf(experiment).Find("subject");
  MakeRelative(tree, root);
  state =
      ChangeSetting(DropSetting(std::move(state), "tissue.set_mm"), "subject", ToFlowYaml(tree));
  state.subject = name;
  state.landmarks.clear();
  state.absent.clear();
  state.edits = {};
  return state;
}

// In the frame of the subject's files.
TriMesh InFrameOf(const FileSubject& files, TriMesh mesh) {
  for (Vec3& p : mesh.points) {
    p = ToLps(p, files.axes) / Millimetres(files.units);
  }
  return mesh;
}

const FileSubject& FilesOf(const OpenBase& base) {
  return std::get<FileSubject>(base.experiment.subject);
}

// Slices that were sent by themselves have no name together.
std::string NameOfVolume(const fs::path& path, const fs::path& root) {
  return BatchOf(root, path) == path ? "volume" : PlainName(path);
}

Opened OpenSkinOf(const OpenRequest& request, const fs::path& path, const OpenBase& base,
                  Additions& added, const RunContext& context) {
  const VolumeReading reading = ReadVolume(path, request.volume.read, context);
  Opened opened{.what = {}, .state = base.state, .notes = reading.notes};
  TriMesh skin = reading.modality == Modality::kMr
                     ? ImportMrSkin(reading.volume, {}, context).skin
                     : ImportCt(reading.volume, request.volume.import, context).skin;
  const fs::path file = added.NewPath(NameOfVolume(path, base.folder.Root()) + "_skin.ply");
  WriteFileAtomically(file, EncodeMesh(InFrameOf(FilesOf(base), std::move(skin)), ".ply"));
  opened.state = ChangeSetting(std::move(opened.state), "subject.skin",
                               PathForState(file, base.folder.Root()));
  return opened;
}

Opened OpenMesh(const OpenRequest& request, const fs::path& path, const OpenBase& base,
                Additions& added) {
  const fs::path file = added.Settled(path);
  if (request.as == OpenAs::kHead) {
    FileSubject files;
    files.skull = file;
    return {.what = {},
            .state = WithHead(base.state, files, PlainName(path), base.folder.Root()),
            .notes = {}};
  }
  return {.what = {},
          .state = ChangeSetting(base.state, fmt::format("subject.{}", WordOf(request.as)),
                                 PathForState(file, base.folder.Root())),
          .notes = {}};
}

Opened OpenVolume(const OpenRequest& request, const fs::path& path, const OpenBase& base,
                  Additions& added, const RunContext& context) {
  if (request.as == OpenAs::kSkin) {
    return OpenSkinOf(request, path, base, added, context);
  }
  const std::string name = NameOfVolume(path, base.folder.Root());
  CtSubject subject = request.volume;
  subject.volume = path;
  subject.landmarks.clear();
  BenchState read;
  Opened opened;
  const FileSubject files =
      SubjectAsFiles(subject, added.NewPath(name), read, context, opened.notes);
  opened.state = WithHead(base.state, files, name, base.folder.Root());
  return opened;
}

Opened OpenConfig(const OpenRequest& request, const fs::path& path, const OpenBase& base,
                  Additions& added, const RunContext& context) {
  const fs::path file = added.SettledWithAll(path);
  Opened opened{.what = {}, .state = base.state, .notes = {}};
  Experiment experiment;
  if (request.as == OpenAs::kOptions) {
    experiment = ReadConfig<Experiment>(file);
    experiment.subject = base.experiment.subject;
    experiment.edits.clear();
    opened.state.settings.clear();
  } else {
    BenchBeginning beginning = BeginFromConfig(file, added.NewPath(PlainName(path)), context);
    experiment = std::move(beginning.experiment);
    opened.state = std::move(beginning.state);
    opened.notes = std::move(beginning.notes);
  }
  opened.state.start = base.folder.AddStart(StartConfig(experiment, base.folder.Root()));
  added.Add(base.folder.Root() / opened.state.start);
  return opened;
}

Opened OpenLandmarks(const OpenRequest& request, const fs::path& path, const OpenBase& base) {
  LandmarkReading reading = ReadLandmarks(path, {.axes = request.axes});
  return {.what = {},
          .state = TakeLandmarks(base.state, reading.file),
          .notes = std::move(reading.notes)};
}

Opened OpenAsAsked(const OpenRequest& request, const Brought& brought, const OpenBase& base,
                   Additions& added, const RunContext& context) {
  switch (brought.kind) {
    case BroughtKind::kMesh:
      return OpenMesh(request, brought.path, base, added);
    case BroughtKind::kVolume:
      return OpenVolume(request, brought.path, base, added, context);
    case BroughtKind::kConfig:
      return OpenConfig(request, brought.path, base, added, context);
    case BroughtKind::kLandmarks:
      return OpenLandmarks(request, brought.path, base);
  }
  return {};
}

void CheckWay(const OpenRequest& request, const Brought& brought) {
  const std::vector<OpenAs> ways = WaysToOpen(brought.kind);
  if (std::ranges::find(ways, request.as) == ways.end()) {
    throw InputError(fmt::format("{}: {} cannot be opened as {}", brought.path.string(),
                                 WordOf(brought.kind), WordOf(request.as)));
  }
}

}  // namespace

std::vector<OpenAs> WaysToOpen(BroughtKind kind) {
  switch (kind) {
    case BroughtKind::kMesh:
      return {OpenAs::kHead, OpenAs::kSkull, OpenAs::kSkin};
    case BroughtKind::kVolume:
      return {OpenAs::kHead, OpenAs::kSkin};
    case BroughtKind::kConfig:
      return {OpenAs::kHead, OpenAs::kOptions};
    case BroughtKind::kLandmarks:
      return {OpenAs::kLandmarks};
  }
  return {};
}

Brought LookAtBrought(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (path.empty() || !fs::exists(status)) {
    throw IoError(
        fmt::format("{}: no such file or folder on this machine; give the whole path, or "
                    "choose the file",
                    path.string()));
  }
  return fs::is_directory(status) ? LookAtFolder(path) : LookAtFile(path);
}

void OpenBrought(const OpenRequest& request, const OpenBase& base, const RunContext& context,
                 const std::function<void(Opened)>& take) {
  context.Report("look");
  const Brought brought = LookAtBrought(request.path);
  CheckWay(request, brought);
  const fs::path batch = BatchOf(base.folder.Root(), brought.path);
  try {
    Additions added(base.folder);
    Opened opened = OpenAsAsked(request, brought, base, added, context);
    const std::string name = batch == brought.path ? "slices" : brought.path.filename().string();
    opened.what = fmt::format("opened {} as {}", name, WordOf(request.as));
    take(std::move(opened));
    added.Keep();
  } catch (const Error& error) {
    if (batch.empty() || brought.kind != BroughtKind::kConfig) {
      throw;
    }
    throw InputError(fmt::format(
        "{}\nBring the files that it names together with it, or give its path on this machine.",
        error.what()));
  }
  if (!batch.empty()) {
    DropIncoming(base.folder.Root(), batch.filename().string());
  }
}

}  // namespace semblance
