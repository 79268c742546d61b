// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/workbench/bench.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>

#include "problems/app/workbench/bench_actions.h"
#include "problems/app/workbench/bench_config.h"
#include "problems/config/config.h"
#include "problems/experiment/experiment_config.h"
#include "problems/experiment/input_contents.h"
#include "problems/io/staged_folder.h"
#include "problems/report/run_folder.h"
#include "problems/subject/propose/propose_landmarks.h"
#include "problems/subject/sites.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/encoding.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline/feature.h"
#include "surfaces/hspline_files/hspline_json.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using Lock = std::lock_guard<std::mutex>;

constexpr const char* kBeforeEdits = "face_before_edits.hspline.json";
constexpr const char* kRunKey = "run_key.txt";
constexpr const char* kRunFaults = "run_faults.json";
// Number of kept intermediate results of runs: the stages of the present run and those of its
// variants that differ. Fewer values make variants repeat stages, more cost memory.
constexpr int kRunStages = 12;
constexpr int kModels = 6;  // number of kept templates and priors

const FileSubject& SubjectFiles(const Experiment& experiment) {
  const auto* files = std::get_if<FileSubject>(&experiment.subject);
  if (files == nullptr) {
    throw InputError(
        "subject.type: the workbench keeps its subject in files; open another subject by its file");
  }
  return *files;
}

// The experiment without the files that follow from the state (landmarks and edits), and without
// the texts that change no face.
Experiment WithoutStateFiles(Experiment experiment, const BenchState& state) {
  experiment.edits.clear();
  experiment.title.clear();
  experiment.record = {};
  auto* const files = std::get_if<FileSubject>(&experiment.subject);
  if (files != nullptr && !state.landmarks.empty()) {
    files->landmarks.clear();
  }
  return experiment;
}

// The paths and options of the meshes.
std::string SubjectOptions(const Experiment& experiment) {
  FileSubject meshes = SubjectFiles(experiment);
  meshes.landmarks.clear();
  return StageKey("bench subject", meshes);
}

// If the files of a head cannot be read any more, the page shows the fault instead of the meshes,
// so that a person can repair them or open others.
BenchSubject LoadOrExplain(const FileSubject& files, const RunContext& context) {
  try {
    return LoadBenchSubject(files, context);
  } catch (const Error& error) {
    BenchSubject none;
    none.faults = {error.what()};
    return none;
  }
}

InputHashes HashInputs(const Experiment& experiment, FileHashes& hashes) {
  InputHashes contents;
  for (const NamedFile& input : NamedFiles(experiment)) {
    contents[{input.option, input.file}] = HashContent(input, hashes);
  }
  return contents;
}

// Options as text, with the contents of their files.
template <class Options>
std::string ContentText(const Options& options, const std::string& option,
                        const InputHashes& contents) {
  return ToFlowYaml(
      WithInputs(MakeConfigTree(options), NamedFiles(options), [&](const NamedFile& input) {
        return contents.at(
            {option.empty() ? input.option : option + "." + input.option, input.file});
      }));
}

// Text of all that the meshes depend on.
std::string SubjectKey(FileSubject subject, const InputHashes& contents) {
  subject.landmarks.clear();
  return ContentText(subject, "subject", contents);
}

// Returns true if a file that both have has changed.
bool HasChangedFile(const InputHashes& before, const InputHashes& after) {
  return std::ranges::any_of(after, [&](const auto& input) {
    const auto former = before.find(input.first);
    return former != before.end() && former->second != input.second;
  });
}

std::vector<ReferenceHead> ReadReferences(const BenchOptions& options) {
  std::vector<ReferenceHead> heads;
  for (const auto& [skull, landmarks] : options.references) {
    heads.push_back(ReadReference(skull, landmarks, options.threads));
  }
  return heads;
}

// Hash of all that a face depends on, without the edits.
std::string RunKey(const Experiment& experiment, BenchState state, const InputHashes& contents) {
  state.subject.clear();
  return Sha256OfText(ContentText(experiment, "", contents) + LandmarksText(state));
}

std::string HashOfEdits(const BenchState& state) { return Sha256OfText(EditsText(state)); }

// Hash of all else that a run's folder depends on: the edits and the texts of the report.
std::string HashOfRest(const Experiment& experiment, const BenchState& state) {
  return Sha256OfText(EditsText(state) + "\n" + state.subject + "\n" + experiment.title + "\n" +
                      ToFlowYaml(MakeConfigTree(experiment.record)));
}

std::string FaultsText(const RunResult& result) {
  return FaultMarks(PlausibilityToJson(result.plausibility)).dump();
}

bool SameLandmarks(const BenchState& a, const BenchState& b) {
  return LandmarksText(a) == LandmarksText(b);
}

}  // namespace

Bench::Bench(const BenchOptions& options)
    : options_(options), references_(ReadReferences(options)), folder_(options.folder) {
  const RunContext context = Context();
  if (folder_.HasWork()) {
    if (!options.source.empty()) {
      throw InputError(
          fmt::format("{}: this folder holds the work of a workbench; open it without {}, or give "
                      "another --out",
                      folder_.Root().string(), options.source.string()));
    }
    DropAllIncoming(folder_.Root());
    history_ = folder_.Read();
    subject_options_ = SubjectOptions(folder_.ReadExperiment(CurrentState(history_)));
  } else {
    folder_.CheckFree();
    const BenchBeginning beginning = BeginBench(options.source, folder_.Root(), context);
    folder_.Begin(StartConfig(beginning.experiment, folder_.Root()), beginning.state);
    history_ = BeginHistory(beginning.state);
  }
  Commit(history_, /*by_job=*/true);
  LoadStoredRun();
  LoadStoredVariants();
}

Bench::~Bench() { job_.Stop(); }

RunContext Bench::Context() const {
  RunContext context;
  context.threads = options_.threads;
  return context;
}

// The only place where the state changes, invariant (1). by_job: the step comes from the running
// job, which must not cancel itself.
void Bench::Commit(BenchHistory history, bool by_job) {
  const BenchState& state = CurrentState(history);
  Experiment experiment = folder_.ReadExperiment(state);
  const FileSubject& files = SubjectFiles(experiment);
  const Experiment keyed = WithoutStateFiles(experiment, state);
  InputHashes contents = HashInputs(keyed, hashes_);
  std::string subject_key = SubjectKey(SubjectFiles(keyed), contents);
  std::string subject_options = SubjectOptions(experiment);
  const bool is_new_subject = !subject_ || subject_key != subject_key_;
  auto subject = !is_new_subject ? subject_
                 : subject_options == subject_options_
                     ? std::make_shared<const BenchSubject>(LoadOrExplain(files, Context()))
                     : std::make_shared<const BenchSubject>(LoadBenchSubject(files, Context()));
  LandmarkChecks checks =
      subject->bone ? CheckLandmarks(ToLandmarkFile(state),
                                     {subject->skull.mesh, *subject->bone, *subject->ends},
                                     experiment.landmarks)
                    : LandmarkChecks();
  std::string present_key = RunKey(keyed, state, contents);
  const bool has_changed_file = HasChangedFile(contents_, contents);
  std::shared_ptr<StageCache> stages =
      is_new_subject || has_changed_file || !SameLandmarks(state, CurrentState(history_))
          ? std::make_shared<StageCache>(kRunStages)
          : run_stages_;
  std::shared_ptr<StageCache> models =
      has_changed_file || !models_ ? std::make_shared<StageCache>(kModels) : models_;
  folder_.Write(history, experiment);
  if (!by_job) {
    job_.Cancel();
  }
  history_ = std::move(history);
  experiment_ = std::move(experiment);
  subject_ = std::move(subject);
  subject_key_ = std::move(subject_key);
  subject_options_ = std::move(subject_options);
  checks_ = std::move(checks);
  present_key_ = std::move(present_key);
  contents_.merge(contents);  // a file that is not named now may be named again
  for (const auto& [input, content] : contents) {
    contents_[input] = content;
  }
  run_stages_ = std::move(stages);
  models_ = std::move(models);
  subject_revision_ += is_new_subject ? 1 : 0;
  ++revision_;
}

// Commits the present state again if a file that it names has changed on the disk. A fault (of the
// disk, say) leaves the state; the face is stale then.
void Bench::NoticeChangedFiles() {
  const BenchState& state = CurrentState(history_);
  const Experiment keyed = WithoutStateFiles(experiment_, state);
  const std::string key = RunKey(keyed, state, HashInputs(keyed, hashes_));
  if (key == present_key_) {
    return;
  }
  try {
    Commit(history_);
  } catch (const Error&) {
    present_key_ = key;
  }
}

// Loads the face of an earlier workbench, invariant (5).
void Bench::LoadStoredRun() {
  const fs::path key = folder_.Root() / kRunKey, face = folder_.Root() / kBeforeEdits,
                 faults = folder_.Root() / kRunFaults;
  if (!fs::exists(key) || !fs::exists(face) || !fs::exists(faults)) {
    return;
  }
  std::istringstream keys(ReadFileBytes(key));
  RunFace stored{.before_edits = ReadHSpline(face),
                 .dowels = {},
                 .notes = {},
                 .faults = ReadFileBytes(faults),
                 .key = {},
                 .rest = {}};
  keys >> stored.key >> stored.rest;
  if (stored.key == present_key_) {
    try {
      Case head = CoarseCase(*subject_, experiment_, CurrentState(history_));
      stored.dowels = std::move(head.dowels_on_bone);
      stored.notes = std::move(head.notes);
    } catch (const InputError& error) {  // another version of the program judges the input
      stored.notes = {error.what()};
    }
  }
  face_ = std::move(stored);
  face_revision_ = revision_;
}

// Hash of all that the variants' faces depend on.
std::string Bench::VariantsKey() const {
  return Sha256OfText(present_key_ + HashOfEdits(CurrentState(history_)));
}

Experiment Bench::MakeVariantExperiment(BenchVariant variant) const {
  const std::vector<Dowel> dowels =
      CoarseCase(*subject_, experiment_, CurrentState(history_)).dowels_on_bone;
  return VariantExperiment(folder_.ReadSavedExperiment(), variant, dowels, kUsualSd_mm);
}

bool Bench::HasVariant(BenchVariant variant) const {
  const auto at = variants_.find(variant);
  return at != variants_.end() && at->second.key == VariantsKey();
}

void Bench::LoadStoredVariants() {
  if (subject_->bone && fs::exists(folder_.Root() / "variants")) {
    variants_ = StoredVariants(folder_.Root(), VariantsKey(), [this](BenchVariant variant) {
      try {
        return CoarseCase(*subject_, MakeVariantExperiment(variant), CurrentState(history_))
            .dowels_on_bone;
      } catch (const InputError&) {  // as in LoadStoredRun
        return std::vector<Dowel>();
      }
    });
  }
}

Bench::Snapshot Bench::TakeSnapshot() {
  const Lock lock(mutex_);
  NoticeChangedFiles();
  Snapshot shot{.revision = revision_,
                .subject_revision = subject_revision_,
                .history = history_,
                .experiment = experiment_,
                .checks = checks_,
                .subject = subject_,
                .job = job_.Status()};
  if (face_) {
    shot.has_face = true;
    shot.face_revision = face_revision_;
    shot.face_fresh = face_->key == present_key_;
    shot.run_saved =
        shot.face_fresh && face_->rest == HashOfRest(experiment_, CurrentState(history_));
  }
  const std::string key = variants_.empty() ? "" : VariantsKey();
  for (const auto& [variant, made] : variants_) {
    if (made.key == key) {
      shot.variants.push_back(variant);
    }
  }
  return shot;
}

void Bench::Apply(const std::string& what, const std::function<BenchState(BenchState)>& action) {
  const Lock lock(mutex_);
  Commit(AddStep(history_, what, action(CurrentState(history_))));
}

void Bench::Undo() {
  const Lock lock(mutex_);
  Commit(Undone(history_));
}

void Bench::Redo() {
  const Lock lock(mutex_);
  Commit(Redone(history_));
}

void Bench::PlaceByRay(const std::string& site, const Vec3& origin, const Vec3& direction,
                       const Vec3& near) {
  constexpr double kFar_mm = 1e5;  // beyond any head that the camera shows
  const Lock lock(mutex_);
  if (!subject_->bone) {
    throw InputError("landmarks: there is no skull yet; open one first");
  }
  if (!origin.allFinite() || !direction.allFinite() || !near.allFinite() || direction.norm() == 0) {
    throw InputError("landmarks: the ray is not finite");
  }
  const auto hit = subject_->bone->FirstHit(origin, direction, kFar_mm);
  const Vec3 point = hit ? hit->position : subject_->bone->Closest(near).position;
  Commit(AddStep(history_, "placed " + site, PlaceLandmark(CurrentState(history_), site, point)));
}

namespace {

// A file with the landmark of one site.
LandmarkFile OnlySite(const BenchState& state, const std::string& site) {
  LandmarkFile file = ToLandmarkFile(state);
  std::erase_if(file.landmarks, [&](const Landmark& other) { return other.site != site; });
  if (file.landmarks.empty()) {
    throw InputError(fmt::format("landmarks: {} is not placed", DescribeSite(site)));
  }
  return file;
}

}  // namespace

Bench::DowelDirection Bench::FindDirection(const std::string& site) const {
  const Lock lock(mutex_);
  CheckSkull();
  LandmarkFile file = OnlySite(CurrentState(history_), site);
  const auto placed = [&] {
    return PlaceDowels(file, subject_->skull.mesh, *subject_->bone, experiment_.landmarks).front();
  };
  const Dowel given = placed();
  file.landmarks.front().normal.reset();
  return {.base = given.base, .own = placed().direction, .direction = given.direction};
}

void Bench::TurnDowel(const std::string& site, const std::optional<Vec3>& direction) {
  const Lock lock(mutex_);
  CheckSkull();
  BenchState state = TurnLandmark(CurrentState(history_), site, direction);
  const auto turns_deg = TurnsOfDowels(OnlySite(state, site), subject_->skull.mesh, *subject_->bone,
                                       experiment_.landmarks);
  const auto turn = turns_deg.find(site);
  Commit(AddStep(history_,
                 turn == turns_deg.end()
                     ? fmt::format("turned {} to the bone's own direction", site)
                     : fmt::format("turned {} to {:.0f} degrees from the bone's own direction",
                                   site, turn->second),
                 std::move(state)));
}

const RunFace& Bench::FreshFace() const {
  if (!face_ || face_->key != present_key_) {
    throw InputError(
        "sculpting needs a full face of the present options and landmarks; make the full face "
        "first");
  }
  return *face_;
}

void Bench::CorrectFrame(const std::string& path, const std::string& value) {
  const Lock lock(mutex_);
  BenchState state = ChangeSetting(CurrentState(history_), path, value);
  const FileSubject before = SubjectFiles(experiment_),
                    after = SubjectFiles(folder_.ReadExperiment(state));
  std::vector<std::string> on_bone;
  for (const auto& [site, check] : checks_.sites) {
    if (check.from_bone_mm <= experiment_.landmarks.max_distance_mm) {
      on_bone.push_back(site);
    }
  }
  state = ChangeFrame(std::move(state), on_bone, before, after);
  Commit(AddStep(history_, "set " + path, std::move(state)));
}

void Bench::RemoveBone(const Vec3& near, std::optional<double> within_mm) {
  const Lock lock(mutex_);
  CheckSkull();
  if (!near.allFinite()) {
    throw InputError("removal: the point is not finite");
  }
  const MeshPoint at = subject_->bone->Closest(near);
  TriMesh rest = within_mm ? WithoutBall(subject_->skull.mesh, at.position, *within_mm)
                           : WithoutPiece(subject_->skull.mesh, at.triangle);
  ReplaceSkull(rest, {folder_, CurrentState(history_), experiment_}, [this](Opened opened) {
    Commit(AddStep(history_, opened.what, std::move(opened.state)));
  });
}

std::shared_ptr<const VolumeReading> Bench::ReadUnopened(const fs::path& path,
                                                         const ReadVolumeOptions& options) {
  return volume_.Read(path, options, Context());
}

std::vector<VolumeSeries> Bench::FindSeries(const fs::path& path) const {
  return ListSeries(path, Context());
}

HSplineSurface Bench::Edited(const RunFace& face) const {
  HSplineSurface surface = face.before_edits;
  ApplyEdits(CurrentState(history_).edits, surface);
  return surface;
}

void Bench::PullAt(const Vec3& at, Pull pull) {
  const Lock lock(mutex_);
  const HSplineSurface surface = Edited(FreshFace());
  pull.uv = NearestParameter(surface, at);
  Commit(AddStep(
      history_, fmt::format("pulled level {} by {:.1f} mm", pull.level, pull.by_mm.norm()),
      ReplaceEdits(CurrentState(history_), Pulled(pull, surface, CurrentState(history_).edits))));
}

void Bench::BrushAt(const Vec3& at, Brush brush) {
  const Lock lock(mutex_);
  const HSplineSurface surface = Edited(FreshFace());
  brush.uv = NearestParameter(surface, at);
  Commit(AddStep(
      history_, fmt::format("brushed level {} ({})", brush.level, EnumWord(brush.kind)),
      ReplaceEdits(CurrentState(history_), Brushed(brush, surface, CurrentState(history_).edits))));
}

std::array<std::vector<Vec3>, 3> Bench::PullMovesAt(const Vec3& at, Pull pull) const {
  const HSplineSurface surface = [this] {
    const Lock lock(mutex_);
    return Edited(FreshFace());
  }();
  pull.uv = NearestParameter(surface, at);
  return PullMoves(surface, pull, kShownQuadsPerPatch);
}

std::vector<std::string> Bench::PartsOfFace() const {
  const Lock lock(mutex_);
  std::vector<std::string> names;
  for (const TemplateFeature& feature :
       models_
           ->Get<TemplateFace>(StageKey("template", experiment_.face_template),
                               [&] { return LoadTemplate(experiment_.face_template); })
           ->features) {
    names.push_back(feature.name);
  }
  return names;
}

std::vector<std::string> Bench::KeptFeatures() const {
  const fs::path library = folder_.Root() / "features";
  std::vector<std::string> names;
  if (fs::is_directory(library)) {
    for (const auto& [name, feature] : ReadFeatureLibrary(library)) {
      names.push_back(name);
    }
  }
  return names;
}

void Bench::KeepFeature(const std::string& part, const std::string& name) {
  const Lock lock(mutex_);
  const HSplineSurface surface = Edited(FreshFace());
  const auto generic =
      models_->Get<TemplateFace>(StageKey("template", experiment_.face_template),
                                 [&] { return LoadTemplate(experiment_.face_template); });
  const auto found = std::ranges::find(generic->features, part, &TemplateFeature::name);
  if (found == generic->features.end()) {
    throw InputError(fmt::format("features: the template has no part '{}'", part));
  }
  const Feature feature = ExtractFeature(surface, name, std::span<const VertexId>(found->vertices));
  if (fs::exists(folder_.Root() / "features" / (name + ".json"))) {
    throw InputError(fmt::format("features: '{}' exists already; give another name", name));
  }
  StoreFeature(folder_.Root() / "features", feature);
  ++revision_;
}

void Bench::BlendFeature(const std::string& name, double weight) {
  const Lock lock(mutex_);
  const HSplineSurface& own_face = FreshFace().before_edits;
  const std::map<std::string, Feature> library = ReadFeatureLibrary(folder_.Root() / "features");
  const auto found = library.find(name);
  if (found == library.end()) {
    throw InputError(fmt::format("features: there is no '{}' in the folder's features/", name));
  }
  std::vector<VertexId> vertices;
  for (const auto& [vertex, offset] : found->second.offsets) {
    vertices.push_back(vertex);
  }
  const Feature own = ExtractFeature(own_face, "own", std::span<const VertexId>(vertices));
  const Feature blend =
      BlendFeatures(name, std::vector{own, found->second}, std::vector{1 - weight, weight}).feature;
  HSplineSurface tried = own_face;
  ApplyFeature(blend, tried);  // throws if the feature does not fit this face
  std::map<VertexId, std::optional<Vec3>> offsets(blend.offsets.begin(), blend.offsets.end());
  Commit(AddStep(
      history_, fmt::format("blended {:.0f} % of {}", 100 * weight, name),
      ReplaceEdits(CurrentState(history_), WithOffsets(CurrentState(history_).edits, offsets))));
}

// Copies what a coarse face is made of, so that it is made without mutex_.
Bench::CoarseParts Bench::CopyParts() const {
  const Lock lock(mutex_);
  return {.subject = subject_,
          .subject_key = subject_key_,
          .models = models_,
          .experiment = experiment_,
          .state = CurrentState(history_)};
}

// Cached, because the page requests a tried option again once a person keeps it. The key has the
// meshes as they were loaded.
BenchFace Bench::MakeCoarse(const CoarseParts& parts) const {
  if (!parts.subject->bone) {
    throw InputError("there is no skull yet; open one first");
  }
  const Experiment keyed = WithoutStateFiles(parts.experiment, parts.state);
  const std::string key = parts.subject_key + EditsText(parts.state) +
                          RunKey(keyed, parts.state, HashInputs(keyed, hashes_));
  return *coarse_.Get<BenchFace>(key, [&] {
    const auto start = std::chrono::steady_clock::now();
    BenchFace face =
        CoarseFace(*parts.subject, parts.experiment, parts.state, *parts.models, Context());
    face.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return face;
  });
}

BenchFace Bench::Coarse(BenchVariant variant) const {
  CoarseParts parts = CopyParts();
  BenchFace face = MakeCoarse(parts);
  if (variant != BenchVariant::kAsIs) {
    parts.experiment = VariantExperiment(parts.experiment, variant, face.dowels, kUsualSd_mm);
    face = MakeCoarse(parts);
  }
  return face;
}

BenchFace Bench::CoarseWith(const BenchSetting& setting) const {
  CoarseParts parts = CopyParts();
  parts.state = ChangeSetting(parts.state, setting.path, setting.value);
  parts.experiment = folder_.ReadExperiment(parts.state);
  return MakeCoarse(parts);
}

BenchFace Bench::Full() const {
  const Lock lock(mutex_);
  if (!face_) {
    throw InputError("there is no full run yet");
  }
  return {Edited(*face_), face_->dowels, face_->notes, face_->faults};
}

BenchFace Bench::FullVariant(BenchVariant variant) const {
  const Lock lock(mutex_);
  if (!HasVariant(variant)) {
    throw InputError(
        fmt::format("variants: the full face of '{}' does not exist yet", VariantName(variant)));
  }
  return variants_.at(variant).face;
}

// The face of the run if the variant is kAsIs and that face is fresh.
std::optional<BenchFace> Bench::FaceAsIs(BenchVariant variant) const {
  const bool is_fresh = variant == BenchVariant::kAsIs && face_ && face_->key == present_key_;
  return is_fresh
             ? std::optional(BenchFace{Edited(*face_), face_->dowels, face_->notes, face_->faults})
             : std::nullopt;
}

void Bench::MakeVariant(BenchVariant variant, int revision, const RunContext& context) {
  std::shared_ptr<StageCache> stages;
  Experiment experiment;
  std::optional<BenchFace> face;
  {
    const Lock lock(mutex_);
    if (HasVariant(variant)) {
      return;
    }
    stages = run_stages_;
    experiment = MakeVariantExperiment(variant);
    face = FaceAsIs(variant);
  }
  if (!face) {
    const RunResult result = Run(experiment, context, stages.get());
    face = {result.fit.surface, result.subject.dowels_on_bone, result.subject.notes,
            FaultsText(result)};
  }
  const Lock lock(mutex_);
  if (revision != revision_) {
    throw Cancelled();
  }
  const VariantFace made{*std::move(face), VariantsKey()};
  StoreVariant(folder_.Root(), variant, made);
  variants_.insert_or_assign(variant, made);
}

// Replaces the running job. It waits for that job without mutex_, because the job's last step may
// need it. starting_ keeps other threads from starting a job meanwhile.
void Bench::StartJob(const std::string& name, const std::function<Work()>& prepare) {
  const Lock starting(starting_);
  job_.Stop();
  const Lock lock(mutex_);
  NoticeChangedFiles();  // so that present_key_ is of files as they are before the work
  job_.Start(name, options_.threads, prepare());
}

void Bench::CheckSkull() const {
  if (!subject_->bone) {
    throw InputError("there is no skull yet; open one first");
  }
}

std::string Bench::MakeVariants(const std::vector<BenchVariant>& variants, int revision,
                                const RunContext& context) {
  for (std::size_t k = 0; k < variants.size(); ++k) {
    RunContext inner = context;
    inner.on_event = [&, k](Event event) {
      event.step = fmt::format("{} ({} of {}), {}", VariantName(variants[k]), k + 1,
                               variants.size(), event.step);
      context.on_event(event);
    };
    MakeVariant(variants[k], revision, inner);
  }
  return "done";
}

void Bench::StartVariants(const std::vector<BenchVariant>& variants) {
  StartJob("variants", [&] {
    CheckSkull();
    return [this, variants, revision = revision_](const RunContext& context) {
      return MakeVariants(variants, revision, context);
    };
  });
}

RunFace Bench::MakeRun(Experiment experiment, const RunContext& context, int revision) {
  experiment.report = true;  // the page links to it
  std::shared_ptr<StageCache> stages;
  {
    const Lock lock(mutex_);
    stages = run_stages_;
  }
  const RunResult result = Run(experiment, context, stages.get());
  RefuseLinksBelow(folder_.Root(), "run");
  StagedFolder staged(folder_.Root() / "run", WhenNotEmpty::kReplaceFiles);
  WriteRun(experiment, result, staged.Files(), context);
  const Lock lock(mutex_);
  if (revision != revision_) {
    throw Cancelled();  // the state has changed since the run read its files
  }
  staged.Publish();
  RunFace face{result.before_edits.value_or(result.fit.surface),
               result.subject.dowels_on_bone,
               result.subject.notes,
               FaultsText(result),
               present_key_,
               HashOfRest(experiment_, CurrentState(history_))};
  WriteHSpline(folder_.Root() / kBeforeEdits, face.before_edits);
  WriteFileAtomically(folder_.Root() / kRunFaults, face.faults);
  WriteFileAtomically(folder_.Root() / kRunKey, face.key + "\n" + face.rest + "\n");
  face_ = face;
  face_revision_ = ++revision_;
  return face;
}

void Bench::CancelJob() {
  const Lock lock(mutex_);
  job_.Cancel();
}

void Bench::StartRun() {
  StartJob("run", [&] {
    return [this, experiment = folder_.ReadSavedExperiment(),
            revision = revision_](const RunContext& context) {
      MakeRun(experiment, context, revision);
      return std::string("done");
    };
  });
}

std::string Bench::Propose(const RunContext& context) {
  std::shared_ptr<const BenchSubject> subject;
  BenchState state;
  int revision = 0;
  {
    const Lock lock(mutex_);
    subject = subject_;
    state = CurrentState(history_);
    revision = revision_;
  }
  const std::vector<SitePoint> known = ConfirmedSites(state);
  const Proposal proposal =
      references_.empty()
          ? ProposeLandmarks(subject->skull.mesh, "the skull", ReadMeanSkull(), context, known)
          : ProposeLandmarks(subject->skull.mesh, "the skull", references_, context, known);
  LandmarkFile file = ProposalFile(proposal, state.subject);
  file.axes = "LPS";  // the points lie on the mesh as it is shown here
  const Lock lock(mutex_);
  if (revision != revision_) {
    throw Cancelled();
  }
  Commit(AddStep(history_, "proposed landmarks", AddProposals(CurrentState(history_), file)),
         /*by_job=*/true);
  std::string words =
      fmt::format("{} sites proposed, {} absent; review them, the most doubtful first",
                  file.landmarks.size(), file.absent.size());
  if (proposal.axes == "RAS") {
    words += ". The skull seems to lie in RAS axes: if its file does, set its axes to RAS";
  }
  return words;
}

std::string Bench::Open(const OpenRequest& request, const RunContext& context) {
  BenchState state;
  Experiment experiment;
  int revision = 0;
  {
    const Lock lock(mutex_);
    state = CurrentState(history_);
    experiment = experiment_;
    revision = revision_;
  }
  volume_.Drop();  // the opening reads it with options of its own
  std::string words;
  OpenImportedFile(request, {folder_, state, experiment}, context, [&](Opened opened) {
    const Lock lock(mutex_);
    if (revision != revision_) {
      throw Cancelled();
    }
    words = fmt::format("{}", fmt::join(opened.notes, "; "));
    Commit(AddStep(history_, opened.what, std::move(opened.state)), /*by_job=*/true);
  });
  return words;
}

void Bench::StartOpening(const OpenRequest& request) {
  StartJob("open", [&] {
    return [this, request](const RunContext& context) { return Open(request, context); };
  });
}

void Bench::StartProposal() {
  StartJob("propose", [&] {
    CheckSkull();
    return [this](const RunContext& context) { return Propose(context); };
  });
}

}  // namespace semblance::problems
