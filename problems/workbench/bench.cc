// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/workbench/bench.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <utility>

#include "problems/config/config.h"
#include "problems/output/staged_folder.h"
#include "problems/pipeline/experiment_config.h"
#include "problems/propose/propose_landmarks.h"
#include "problems/report/run_folder.h"
#include "problems/workbench/bench_actions.h"
#include "problems/workbench/bench_config.h"
#include "problems/workbench/bench_incoming.h"
#include "problems/workbench/bench_pull.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/encoding.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline/feature.h"
#include "surfaces/hspline_files/hspline_json.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;
using Lock = std::lock_guard<std::mutex>;

constexpr const char* kBeforeEdits = "face_before_edits.hspline.json";
constexpr const char* kRunKey = "run_key.txt";
constexpr int kStages = 12;

const FileSubject& FilesOf(const Experiment& experiment) {
  const auto* files = std::get_if<FileSubject>(&experiment.subject);
  if (files == nullptr) {
    throw InputError(
        "subject.type: the workbench holds its subject in files; open another one by its file");
  }
  return *files;
}

// All that the meshes depend on.
std::string SubjectKey(const FileSubject& subject) {
  FileSubject meshes = subject;
  meshes.landmarks.clear();
  return StageKey("bench subject", meshes);
}

std::vector<ReferenceHead> ReadReferences(const BenchOptions& options) {
  std::vector<ReferenceHead> heads;
  for (const auto& [skull, landmarks] : options.references) {
    heads.push_back(ReadReference(skull, landmarks, options.threads));
  }
  return heads;
}

// All that a face depends on, edits apart.
std::string KeyOfRun(Experiment experiment, const BenchState& state, const fs::path& folder) {
  experiment.edits.clear();
  return ShortConfig(experiment, folder) + LandmarksText(state);
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
      throw InputError(fmt::format(
          "{}: it holds the work of a workbench; open it without {}, or give another --out",
          folder_.Root().string(), options.source.string()));
    }
    DropAllIncoming(folder_.Root());
    history_ = folder_.Read();
  } else {
    folder_.CheckFree();
    const BenchBeginning beginning = BeginBench(options.source, folder_.Root(), context);
    folder_.Begin(StartConfig(beginning.experiment, folder_.Root()), beginning.state);
    history_ = BeginHistory(beginning.state);
  }
  Take(history_, /*keeps_run=*/true);
  FindFormerRun();
  FindFormerVariants();
}

Bench::~Bench() { job_.Stop(); }

RunContext Bench::Context() const {
  RunContext context;
  context.threads = options_.threads;
  return context;
}

// The one place where the state changes: first all that may fail, then the files, then the rest.
void Bench::Take(BenchHistory history, bool keeps_run) {
  Experiment experiment = folder_.ExperimentOf(Now(history));
  LoadSubjectOf(experiment, Context());
  const bool same_landmarks = SameLandmarks(Now(history), Now(history_));
  folder_.Write(history, experiment);
  if (!keeps_run) {
    job_.Cancel();
  }
  if (!same_landmarks || !run_stages_) {
    run_stages_ = std::make_shared<StageCache>(kStages);
  }
  present_key_ = KeyOfRun(experiment, Now(history), folder_.Root());
  history_ = std::move(history);
  experiment_ = std::move(experiment);
  checks_ = subject_->bone ? CheckLandmarks(LandmarksOf(Now(history_)), subject_->skull.mesh,
                                            *subject_->bone, experiment_.landmarks)
                           : LandmarkChecks();
  ++revision_;
}

void Bench::LoadSubjectOf(const Experiment& experiment, const RunContext& context) {
  const FileSubject& files = FilesOf(experiment);
  const std::string key = SubjectKey(files);
  if (subject_ && key == subject_key_) {
    return;
  }
  subject_ = std::make_shared<const BenchSubject>(LoadBenchSubject(files, context));
  subject_key_ = key;
  run_stages_.reset();
  ++subject_revision_;
}

// A run of the present state that another workbench has left.
void Bench::FindFormerRun() {
  const fs::path key = folder_.Root() / kRunKey, face = folder_.Root() / kBeforeEdits;
  const BenchState& state = Now(history_);
  if (!fs::exists(key) || !fs::exists(face)) {
    return;
  }
  const std::string edits = EditsText(state);
  if (ReadFileBytes(key) == Sha256OfText(present_key_ + edits)) {
    Case head = CoarseCase(*subject_, experiment_, state);
    face_.emplace(RunFace{ReadHSpline(face), std::move(head.dowels_on_bone), std::move(head.notes),
                          present_key_, edits});
    face_revision_ = revision_;
  }
}

// All that the variants' faces depend on.
std::string Bench::KeyOfVariants() const {
  return Sha256OfText(present_key_ + EditsText(Now(history_)));
}

Experiment Bench::ExperimentOfVariant(BenchVariant variant) const {
  const std::vector<Dowel> dowels =
      CoarseCase(*subject_, experiment_, Now(history_)).dowels_on_bone;
  return VariantOf(folder_.ExperimentAsSaved(), variant, dowels, kUsualSd_mm);
}

bool Bench::HasVariant(BenchVariant variant) const {
  const auto at = variants_.find(variant);
  return at != variants_.end() && at->second.key == KeyOfVariants();
}

void Bench::FindFormerVariants() {
  if (subject_->bone && fs::exists(folder_.Root() / "variants")) {
    variants_ = StoredVariants(folder_.Root(), KeyOfVariants(), [this](BenchVariant variant) {
      return CoarseCase(*subject_, ExperimentOfVariant(variant), Now(history_)).dowels_on_bone;
    });
  }
}

Bench::Snapshot Bench::Look() const {
  const Lock lock(mutex_);
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
    shot.run_saved = shot.face_fresh && face_->edits == EditsText(Now(history_));
  }
  const std::string key = variants_.empty() ? "" : KeyOfVariants();
  for (const auto& [variant, made] : variants_) {
    if (made.key == key) {
      shot.variants.push_back(variant);
    }
  }
  return shot;
}

void Bench::Do(const std::string& what, const std::function<BenchState(BenchState)>& action) {
  const Lock lock(mutex_);
  Take(Done(history_, what, action(Now(history_))));
}

void Bench::Undo() {
  const Lock lock(mutex_);
  Take(Undone(history_));
}

void Bench::Redo() {
  const Lock lock(mutex_);
  Take(Redone(history_));
}

void Bench::PlaceByRay(const std::string& site, const Vec3& origin, const Vec3& direction,
                       const Vec3& near) {
  constexpr double kFar_mm = 1e5;
  const Lock lock(mutex_);
  if (!subject_->bone) {
    throw InputError("landmarks: there is no skull yet; open one first");
  }
  if (!origin.allFinite() || !direction.allFinite() || !near.allFinite() || direction.norm() == 0) {
    throw InputError("landmarks: the ray is not finite");
  }
  const auto hit = subject_->bone->FirstHit(origin, direction, kFar_mm);
  const Vec3 point = hit ? hit->position : subject_->bone->Closest(near).position;
  Take(Done(history_, "placed " + site, PlaceLandmark(Now(history_), site, point)));
}

void Bench::TakePredicted() {
  const Lock lock(mutex_);
  if (checks_.predicted.empty()) {
    throw InputError(
        "landmarks: none is predicted; place three or more that do not lie on a line, on a head in "
        "mm and LPS");
  }
  Take(Done(history_, "suggested the other landmarks",
            TakeProposals(Now(history_), PredictedLandmarks(checks_))));
}

const RunFace& Bench::FreshFace() const {
  if (!face_ || face_->key != present_key_) {
    throw InputError("the face is sculpted after a full run of the present choices; run first");
  }
  return *face_;
}

void Bench::CorrectFrame(const std::string& path, const std::string& value) {
  const Lock lock(mutex_);
  BenchState state = ChangeSetting(Now(history_), path, value);
  const FileSubject before = FilesOf(experiment_), after = FilesOf(folder_.ExperimentOf(state));
  std::vector<std::string> on_bone;
  for (const auto& [site, check] : checks_.sites) {
    if (check.from_bone_mm <= experiment_.landmarks.max_distance_mm) {
      on_bone.push_back(site);
    }
  }
  state = InOtherFrame(std::move(state), on_bone, before, after);
  Take(Done(history_, "set " + path, std::move(state)));
}

HSplineSurface Bench::Edited(const RunFace& face) const {
  HSplineSurface surface = face.before_edits;
  ApplyEdits(Now(history_).edits, surface);
  return surface;
}

void Bench::PullAt(const Vec3& at, Pull pull) {
  const Lock lock(mutex_);
  const HSplineSurface surface = Edited(FreshFace());
  pull.uv = HeldParameter(surface, at);
  Take(Done(history_, fmt::format("pulled level {} by {:.1f} mm", pull.level, pull.by_mm.norm()),
            TakeEdits(Now(history_), Pulled(pull, surface, Now(history_).edits))));
}

std::array<std::vector<Vec3>, 3> Bench::PullMovesAt(const Vec3& at, Pull pull) const {
  const HSplineSurface surface = [this] {
    const Lock lock(mutex_);
    return Edited(FreshFace());
  }();
  pull.uv = HeldParameter(surface, at);
  return PullMoves(surface, pull, kShownQuadsPerPatch);
}

std::vector<std::string> Bench::PartsOfFace() const {
  const Lock lock(mutex_);
  std::vector<std::string> names;
  for (const TemplateFeature& feature :
       models_
           .Get<TemplateFace>(StageKey("template", experiment_.face_template),
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
      models_.Get<TemplateFace>(StageKey("template", experiment_.face_template),
                                [&] { return LoadTemplate(experiment_.face_template); });
  const auto found = std::ranges::find(generic->features, part, &TemplateFeature::name);
  if (found == generic->features.end()) {
    throw InputError(fmt::format("features: the generic face has no part '{}'", part));
  }
  const Feature feature = ExtractFeature(surface, name, std::span<const VertexId>(found->vertices));
  if (fs::exists(folder_.Root() / "features" / (name + ".json"))) {
    throw InputError(fmt::format("features: '{}' is there already; give another name", name));
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
  ApplyFeature(blend, tried);  // whether it fits this face
  std::map<VertexId, std::optional<Vec3>> offsets(blend.offsets.begin(), blend.offsets.end());
  Take(Done(history_, fmt::format("blended {:.0f} % of {}", 100 * weight, name),
            TakeEdits(Now(history_), WithOffsets(Now(history_).edits, offsets))));
}

// What was tried out is asked for again once it is kept.
BenchFace Bench::CoarseOf(const BenchSubject& subject, const Experiment& experiment,
                          const BenchState& state) const {
  if (!subject.bone) {
    throw InputError("there is no skull yet; open one first");
  }
  const std::string key = KeyOfRun(experiment, state, folder_.Root()) + EditsText(state);
  return *coarse_.Get<BenchFace>(key, [&] {
    const auto start = std::chrono::steady_clock::now();
    BenchFace face = CoarseFace(subject, experiment, state, models_, Context());
    face.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return face;
  });
}

BenchFace Bench::Coarse(BenchVariant variant) const {
  std::shared_ptr<const BenchSubject> subject;
  Experiment experiment;
  BenchState state;
  {
    const Lock lock(mutex_);
    subject = subject_;
    experiment = experiment_;
    state = Now(history_);
  }
  BenchFace face = CoarseOf(*subject, experiment, state);
  return variant == BenchVariant::kAsIs
             ? face
             : CoarseOf(*subject, VariantOf(experiment, variant, face.dowels, kUsualSd_mm), state);
}

BenchFace Bench::CoarseWith(const BenchSetting& setting) const {
  std::shared_ptr<const BenchSubject> subject;
  BenchState state;
  {
    const Lock lock(mutex_);
    subject = subject_;
    state = ChangeSetting(Now(history_), setting.path, setting.value);
  }
  return CoarseOf(*subject, folder_.ExperimentOf(state), state);
}

BenchFace Bench::Full() const {
  const Lock lock(mutex_);
  if (!face_) {
    throw InputError("there is no full run yet");
  }
  return {Edited(*face_), face_->dowels, face_->notes};
}

BenchFace Bench::FullVariant(BenchVariant variant) const {
  const Lock lock(mutex_);
  if (!HasVariant(variant)) {
    throw InputError(
        fmt::format("variants: the full face of '{}' is not made yet", NameOf(variant)));
  }
  return variants_.at(variant).face;
}

// The run's own face where that is meant, and is there.
std::optional<BenchFace> Bench::FaceAsIs(BenchVariant variant) const {
  const bool is_there = variant == BenchVariant::kAsIs && face_ && face_->key == present_key_;
  return is_there ? std::optional(BenchFace{Edited(*face_), face_->dowels, face_->notes})
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
    experiment = ExperimentOfVariant(variant);
    face = FaceAsIs(variant);
  }
  if (!face) {
    const RunResult result = semblance::Run(experiment, context, stages.get());
    face = {result.fit.surface, result.subject.dowels_on_bone, result.subject.notes};
  }
  const Lock lock(mutex_);
  if (revision != revision_) {
    throw Cancelled();
  }
  const VariantFace made{*std::move(face), KeyOfVariants()};
  StoreVariant(folder_.Root(), variant, made);
  variants_.insert_or_assign(variant, made);
}

// In place of what runs. That is waited for without the lock, which its last step may need; and
// nobody else starts anything meanwhile.
void Bench::StartJob(const std::string& name, const std::function<Work()>& prepare) {
  const Lock starting(starting_);
  job_.Stop();
  const Lock lock(mutex_);
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
      event.step =
          fmt::format("{} ({} of {}), {}", NameOf(variants[k]), k + 1, variants.size(), event.step);
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

RunFace Bench::FinishRun(const Experiment& experiment, const RunContext& context, int revision) {
  std::shared_ptr<StageCache> stages;
  {
    const Lock lock(mutex_);
    stages = run_stages_;
  }
  const RunResult result = semblance::Run(experiment, context, stages.get());
  StagedFolder staged(folder_.Root() / "run", WhenNotEmpty::kReplaceFiles);
  WriteRun(experiment, result, staged.Files(), context);
  const Lock lock(mutex_);
  if (revision != revision_) {
    throw Cancelled();  // the files that it has read may have changed under it
  }
  staged.Publish();
  RunFace face{result.before_edits.value_or(result.fit.surface), result.subject.dowels_on_bone,
               result.subject.notes, present_key_, EditsText(Now(history_))};
  WriteHSpline(folder_.Root() / kBeforeEdits, face.before_edits);
  WriteFileAtomically(folder_.Root() / kRunKey, Sha256OfText(face.key + face.edits));
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
    return [this, experiment = folder_.ExperimentAsSaved(),
            revision = revision_](const RunContext& context) {
      FinishRun(experiment, context, revision);
      return std::string("done");
    };
  });
}

std::string Bench::Propose(const RunContext& context) {
  std::shared_ptr<const BenchSubject> subject;
  std::string name;
  int revision = 0;
  {
    const Lock lock(mutex_);
    subject = subject_;
    name = Now(history_).subject;
    revision = revision_;
  }
  std::vector<ReferenceHead> made_up;
  if (references_.empty()) {
    made_up.push_back(PhantomReference(1));
    made_up.push_back(PhantomReference(2));
  }
  const Proposal proposal = ProposeLandmarks(subject->skull.mesh, "the skull",
                                             references_.empty() ? made_up : references_, context);
  LandmarkFile file = ProposalFile(proposal, name);
  file.axes = "LPS";  // the points are where they were seen, on the mesh as it stands here
  const Lock lock(mutex_);
  if (revision != revision_) {
    throw Cancelled();
  }
  Take(Done(history_, "proposed landmarks", TakeProposals(Now(history_), file)),
       /*keeps_run=*/true);
  std::string words = fmt::format("{} sites proposed, {} absent; look at each",
                                  file.landmarks.size(), file.absent.size());
  if (proposal.axes == "RAS") {
    words += ". The skull lies as in RAS: if its file is, set its axes to RAS";
  }
  if (references_.empty()) {
    words += ". Made-up heads served as references, which have no orbits, arches or teeth";
  }
  return words;
}

std::string Bench::Open(const OpenRequest& request, const RunContext& context) {
  BenchState state;
  Experiment experiment;
  int revision = 0;
  {
    const Lock lock(mutex_);
    state = Now(history_);
    experiment = experiment_;
    revision = revision_;
  }
  std::string words;
  OpenBrought(request, {folder_, state, experiment}, context, [&](Opened opened) {
    const Lock lock(mutex_);
    if (revision != revision_) {
      throw Cancelled();
    }
    words = fmt::format("{}", fmt::join(opened.notes, "; "));
    Take(Done(history_, opened.what, std::move(opened.state)), /*keeps_run=*/true);
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

}  // namespace semblance
