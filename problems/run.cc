// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <memory>

#include "fitting/plan/fit_result.h"
#include "problems/pipeline/hand_edits.h"
#include "problems/pipeline/make_face.h"
#include "problems/pipeline/stage_key.h"
#include "problems/prior/hspline_prior.h"
#include "surfaces/hspline_files/hspline_json.h"

namespace semblance {
namespace {

using Files = std::vector<std::filesystem::path>;

void Append(const Files& more, Files& files) {
  files.insert(files.end(), more.begin(), more.end());
}

bool TakesPublishedDeviations(const Experiment& experiment, const Case& subject) {
  return experiment.tissue.depths == DepthSource::kTable &&
         experiment.uncertainty.dowel_sd_mm == 0 &&
         std::ranges::any_of(subject.dowels_on_bone,
                             [](const Dowel& d) { return std::isnan(d.sd_mm); });
}

std::optional<FaceUncertainty> EstimateUncertainty(const Experiment& experiment,
                                                   const DepthStage& stage,
                                                   const FittedFace& fitted, Case& subject,
                                                   const RunContext& context) {
  if (!experiment.uncertainty.sigma && experiment.uncertainty.samples == 0) {
    return std::nullopt;
  }
  FaceUncertainty result = MakeUncertainty(experiment, stage, fitted, context);
  for (const std::string& term : result.left_out) {
    subject.notes.push_back(fmt::format(
        "the uncertainty of the face does not know of the fit's term '{}', which couples x, y and "
        "z: it is rather too large than too small",
        term));
  }
  if (TakesPublishedDeviations(experiment, subject)) {
    subject.notes.push_back(
        "the table states no standard deviation: the uncertainty of the face takes those of the "
        "T-Table 2023 (Hona & Stephan 2024), or uncertainty.dowel_sd_mm where it is given");
  }
  return result;
}

std::shared_ptr<const OuterSkin> OuterSkinOf(const Experiment& experiment, const TriMesh& skin,
                                             StageCache& cache) {
  const double probe_mm = experiment.region.probe_mm;
  return cache.Get<OuterSkin>(
      StageKey("outer skin", experiment.subject) + fmt::format("\n{}", probe_mm),
      [&] { return FindOuterSkin(skin, probe_mm); });
}

// What of the true skin the face will be measured against; none where it is not known. Found before
// the fit, so that a region without any skin does not cost one.
std::optional<ScoredSkin> SkinToScore(const Experiment& experiment, const Case& subject,
                                      StageCache& cache) {
  if (!subject.skin) {
    return std::nullopt;
  }
  const auto felt = OuterSkinOf(experiment, *subject.skin, cache);
  ScoredSkin scored = FindScoredSkin(subject, *felt, experiment.region);
  CheckScored(scored.region);
  return scored;
}

std::optional<TruthComparison> Measure(const Experiment& experiment, const SkullStage& skull,
                                       std::optional<ScoredSkin> scored, const TriMesh& face,
                                       const std::optional<FaceUncertainty>& uncertainty,
                                       std::span<const Sphere> masks, const RunContext& context) {
  if (!scored) {
    return std::nullopt;
  }
  const Case& subject = skull.depth_stage->subject;
  const TriMesh& skin = *subject.skin;
  TruthComparison truth;
  truth.skin = *std::move(scored);
  truth.face = CompareFaces(skin, truth.skin.region, face, context);
  truth.details = MeasureDetails(skin, truth.skin, subject.basis, face, context);
  truth.implicit = CompareFaces(skin, truth.skin.region, skull.implicit.mesh, context);
  truth.depth = CompareDepths(experiment, *skull.depth_stage, skull.depth_stage->depth, context);
  if (uncertainty && experiment.uncertainty.sigma) {
    truth.sigma = MeasureCoverage({skin, truth.face.signed_mm, truth.skin.region.part}, face,
                                  uncertainty->sigma_mm, masks, context);
  }
  return truth;
}

std::shared_ptr<const TemplateFace> GenericFace(const TemplateSource& source, StageCache& cache) {
  return cache.Get<TemplateFace>(StageKey("template", source),
                                 [&source] { return LoadTemplate(source); });
}

// The generic face and the prior; their files are noted with the subject.
struct FacesAtHand {
  std::shared_ptr<const TemplateFace> generic;
  std::shared_ptr<const LoadedPrior> prior;  // null where no face asks for it
};

FacesAtHand GivenFaces(const Experiment& experiment, StageCache& cache, StepClock& step,
                       Case& subject, const RunContext& context) {
  FacesAtHand faces;
  faces.generic =
      step("make template", [&] { return GenericFace(experiment.face_template, cache); });
  faces.prior =
      step("load prior", [&] { return GivenPrior(experiment, *faces.generic, cache, context); });
  Append(TemplateFiles(experiment.face_template), subject.inputs);
  Append(faces.prior ? PriorFiles(experiment.prior) : Files(), subject.inputs);
  return faces;
}

// As the face was made: none of one that was only placed or bent.
std::optional<FaceUncertainty> UncertaintyOf(const Experiment& experiment, const DepthStage& bone,
                                             const LoadedPrior* prior, const MadeFace& made,
                                             const Tessellation& face, Case& subject,
                                             const RunContext& context) {
  if (made.prior) {
    return experiment.uncertainty.sigma || !made.samples.empty()
               ? std::optional(PriorUncertainty(experiment.uncertainty, *prior, made, face))
               : std::nullopt;
  }
  if (!std::holds_alternative<FittedTemplate>(WayToFace(experiment))) {
    return std::nullopt;
  }
  return EstimateUncertainty(experiment, bone,
                             {made.placed.face.surface, made.fitted.target, made.fitted.fit, face},
                             subject, context);
}

// Before anything long is done: a bust that cannot be used ends the run.
std::shared_ptr<const BustModel> GivenBust(const Experiment& experiment, StageCache& cache,
                                           const RunContext& context) {
  if (std::holds_alternative<NoBust>(experiment.bust)) {
    return nullptr;
  }
  const auto model = cache.Get<std::optional<BustModel>>(
      StageKey("bust", experiment.bust, experiment.face_template),
      [&] { return LoadBust(experiment.bust, experiment.face_template, context); });
  return *model ? std::shared_ptr<const BustModel>(model, &**model) : nullptr;
}

// The head that is put on, where one is asked for; its files are noted with the subject.
std::optional<Bust> BustOf(const BustModel* model, const BustSource& source, const MadeFace& made,
                           const TriMesh& seedable, StepClock& step, Case& subject,
                           const RunContext& context) {
  if (model == nullptr) {
    return std::nullopt;
  }
  Append(BustFiles(source), subject.inputs);
  return step("bust", [&] {
    return PoseBust({*model, made.fitted.fit.surface, made.placed.face.site_uv, seedable}, context);
  });
}

void NoteFace(const Experiment& experiment, const LoadedPrior* prior, Case& subject) {
  std::ranges::move(UnusedOptions(experiment), std::back_inserter(subject.notes));
  const FaceSource way = WayToFace(experiment);
  const PriorUse* const use = PriorUseOf(way);
  if (use != nullptr && use->draw > 0) {
    subject.notes.push_back(
        fmt::format("the face is not the most likely one, but number {} of those drawn from what "
                    "bone and depths leave possible",
                    use->draw));
  }
  std::ranges::move(NotesOnRules(experiment.rules, subject.points, subject.basis.sites.has_value(),
                                 prior != nullptr ? &prior->face : nullptr),
                    std::back_inserter(subject.notes));
}

// Where a template's features hide how far a face is off; none of a prior's, which knows of nose,
// mouth and eyes, and so does its sigma.
std::vector<Sphere> SigmaMasks(const MadeFace& made) {
  return made.prior ? std::vector<Sphere>() : TemplateMasks(made.placed.face);
}

// What was made; what is measured of it comes later.
RunResult ResultOf(const SkullStage& skull, Case subject, MadeFace made) {
  return {.subject = std::move(subject),
          .shell = skull.depth_stage->shell,
          .origin = skull.origin,
          .depth = skull.depth_stage->depth,
          .implicit = skull.implicit,
          .face_from_template = made.placed.face_from_template,
          .placed = std::move(made.placed.face),
          .prior = std::move(made.prior),
          .rules = std::move(made.rules),
          .seeding = std::move(made.fitted.seeding),
          .target = std::move(made.fitted.target),
          .fit = std::move(made.fitted.fit),
          .before_edits = {},
          .face = {},
          .uncertainty = {},
          .truth = {},
          .features = {},
          .bust_model = {},
          .bust = {},
          .times = {}};
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
  return faults;
}

RunResult Run(const Experiment& experiment, const RunContext& context, StageCache* cache) {
  StepClock step(context);
  StageCache own_cache(4);
  StageCache& shared = cache ? *cache : own_cache;
  const auto bust_model = step("load bust", [&] { return GivenBust(experiment, shared, context); });
  const auto skull = MakeSkullStage(experiment, shared, step, context);
  const DepthStage& bone = *skull->depth_stage;
  Case subject = bone.subject;
  CheckFaceOptions(experiment, subject);
  auto scored =
      step("find the skin to score", [&] { return SkinToScore(experiment, subject, shared); });
  const FacesAtHand faces = GivenFaces(experiment, shared, step, subject, context);
  const LoadedPrior* const prior = faces.prior.get();
  const TriMesh seedable = SeedableFace(experiment, skull->cuts, skull->implicit.dense, subject);
  MadeFace made = step("fit", [&] {
    return MakeFace({experiment, *faces.generic, prior, subject, seedable, bone.shell}, context);
  });
  NoteFace(experiment, prior, subject);
  auto before_edits = EditByHand(experiment, made, subject);
  CheckFinite(made.fitted.fit.surface);
  Tessellation face =
      step("tessellate", [&] { return Tessellate(made.fitted.fit.surface, kFaceQuadsPerPatch); });
  auto uncertainty = step("uncertainty", [&] {
    return UncertaintyOf(experiment, bone, prior, made, face, subject, context);
  });
  auto truth = step("measure", [&] {
    return Measure(experiment, *skull, std::move(scored), face.mesh, uncertainty, SigmaMasks(made),
                   context);
  });
  auto bust = BustOf(bust_model.get(), experiment.bust, made, seedable, step, subject, context);
  auto features = MeasureFeatures(made.placed.face, made.fitted.fit.surface);
  RunResult result = ResultOf(*skull, std::move(subject), std::move(made));
  result.before_edits = std::move(before_edits);
  result.face = std::move(face);
  result.uncertainty = std::move(uncertainty);
  result.truth = std::move(truth);
  result.features = std::move(features);
  result.bust_model = bust_model;
  result.bust = std::move(bust);
  result.times = step.Take();
  return result;
}

}  // namespace semblance
