// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/workbench/bench_faces.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "problems/experiment/case.h"
#include "problems/experiment/experiment_config.h"
#include "problems/experiment/make_face.h"
#include "problems/face/edit_script.h"
#include "problems/io/output_folder.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline_files/hspline_json.h"
#include "surfaces/hspline_query/tessellate.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

// The prior's options, but with at most 30 centres for the smooth rest and at most 5 rounds. Fewer
// make the coarse face much quicker, and the tips alone need no more.
PriorFace CoarsePriorFace(const FaceSource& method) {
  constexpr int kCentres = 30, kRounds = 5;
  PriorFace coarse;
  if (const PriorUse* const use = FindPriorUse(method)) {
    coarse.use = *use;
  }
  ShapeFitOptions& estimate = coarse.use.estimate;
  estimate.field.centres = std::min(estimate.field.centres, kCentres);
  estimate.rounds = std::min(estimate.rounds, kRounds);
  return coarse;
}

// The method of the coarse face: quick methods stay, a fit becomes a thin plate.
FaceSource CoarseMethod(const Experiment& experiment) {
  const FaceSource method = WayToFace(experiment);
  if (std::holds_alternative<PlacedFace>(method) || std::holds_alternative<ThinPlateFace>(method)) {
    return method;
  }
  // The plate passes nearly through the tips, as a fit does. A stiffer plate would hide the effect
  // of a single depth.
  constexpr double kStiffness_mm = 0.3;
  return UsesPrior(method) ? FaceSource(CoarsePriorFace(method))
                           : FaceSource(ThinPlateFace{.stiffness_mm = kStiffness_mm});
}

SubjectData DecimatedSubject(const BenchSubject& subject, const BenchState& state) {
  return {.skull = subject.skull.view,
          .origin = {},
          .skin = std::nullopt,
          .landmarks = ToLandmarkFile(state),
          .notes = {},
          .inputs = {}};
}

struct VariantFiles {
  fs::path face, faults, key;
};

VariantFiles FindVariantFiles(const fs::path& folder, BenchVariant variant) {
  const std::string name(VariantName(variant));
  return {folder / "variants" / (name + ".hspline.json"),
          folder / "variants" / (name + ".faults.json"), folder / "variants" / (name + ".key.txt")};
}

}  // namespace

Case CoarseCase(const BenchSubject& subject, const Experiment& given, const BenchState& state) {
  Experiment experiment = given;
  experiment.landmarks.carried = CarriedSites::kNone;  // to lay people's bone takes longer
  return MakeCase(DecimatedSubject(subject, state), experiment, *subject.view_bone, {});
}

BenchFace CoarseFace(const BenchSubject& subject, const Experiment& given, const BenchState& state,
                     StageCache& cache, const RunContext& context) {
  Experiment experiment = given;
  experiment.face = CoarseMethod(given);
  Case head = CoarseCase(subject, experiment, state);
  const auto generic = cache.Get<TemplateFace>(StageKey("template", experiment.face_template), [&] {
    return LoadTemplate(experiment.face_template);
  });
  const auto prior = LoadExperimentPrior(experiment, *generic, cache, context);
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

std::string_view VariantName(BenchVariant variant) { return EnumWord(variant); }

BenchVariant FindVariant(std::string_view name) {
  const auto* const found = std::ranges::find(kBenchVariants, name, &VariantName);
  if (found == kBenchVariants.end()) {
    throw InputError(fmt::format("variant: '{}' is unknown; give {}", name,
                                 fmt::join(EnumNames(BenchVariant{}), ", ")));
  }
  return *found;
}

Experiment VariantExperiment(const Experiment& experiment, BenchVariant variant,
                             const std::vector<Dowel>& dowels, double fallback_sd_mm) {
  constexpr double kMinDepth_mm = 0.5;  // the lower bound of the page's sliders too
  Experiment other = experiment;
  const auto shift = [&](double sds) {
    for (const Dowel& dowel : dowels) {
      const double sd = std::isfinite(dowel.sd_mm) ? dowel.sd_mm : fallback_sd_mm;
      other.tissue.set_mm[dowel.site] = std::max(kMinDepth_mm, dowel.depth_mm + sds * sd);
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

void StoreVariant(const fs::path& folder, BenchVariant variant, const VariantFace& made) {
  const VariantFiles files = FindVariantFiles(folder, variant);
  MakeFolderBelow(folder, "variants");
  fs::remove(files.key);  // without a key, an incomplete face is never read
  WriteHSpline(files.face, made.face.surface);
  WriteFileAtomically(files.faults, made.face.faults);
  WriteFileAtomically(files.key, made.key);
}

VariantFaces StoredVariants(const fs::path& folder, const std::string& key,
                            const std::function<std::vector<Dowel>(BenchVariant)>& dowels) {
  VariantFaces found;
  for (const BenchVariant variant : kBenchVariants) {
    const VariantFiles files = FindVariantFiles(folder, variant);
    if (fs::exists(files.key) && fs::exists(files.face) && fs::exists(files.faults) &&
        ReadFileBytes(files.key) == key) {
      found.emplace(variant, VariantFace{{.surface = ReadHSpline(files.face),
                                          .dowels = dowels(variant),
                                          .notes = {},
                                          .faults = ReadFileBytes(files.faults)},
                                         key});
    }
  }
  return found;
}

Vec2 NearestParameter(const HSplineSurface& face, const Vec3& at) {
  constexpr int kPerPatch = 2;
  const Tessellation shown = Tessellate(face, kPerPatch);
  const MeshPoint nearest = MeshQuery(shown.mesh).Closest(at);
  Vec2 uv = Vec2::Zero();
  // Next to the seam of a closed surface the corners' u may differ by a period.
  for (int k = 0; k < 3; ++k) {
    uv += nearest.weights[k] * shown.uv[shown.mesh.triangles[nearest.triangle][k]];
  }
  return uv;
}

std::array<std::vector<Vec3>, 3> PullMoves(const HSplineSurface& face, Pull pull, int per_patch) {
  const std::vector<Vec3> before = Tessellate(face, per_patch).mesh.points;
  std::array<std::vector<Vec3>, 3> moves;
  for (int axis = 0; axis < 3; ++axis) {
    pull.by_mm = Vec3::Unit(axis);
    HSplineSurface pulled = face;
    ApplyEdits(Pulled(pull, face, {}), pulled);
    moves[axis] = Tessellate(pulled, per_patch).mesh.points;
    for (std::size_t v = 0; v < before.size(); ++v) {
      moves[axis][v] -= before[v];
    }
  }
  return moves;
}

}  // namespace semblance::problems
