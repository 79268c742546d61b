// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <memory>

#include "fitting/plan/fit_result.h"
#include "problems/experiment/experiment_config.h"
#include "problems/experiment/make_face.h"
#include "problems/face/hspline_prior.h"
#include "surfaces/hspline_files/hspline_json.h"
#include "surfaces/mesh/refine_mesh.h"

namespace semblance::problems {
namespace {

using InputPaths = std::vector<std::filesystem::path>;

void Append(const InputPaths& more, InputPaths& files) {
  files.insert(files.end(), more.begin(), more.end());
}

// ---------------------------------------------------------------------------------------------
// Notes
// ---------------------------------------------------------------------------------------------

bool UsesPublishedDeviations(const Experiment& experiment, const Case& subject) {
  return experiment.tissue.depths == DepthSource::kTable &&
         experiment.uncertainty.dowel_sd_mm == 0 &&
         std::ranges::any_of(subject.dowels_on_bone,
                             [](const Dowel& d) { return std::isnan(d.sd_mm); });
}

void NoteUncertainty(const Experiment& experiment, const FaceUncertainty& uncertainty,
                     Case& subject) {
  for (const std::string& term : uncertainty.left_out) {
    subject.notes.push_back(
        fmt::format("the uncertainty of the face leaves out the fit's term '{}', which couples x, "
                    "y and z; so it "
                    "is too large rather than too small",
                    term));
  }
  if (UsesPublishedDeviations(experiment, subject)) {
    subject.notes.push_back(
        "the table states no standard deviation: the uncertainty of the face uses those of the "
        "T-Table 2023 (Hona & Stephan 2024), or uncertainty.dowel_sd_mm if it is given");
  }
}

void NoteFace(const Experiment& experiment, const LoadedPrior* prior, Case& subject) {
  std::ranges::move(UnusedOptions(experiment), std::back_inserter(subject.notes));
  const FaceSource way = WayToFace(experiment);
  const PriorUse* const use = FindPriorUse(way);
  if (use != nullptr && use->draw > 0) {
    subject.notes.push_back(
        fmt::format("the face is not the most likely one, but number {} of those drawn from what "
                    "bone and depths leave possible",
                    use->draw));
  }
  std::ranges::move(
      ExplainUnusedRules(experiment.rules, subject.points, subject.basis.sites.has_value(),
                         prior != nullptr ? &prior->face : nullptr),
      std::back_inserter(subject.notes));
}

// The distance across the face from a site of the prior's face to the end of its dowel. NaN for
// other sites.
double DistanceAcross_mm(const FacePrior& prior, const ShapeEstimate& estimate,
                         const std::vector<Dowel>& dowels, std::size_t tip) {
  const std::string& label = estimate.tip_labels[tip];
  const auto site = prior.sites.find(label);
  const auto dowel = std::ranges::find(dowels, label, &Dowel::site);
  if (site == prior.sites.end() || dowel == dowels.end()) {
    return kNaN;
  }
  const Vec3 at = FindPosition(site->second, prior.model.mean, estimate.points);
  const double along_mm = estimate.tip_residual_mm[tip];
  return std::sqrt(std::max(0.0, (dowel->Tip() - at).squaredNorm() - along_mm * along_mm));
}

// A dowel that contradicts the face model, the other dowels and the bone. It counts less, so the
// face does not follow it, and its landmark or its depth is probably wrong. A phantom's sites are
// not where people have them.
void NoteDisagreeingDowels(const MadeFace& made, const LoadedPrior* prior, bool is_person,
                           Case& subject) {
  // Below this weight the tip lies more than five standard deviations off. On three measured heads
  // no dowel's weight is below 1.
  constexpr double kLeastWeight = 0.6;
  constexpr double kFarAlong_mm = 2;  // four deviations of a measured tip
  if (!made.prior || prior == nullptr) {
    return;
  }
  const ShapeEstimate& estimate = *made.prior;
  for (std::size_t k = 0; k < estimate.tip_labels.size(); ++k) {
    const double along_mm = estimate.tip_residual_mm[k], weight = estimate.tip_weight[k];
    const bool is_far = std::abs(along_mm) > kFarAlong_mm;
    if (weight >= kLeastWeight || (!is_far && !is_person)) {
      continue;
    }
    const std::string where =
        is_far ? fmt::format("the face lies {:.1f} mm {} its end", std::abs(along_mm),
                             along_mm > 0 ? "below" : "above")
               : fmt::format("its end lies {:.0f} mm beside its place on the face",
                             DistanceAcross_mm(prior->face, estimate, subject.dowels_on_bone, k));
    subject.notes.push_back(
        fmt::format("the depth marker at {} disagrees with the others: {}, and it counts {:.0f} %; "
                    "check its landmark and its depth",
                    estimate.tip_labels[k], where, 100 * weight));
  }
}

// ---------------------------------------------------------------------------------------------
// Measuring
// ---------------------------------------------------------------------------------------------

std::shared_ptr<const OuterSkin> GetOuterSkin(const Experiment& experiment, const TriMesh& skin,
                                              StageCache& cache) {
  const double probe_mm = experiment.region.probe_mm;
  return cache.Get<OuterSkin>(
      StageKey("outer skin", experiment.subject) + fmt::format("\n{}", probe_mm),
      [&] { return FindOuterSkin(skin, probe_mm); });
}

TruthComparison CompareWithTruth(const Experiment& experiment, const SkullStage& skull,
                                 ScoredSkin scored, const TriMesh& face,
                                 const std::optional<FaceUncertainty>& uncertainty,
                                 std::span<const Sphere> masks, const RunContext& context) {
  const Case& subject = skull.depth_stage->subject;
  const TriMesh& skin = *subject.skin;
  TruthComparison truth;
  truth.skin = std::move(scored);
  const TriMesh fine = RefineTo(face, kEdgeForSums_mm);  // as `semblance evaluate`
  truth.face = CompareFaces(skin, truth.skin.region, fine, context);
  truth.details = MeasureDetails(skin, truth.skin, subject.basis, fine, context);
  truth.implicit = CompareFaces(skin, truth.skin.region, skull.implicit.mesh, context);
  truth.depth = CompareDepths(experiment, *skull.depth_stage, skull.depth_stage->depth, context);
  if (uncertainty && experiment.uncertainty.sigma) {
    truth.sigma = MeasureCoverage({skin, truth.face.signed_mm, truth.skin.region.part}, face,
                                  uncertainty->sigma_mm, masks, context);
  }
  return truth;
}

// The error of the face in the features of a template is unknown. A prior covers nose, mouth and
// eyes, and so does its sigma.
std::vector<Sphere> SigmaMasks(const MadeFace& made) {
  return made.prior ? std::vector<Sphere>() : TemplateMasks(made.placed.face);
}

// ---------------------------------------------------------------------------------------------
// The job
// ---------------------------------------------------------------------------------------------

// The steps of Run in their order. Each leaves its result for the later ones.
class FaceJob {
 public:
  FaceJob(const Experiment& experiment, const RunContext& context, StageCache& cache)
      : experiment_(experiment), context_(context), cache_(cache), step_(context) {}

  void LoadBustModel();  // before anything long, because an unusable bust ends the run
  void PrepareSkull();
  void FindSkinToScore();  // before the fit, so that a region without skin does not cost one
  void LoadTemplateAndPrior();
  void MakeSubjectsFace();
  void ReplayEdits();
  void TessellateFace();
  void EstimateUncertainty();
  void MeasureFace();
  void NoteSmallTruth();
  // A phantom is not one.
  bool IsPerson() const { return !std::holds_alternative<PhantomOptions>(experiment_.subject); }
  void Judge();
  void PutFaceOnBust();
  RunResult TakeResult();

 private:
  std::optional<FaceUncertainty> FindUncertainty();
  const HSplineSurface& surface() const { return made_->fitted.fit.surface; }

  const Experiment& experiment_;
  const RunContext& context_;
  StageCache& cache_;
  StepClock step_;

  std::shared_ptr<const BustModel> bust_model_;  // null: no bust
  std::shared_ptr<const SkullStage> skull_;
  Case subject_;                      // the skull stage's, with notes and inputs of later steps
  std::optional<ScoredSkin> scored_;  // none: the true skin is not known
  std::shared_ptr<const TemplateFace> generic_;
  std::shared_ptr<const LoadedPrior> prior_;  // null: the face does not use one
  TriMesh seedable_;                          // part of the implicit face
  std::optional<MadeFace> made_;
  std::optional<HSplineSurface> before_edits_;
  Tessellation face_;
  std::optional<FaceUncertainty> uncertainty_;
  std::optional<TruthComparison> truth_;
  Plausibility plausibility_;
  std::optional<Bust> bust_;
};

void FaceJob::LoadBustModel() {
  bust_model_ = step_("load bust", [&]() -> std::shared_ptr<const BustModel> {
    if (std::holds_alternative<NoBust>(experiment_.bust)) {
      return nullptr;
    }
    const auto model = cache_.Get<std::optional<BustModel>>(
        StageKey("bust", experiment_.bust, experiment_.face_template),
        [&] { return LoadBust(experiment_.bust, experiment_.face_template, context_); });
    return *model ? std::shared_ptr<const BustModel>(model, &**model) : nullptr;
  });
}

void FaceJob::PrepareSkull() {
  skull_ = MakeSkullStage(experiment_, cache_, step_, context_);
  subject_ = skull_->depth_stage->subject;
  CheckFaceOptions(experiment_, subject_);
}

void FaceJob::FindSkinToScore() {
  scored_ = step_("find the skin to score", [&]() -> std::optional<ScoredSkin> {
    if (!subject_.skin) {
      return std::nullopt;
    }
    const auto outer = GetOuterSkin(experiment_, *subject_.skin, cache_);
    ScoredSkin scored = FindScoredSkin(subject_, *outer, experiment_.region);
    CheckScored(scored.region);
    return scored;
  });
}

void FaceJob::LoadTemplateAndPrior() {
  const TemplateSource& source = experiment_.face_template;
  generic_ = step_("make template", [&] {
    return cache_.Get<TemplateFace>(StageKey("template", source),
                                    [&source] { return LoadTemplate(source); });
  });
  prior_ = step_("load prior",
                 [&] { return LoadExperimentPrior(experiment_, *generic_, cache_, context_); });
  Append(TemplateFiles(source), subject_.inputs);
  Append(prior_ ? PriorFiles(experiment_.prior) : InputPaths(), subject_.inputs);
}

void FaceJob::MakeSubjectsFace() {
  seedable_ = SeedableFace(experiment_, skull_->cuts, skull_->implicit.dense, subject_);
  made_ = step_("fit", [&] {
    return MakeFace({experiment_, *generic_, prior_.get(), subject_, seedable_,
                     skull_->depth_stage->shell, skull_->field.get()},
                    context_);
  });
  NoteFace(experiment_, prior_.get(), subject_);
  NoteDisagreeingDowels(*made_, prior_.get(), IsPerson(), subject_);
}

void FaceJob::ReplayEdits() {
  before_edits_ = EditByHand(experiment_, *made_, subject_);
  CheckFinite(surface());
}

void FaceJob::TessellateFace() {
  face_ = step_("tessellate", [&] { return Tessellate(surface(), kFaceQuadsPerPatch); });
}

void FaceJob::EstimateUncertainty() {
  uncertainty_ = step_("uncertainty", [&] { return FindUncertainty(); });
}

// A face that was only placed or bent has none.
std::optional<FaceUncertainty> FaceJob::FindUncertainty() {
  const UncertaintyOptions& options = experiment_.uncertainty;
  if (made_->prior) {
    return options.sigma || !made_->samples.empty()
               ? std::optional(PriorUncertainty(options, *prior_, *made_, face_))
               : std::nullopt;
  }
  if (!std::holds_alternative<FittedTemplate>(WayToFace(experiment_)) ||
      (!options.sigma && options.samples == 0)) {
    return std::nullopt;
  }
  FaceUncertainty result = MakeUncertainty(
      experiment_, *skull_->depth_stage,
      {made_->placed.face.surface, made_->fitted.target, made_->fitted.fit, face_}, context_);
  NoteUncertainty(experiment_, result, subject_);
  return result;
}

void FaceJob::MeasureFace() {
  truth_ = step_("measure", [&] {
    return scored_ ? std::optional(CompareWithTruth(experiment_, *skull_, *std::move(scored_),
                                                    face_.mesh, uncertainty_, SigmaMasks(*made_),
                                                    context_))
                   : std::nullopt;
  });
  NoteSmallTruth();
}

// A whole true skin is scored over about half of the recovered face (44 to 54 % on phantoms and
// three CTs).
void FaceJob::NoteSmallTruth() {
  constexpr double kLeastShare = 0.15;
  const double scored_cm2 =
      truth_ ? truth_->skin.area_cm2[static_cast<int>(SkinStatus::kScored)] : kNaN;
  const double share = scored_cm2 / (Area(face_.mesh) / 100);
  if (share < kLeastShare) {
    subject_.notes.push_back(fmt::format(
        "the true skin is scored over {:.0f} cm² only, {:.0f} % of the face: it may be a part of "
        "a head, or lie elsewhere, and says little about the face",
        scored_cm2, 100 * share));
  }
}

void FaceJob::Judge() {
  plausibility_ = step_("judge", [&] {
    return JudgeFace({.surface = surface(),
                      .face = face_,
                      .generic = Transformed(generic_->surface, made_->placed.face_from_template),
                      .skull = subject_.skull,
                      .origin = subject_.origin,
                      .shell = skull_->depth_stage->shell,
                      .dowels = subject_.dowels_on_bone,
                      .pose = subject_.basis.sites,
                      .target = made_->fitted.target,
                      .fit = made_->fitted.fit,
                      .is_person = IsPerson()},
                     experiment_.plausibility, context_);
  });
}

void FaceJob::PutFaceOnBust() {
  if (bust_model_ == nullptr) {
    return;
  }
  Append(BustFiles(experiment_.bust), subject_.inputs);
  bust_ = step_("bust", [&] {
    return PoseBust({*bust_model_, surface(), made_->placed.face.site_uv, seedable_}, context_);
  });
}

RunResult FaceJob::TakeResult() {
  std::vector<FeatureDistortion> features = MeasureFeatures(made_->placed.face, surface());
  return {.subject = std::move(subject_),
          .shell = skull_->depth_stage->shell,
          .origin = skull_->origin,
          .depth = skull_->depth_stage->depth,
          .implicit = skull_->implicit,
          .face_from_template = made_->placed.face_from_template,
          .placed = std::move(made_->placed.face),
          .prior = std::move(made_->prior),
          .rules = std::move(made_->rules),
          .seeding = std::move(made_->fitted.seeding),
          .target = std::move(made_->fitted.target),
          .fit = std::move(made_->fitted.fit),
          .before_edits = std::move(before_edits_),
          .face = std::move(face_),
          .uncertainty = std::move(uncertainty_),
          .truth = std::move(truth_),
          .features = std::move(features),
          .plausibility = std::move(plausibility_),
          .bust_model = std::move(bust_model_),
          .bust = std::move(bust_),
          .times = step_.Take()};
}

}  // namespace

std::vector<std::string> RunResult::Notes() const {
  std::vector<std::string> notes = subject.notes;
  notes.insert(notes.end(), implicit.notes.begin(), implicit.notes.end());
  return notes;
}

std::vector<std::string> RunResult::Faults() const {
  std::vector<std::string> faults = FaultsIn(fit);
  if (face.mesh.points.empty()) {
    faults.emplace_back("the face has no vertex");
  }
  const auto require = [&](const FaceMetrics& metrics, const char* what) {
    const DistanceSummary& s = metrics.truth_to_face;
    if (!std::isfinite(s.mean_abs_mm) || !std::isfinite(s.rms_mm)) {
      faults.push_back(
          fmt::format("the distance of the {} from the true skin is not a number", what));
    }
  };
  if (truth) {
    require(truth->face, "H-spline face");
    require(truth->implicit, "implicit face");
  }
  std::ranges::move(plausibility.Faults(), std::back_inserter(faults));
  return faults;
}

RunResult Run(const Experiment& experiment, const RunContext& context, StageCache* cache) {
  StageCache own_cache(4);
  FaceJob job(experiment, context, cache ? *cache : own_cache);
  job.LoadBustModel();
  job.PrepareSkull();
  job.FindSkinToScore();
  job.LoadTemplateAndPrior();
  job.MakeSubjectsFace();
  job.ReplayEdits();
  job.TessellateFace();
  job.EstimateUncertainty();
  job.MeasureFace();
  job.Judge();
  job.PutFaceOnBust();
  return job.TakeResult();
}

}  // namespace semblance::problems
