// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/workbench/bench_open.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <map>
#include <span>
#include <system_error>
#include <utility>

#include "problems/app/workbench/bench_actions.h"
#include "problems/app/workbench/bench_config.h"
#include "problems/app/workbench/bench_subject.h"
#include "problems/experiment/experiment_config.h"
#include "problems/io/output_folder.h"
#include "problems/io/volumes/import_ct.h"
#include "problems/io/volumes/read_volume.h"
#include "problems/subject/landmark_files/read_landmarks.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/base/lower_case.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

constexpr const char* kKinds =
    "these can be opened: a mesh (.ply, .obj, .stl, .off), a CT or MR (a folder of DICOM slices, "
    ".nii, .nii.gz, .nrrd, .nhdr, .mha, .mhd, .inv3), landmarks (.yaml, .mrk.json, .fcsv, .pp, "
    ".csv, .txt), a configuration (.yaml)";

// ---------------------------------------------------------------------------------------------
// The kind of a file
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

std::optional<ImportKind> KindByName(const std::string& name) {
  return EndsWithOneOf(name, kMeshes)          ? std::optional(ImportKind::kMesh)
         : EndsWithOneOf(name, kVolumes)       ? std::optional(ImportKind::kVolume)
         : EndsWithOneOf(name, kLandmarkFiles) ? std::optional(ImportKind::kLandmarks)
                                               : std::nullopt;
}

// Finds the kind by the keys. The messages for other YAML files state their use.
ImportKind YamlKind(const fs::path& path) {
  ConfigErrors errors;
  const ConfigNode tree = ParseConfigText(
      ReadFileBytes(path), {.name = path.string(), .folder = path.parent_path()}, errors);
  errors.ThrowIfAny();
  const ConfigNode* landmarks = tree.Find("landmarks");
  if (landmarks != nullptr && landmarks->IsList()) {
    return ImportKind::kLandmarks;
  }
  for (const char* key : {"grid", "zip", "list", "sample", "search", "subjects"}) {
    if (tree.Find(key) != nullptr) {
      throw InputError(fmt::format(
          "{}: this is a study, and the workbench holds one head; run it with `semblance "
          "study`, and open its `base` here",
          path.string()));
    }
  }
  if (tree.Find("rows") != nullptr) {
    throw InputError(
        fmt::format("{}: this is a depth table; open a head first, then give the table's path as "
                    "tissue.table (step Face, All options)",
                    path.string()));
  }
  if (tree.Find("base") == nullptr && OwnKeys<Experiment>(path) == 0) {
    throw InputError(fmt::format(
        "{}: none of its top-level keys belongs to an experiment or a landmark file; {}",
        path.string(), kKinds));
  }
  return ImportKind::kConfig;
}

bool IsDicom(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::array<char, 132> bytes{};
  file.read(bytes.data(), bytes.size());
  return file && std::string_view(&bytes[128], 4) == "DICM";
}

ImportedFile IdentifyFile(const fs::path& path) {
  const std::string name = LowerName(path);
  if (const auto kind = KindByName(name)) {
    return {*kind, path};
  }
  if (EndsWithOneOf(name, kYaml)) {
    return {YamlKind(path), path};
  }
  if (EndsWithOneOf(name, kPacked)) {
    throw InputError(
        fmt::format("{}: this is an archive; unpack it, and open its files", path.string()));
  }
  if (IsDicom(path)) {
    throw InputError(
        fmt::format("{}: this is one slice of a volume; open all slices of the series together, or "
                    "their folder",
                    path.string()));
  }
  throw InputError(fmt::format("{}: this kind of file is unknown; {}", path.string(), kKinds));
}

// ---------------------------------------------------------------------------------------------
// The kind of a folder
// ---------------------------------------------------------------------------------------------

// The files in a folder that can be opened without the other files.
std::map<ImportKind, std::vector<fs::path>> OpenableFiles(const fs::path& folder) {
  std::map<ImportKind, std::vector<fs::path>> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = LowerName(entry.path());
    if (!entry.is_regular_file() || name.starts_with('.')) {
      continue;
    }
    std::optional<ImportKind> kind = KindByName(name);
    if (EndsWithOneOf(name, kYaml)) {
      try {
        kind = YamlKind(entry.path());
      } catch (const Error&) {  // for example a table that a configuration names
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

std::string ListNames(const std::vector<fs::path>& paths) {
  constexpr std::size_t kMaxNames = 6;
  std::vector<std::string> names;
  for (const fs::path& path : paths) {
    names.push_back(path.filename().string());
  }
  const std::size_t more = names.size() - std::min(names.size(), kMaxNames);
  names.resize(names.size() - more);
  return fmt::format("{}{}", fmt::join(names, ", "),
                     more > 0 ? fmt::format(" and {} more", more) : "");
}

// Descends while the folder holds nothing but one other folder.
fs::path Innermost(fs::path folder) {
  constexpr int kMaxDepth = 8;
  for (int depth = 0; depth < kMaxDepth; ++depth) {
    const std::vector<fs::directory_entry> entries{fs::directory_iterator(folder), {}};
    if (entries.size() != 1 || !entries[0].is_directory()) {
      break;
    }
    folder = entries[0].path();
  }
  return folder;
}

// The only entry of a folder if it is a file; otherwise empty.
fs::path OnlyFile(const fs::path& folder) {
  const std::vector<fs::directory_entry> entries{fs::directory_iterator(folder), {}};
  return entries.size() == 1 && entries[0].is_regular_file() ? entries[0].path() : fs::path();
}

ImportedFile IdentifyFolder(const fs::path& given) {
  const fs::path folder = Innermost(given);
  if (const fs::path only = OnlyFile(folder); !only.empty()) {
    return IdentifyFile(only);
  }
  if (fs::exists(folder / "workbench.yaml")) {
    throw InputError(
        fmt::format("{}: this is the folder of a workbench; open it from the terminal: semblance "
                    "workbench {}",
                    folder.string(), folder.string()));
  }
  auto files = OpenableFiles(folder);
  // A configuration names the other files. A volume may have its voxels in a separate file.
  for (const ImportKind kind : {ImportKind::kConfig, ImportKind::kVolume}) {
    if (files[kind].size() == 1) {
      return {kind, files[kind].front()};
    }
  }
  std::vector<fs::path> all;
  for (const auto& [kind, paths] : files) {
    all.insert(all.end(), paths.begin(), paths.end());
  }
  if (all.size() > 1) {
    throw InputError(fmt::format(
        "{} files that cannot be opened together: {}; open one of them, or a configuration "
        "with the files that it names, or all slices of a volume",
        all.size(), ListNames(all)));
  }
  return all.empty() ? ImportedFile{ImportKind::kVolume, folder} : IdentifyFile(all.front());
}

// ---------------------------------------------------------------------------------------------
// Files that go into the folder
// ---------------------------------------------------------------------------------------------

// The files that an opening adds to the folder. Unless Keep() is called, the destructor removes the
// added files and moves the moved files back.
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

  // Returns a free path below subject/.
  fs::path NewPath(const std::string& name) {
    MakeFolderBelow(root_, "subject");
    added_.push_back(FreePath(root_ / "subject" / name));
    return added_.back();
  }

  void Add(const fs::path& path) { added_.push_back(path); }

  // Return the permanent path of a file. An upload of the browser moves into subject/, alone or
  // with its whole batch. Any other file stays at its place.
  fs::path KeepFile(const fs::path& path) {
    return !FindBatch(root_, path).empty()
               ? Move(path, FreePath(root_ / "subject" / path.filename()))
               : fs::absolute(path).lexically_normal();
  }
  fs::path KeepFileWithBatch(const fs::path& path) {
    const fs::path batch = FindBatch(root_, path);
    return batch.empty() ? fs::absolute(path).lexically_normal()
                         : Move(batch, FreePath(root_ / "subject" / path.stem())) /
                               fs::absolute(path).lexically_normal().lexically_relative(batch);
  }

 private:
  fs::path Move(const fs::path& from, const fs::path& to) {
    MakeFolderBelow(root_, "subject");
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

// A path inside the folder is relative to it, so that the folder can be moved.
std::string PathForState(const fs::path& path, const fs::path& root) {
  const fs::path inside = path.lexically_relative(root);
  const bool is_inside = !inside.empty() && inside.begin()->string() != "..";
  return ToFlowYaml(ConfigNode::Quoted((is_inside ? inside : path).string()));
}

// Replaces the head. The options stay, except the depths set for the former head.
BenchState WithHead(BenchState state, const FileSubject& files, const std::string& name,
                    const fs::path& root) {
  Experiment experiment;
  experiment.subject = files;
  ConfigNode tree = *MakeConfigTree(experiment).Find("subject");
  MakeRelative(tree, root);
  state =
      ChangeSetting(DropSetting(std::move(state), "tissue.set_mm"), "subject", ToFlowYaml(tree));
  state.subject = name;
  state.landmarks.clear();
  state.absent.clear();
  state.edits = {};
  return state;
}

// Converts a mesh in mm and LPS to the axes and the unit of the subject's files.
TriMesh ToSubjectFrame(const FileSubject& files, TriMesh mesh) {
  for (Vec3& p : mesh.points) {
    p = ToLps(p, files.axes.value_or(Axes::kLps)) / Millimetres(files.units);
  }
  return mesh;
}

const FileSubject& SubjectFiles(const OpenBase& base) {
  return std::get<FileSubject>(base.experiment.subject);
}

// Slices uploaded without a folder have no common name.
std::string VolumeName(const fs::path& path, const fs::path& root) {
  return FindBatch(root, path) == path ? "volume" : PlainName(path);
}

Opened OpenSkinFromVolume(const OpenRequest& request, const fs::path& path, const OpenBase& base,
                          Additions& added, const RunContext& context) {
  const VolumeReading reading = ReadVolume(path, request.volume.read, context);
  Opened opened{.what = {}, .state = base.state, .notes = reading.notes};
  TriMesh skin = reading.modality == Modality::kMr
                     ? ImportMrSkin(reading.volume, {}, context).skin
                     : ImportCt(reading.volume, request.volume.import, context).skin;
  const fs::path file = added.NewPath(VolumeName(path, base.folder.Root()) + "_skin.ply");
  WriteFileAtomically(file,
                      EncodeMesh(ToSubjectFrame(SubjectFiles(base), std::move(skin)), ".ply"));
  opened.state = ChangeSetting(std::move(opened.state), "subject.skin",
                               PathForState(file, base.folder.Root()));
  return opened;
}

Opened OpenMesh(const OpenRequest& request, const fs::path& path, const OpenBase& base,
                Additions& added) {
  const fs::path file = added.KeepFile(path);
  if (request.as == OpenAs::kHead) {
    FileSubject files;
    files.skull = file;
    return {
        .what = {},
        .state = WithHead(base.state, WithStatedAxes(files), PlainName(path), base.folder.Root()),
        .notes = {}};
  }
  return {.what = {},
          .state = ChangeSetting(base.state, fmt::format("subject.{}", EnumWord(request.as)),
                                 PathForState(file, base.folder.Root())),
          .notes = {}};
}

Opened OpenVolume(const OpenRequest& request, const fs::path& path, const OpenBase& base,
                  Additions& added, const RunContext& context) {
  if (request.as == OpenAs::kSkin) {
    return OpenSkinFromVolume(request, path, base, added, context);
  }
  const std::string name = VolumeName(path, base.folder.Root());
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
  const fs::path file = added.KeepFileWithBatch(path);
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
  reading.file.subject.clear();  // landmarks do not rename the case
  return {.what = {},
          .state = ReplaceLandmarks(base.state, reading.file),
          .notes = std::move(reading.notes)};
}

Opened OpenByKind(const OpenRequest& request, const ImportedFile& file, const OpenBase& base,
                  Additions& added, const RunContext& context) {
  switch (file.kind) {
    case ImportKind::kMesh:
      return OpenMesh(request, file.path, base, added);
    case ImportKind::kVolume:
      return OpenVolume(request, file.path, base, added, context);
    case ImportKind::kConfig:
      return OpenConfig(request, file.path, base, added, context);
    case ImportKind::kLandmarks:
      return OpenLandmarks(request, file.path, base);
  }
  return {};
}

void CheckOpenAs(const OpenRequest& request, const ImportedFile& file) {
  const std::vector<OpenAs> ways = WaysToOpen(file.kind);
  if (std::ranges::find(ways, request.as) == ways.end()) {
    throw InputError(fmt::format("{}: {} cannot be opened as {}", file.path.string(),
                                 EnumWord(file.kind), EnumWord(request.as)));
  }
}

}  // namespace

std::vector<OpenAs> WaysToOpen(ImportKind kind) {
  switch (kind) {
    case ImportKind::kMesh:
      return {OpenAs::kHead, OpenAs::kSkull, OpenAs::kSkin};
    case ImportKind::kVolume:
      return {OpenAs::kHead, OpenAs::kSkin};
    case ImportKind::kConfig:
      return {OpenAs::kHead, OpenAs::kOptions};
    case ImportKind::kLandmarks:
      return {OpenAs::kLandmarks};
  }
  return {};
}

ImportedFile IdentifyImport(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (path.empty() || !fs::exists(status)) {
    throw IoError(
        fmt::format("{}: no such file or folder on this machine; give the full path, or choose the "
                    "file",
                    path.string()));
  }
  return fs::is_directory(status) ? IdentifyFolder(path) : IdentifyFile(path);
}

void OpenImportedFile(const OpenRequest& request, const OpenBase& base, const RunContext& context,
                      const std::function<void(Opened)>& commit) {
  context.Report("look");
  const ImportedFile file = IdentifyImport(request.path);
  CheckOpenAs(request, file);
  const fs::path batch = FindBatch(base.folder.Root(), file.path);
  try {
    Additions added(base.folder);
    Opened opened = OpenByKind(request, file, base, added, context);
    const std::string name = batch == file.path ? "slices" : file.path.filename().string();
    opened.what = fmt::format("opened {} as {}", name, EnumWord(request.as));
    commit(std::move(opened));
    added.Keep();
  } catch (const Error& error) {
    if (batch.empty() || file.kind != ImportKind::kConfig) {
      throw;
    }
    throw InputError(fmt::format(
        "{}\nUpload the files that it names together with it, or give its path on this machine.",
        error.what()));
  }
  if (!batch.empty()) {
    DropIncoming(base.folder.Root(), batch.filename().string());
  }
}

void ReplaceSkull(const TriMesh& skull, const OpenBase& base,
                  const std::function<void(Opened)>& commit) {
  const FileSubject& files = SubjectFiles(base);
  if (!files.mandible.mesh.empty()) {
    throw InputError(
        "removal: skull and mandible are separate files here; remove the piece in another program");
  }
  constexpr std::string_view kCleaned = "_cleaned";
  std::string stem = files.skull.stem().string();
  if (const std::size_t at = stem.find(kCleaned); at != std::string::npos) {
    stem.resize(at);
  }
  Additions added(base.folder);
  const fs::path file = added.NewPath(fmt::format("{}{}.ply", stem, kCleaned));
  WriteFileAtomically(file, EncodeMesh(ToSubjectFrame(files, skull), ".ply"));
  commit(
      {.what = "removed bone",
       .state = ChangeSetting(base.state, "subject.skull", PathForState(file, base.folder.Root())),
       .notes = {}});
  added.Keep();
}

}  // namespace semblance::problems
