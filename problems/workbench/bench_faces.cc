// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/workbench/bench_faces.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/edits/edit_script.h"
#include "problems/pipeline/case.h"
#include "problems/pipeline/experiment_config.h"
#include "problems/pipeline/make_face.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

// The prior's own options, with a smooth rest of fewer centres and fewer rounds: the tips alone
// need no more, and it is much quicker.
PriorFace PriorFaceOf(const FaceSource& way) {
  constexpr int kCentres = 30, kRounds = 5;
  PriorFace coarse;
  if (const auto* fitted = std::get_if<PriorThenFit>(&way)) {
    coarse.use = fitted->use;
  } else if (const auto* prior = std::get_if<PriorFace>(&way)) {
    coarse = *prior;
  }
  ShapeFitOptions& estimate = coarse.use.estimate;
  estimate.field.centres = std::min(estimate.field.centres, kCentres);
  estimate.rounds = std::min(estimate.rounds, kRounds);
  return coarse;
}

FaceSource CoarseWay(const Experiment& experiment) {
  const FaceSource way = WayToFace(experiment);
  if (std::holds_alternative<PlacedFace>(way) || std::holds_alternative<ThinPlateFace>(way)) {
    return way;
  }
  // Nearly to the tips, as a fit goes: a stiff plate would hide what one depth does.
  constexpr double kStiffness_mm = 0.3;
  return AsksPrior(way) ? FaceSource(PriorFaceOf(way))
                        : FaceSource(ThinPlateFace{.stiffness_mm = kStiffness_mm});
}

SubjectData ThinnedOut(const BenchSubject& subject, const BenchState& state) {
  return {.skull = subject.skull.view,
          .origin = {},
          .skin = std::nullopt,
          .landmarks = LandmarksOf(state),
          .notes = {},
          .inputs = {}};
}

}  // namespace

Case CoarseCase(const BenchSubject& subject, const Experiment& experiment,
                const BenchState& state) {
  return MakeCase(ThinnedOut(subject, state), experiment, *subject.view_bone);
}

BenchFace CoarseFace(const BenchSubject& subject, const Experiment& given, const BenchState& state,
                     StageCache& cache, const RunContext& context) {
  Experiment experiment = given;
  experiment.face = CoarseWay(given);
  Case head = CoarseCase(subject, experiment, state);
  const auto generic = cache.Get<TemplateFace>(StageKey("template", experiment.face_template), [&] {
    return LoadTemplate(experiment.face_template);
  });
  const auto prior = GivenPrior(experiment, *generic, cache, context);
  const TriMesh none;
  MadeFace made = MakeFace({.experiment = experiment,
                            .generic = *generic,
                            .prior = prior.get(),
                            .subject = head,
                            .implicit = none,
                            .shell = subject.skull.view,
                            .tells_sigma = false},
                           context);
  ApplyEdits(state.edits, made.fitted.fit.surface);
  return {.surface = std::move(made.fitted.fit.surface),
          .dowels = std::move(head.dowels_on_bone),
          .notes = std::move(head.notes)};
}

std::string_view NameOf(BenchVariant variant) {
  return EnumNames(variant).at(static_cast<std::size_t>(variant));
}

BenchVariant VariantCalled(std::string_view name) {
  const auto* const found = std::ranges::find(kBenchVariants, name, &NameOf);
  if (found == kBenchVariants.end()) {
    throw InputError(fmt::format("variant: there is no '{}'", name));
  }
  return *found;
}

Experiment VariantOf(const Experiment& experiment, BenchVariant variant,
                     const std::vector<Dowel>& dowels, double fallback_sd_mm) {
  constexpr double kLeast_mm = 0.5;
  Experiment other = experiment;
  const auto shift = [&](double sds) {
    for (const Dowel& dowel : dowels) {
      const double sd = std::isfinite(dowel.sd_mm) ? dowel.sd_mm : fallback_sd_mm;
      other.tissue.set_mm[dowel.site] = std::max(kLeast_mm, dowel.depth_mm + sds * sd);
    }
  };
  switch (variant) {
    case BenchVariant::kAsIs:
      break;
    case BenchVariant::kEmaciated:
      other.tissue.build = Build::kEmaciated;
      break;
    case BenchVariant::kNormal:
      other.tissue.build = Build::kNormal;
      break;
    case BenchVariant::kObese:
      other.tissue.build = Build::kObese;
      break;
    case BenchVariant::kThinner:
      shift(-1);
      break;
    case BenchVariant::kThicker:
      shift(1);
      break;
  }
  return other;
}

}  // namespace semblance
