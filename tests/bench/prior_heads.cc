// SPDX-License-Identifier: GPL-3.0-or-later
// The face prior on real heads, on its mesh alone: how far the most likely face of a statistical
// model is from the outer skin. A line of figures per head. Two of the heads are beside the
// project, not in it. With arguments HEAD FACE...: the figures of meshes that a run has written.
#include <fmt/format.h>

#include <cmath>
#include <exception>
#include <string>
#include <vector>

#include "problems/metrics/face_metrics.h"
#include "problems/output/disk_cache.h"
#include "problems/pipeline/experiment_config.h"
#include "problems/pipeline/make_face.h"
#include "problems/pipeline/skull_stage.h"
#include "problems/pipeline/uncertainty.h"
#include "problems/prior/hspline_prior.h"
#include "problems/prior/prior_target.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance {
namespace {

const std::filesystem::path kSource = SEMBLANCE_SOURCE_DIR;

void Print(const char* what, const FaceMetrics& m) {
  const DistanceSummary& s = m.truth_to_face;
  fmt::print("  {:22} {:.2f} mm {:3.0f} %  p95 {:.2f} signed {:+.2f} |", what, s.mean_abs_mm,
             100 * s.within_2_5mm, s.p95_mm, s.mean_signed_mm);
  for (const auto& [name, part] : m.regions) {
    fmt::print(" {} {:.2f}", name, part.mean_abs_mm);
  }
  fmt::print("\n");
  std::fflush(stdout);
}

TriMesh Placed(const ShapeEstimate& estimate, const FacePrior& prior) {
  return {estimate.points, prior.model.mean.triangles};
}

// A head of configs/heads with its implicit face, and the skin that is scored.
struct Scored {
  Experiment experiment;
  std::shared_ptr<const SkullStage> skull;
  FaceRegion region;
};

// Shares of the scored skin within the interval that should hold 90 %.
SigmaCoverage CoverageOf(const FaceMetrics& metrics, const Scored& scored,
                         const ShapeEstimate& estimate, const TriMesh& face,
                         const RunContext& context) {
  const TriMesh& skin = *scored.skull->depth_stage->subject.skin;
  return MeasureCoverage({skin, metrics.signed_mm, scored.region.part}, face, estimate.sigma_mm, {},
                         context);
}

Scored ScoredHead(const std::string& head, const RunContext& context) {
  const auto experiment = ReadConfig<Experiment>(kSource / ("configs/" + head + ".yaml"), {});
  StageCache cache(8, std::make_shared<DiskCache>(
                          std::filesystem::temp_directory_path() / "semblance_prior_heads",
                          std::uintmax_t{4} << 30));
  StepClock step(context);
  auto skull = MakeSkullStage(experiment, cache, step, context);
  FaceRegion region = FindScoredSkin(skull->depth_stage->subject, experiment.region).region;
  return {experiment, std::move(skull), std::move(region)};
}

struct Variant {
  const char* name;
  ShapeFitOptions options;
};

void Measure(const std::string& head, const FacePrior& prior, const std::vector<Variant>& variants,
             const std::string& out, const RunContext& context) {
  const Scored scored = ScoredHead(head, context);
  const FaceRegion& region = scored.region;
  const SkullStage& skull = *scored.skull;
  const Case& subject = skull.depth_stage->subject;
  fmt::print("{}:\n", head);
  Print("implicit", CompareFaces(*subject.skin, region, skull.implicit.mesh, context));
  const TableDepthOptions table_depths;
  const bool from_table = scored.experiment.tissue.depths == DepthSource::kTable;
  Case cut = subject;
  const TriMesh implicit = SeedableFace(scored.experiment, cut, skull.implicit.dense);
  const ShapeTarget target =
      PriorTarget(prior, subject.dowels_on_bone, from_table ? &table_depths : nullptr, &implicit);
  Print("mean placed",
        CompareFaces(*subject.skin, region, Transformed(prior.model.mean, target.start), context));
  for (const Variant& variant : variants) {
    const ShapeEstimate estimate = EstimateShape(prior.model, target, variant.options, context);
    const TriMesh face = Placed(estimate, prior);
    const FaceMetrics metrics = CompareFaces(*subject.skin, region, face, context);
    Print(variant.name, metrics);
    const SigmaCoverage coverage = CoverageOf(metrics, scored, estimate, face, context);
    fmt::print(
        "    scale {:.3f} coefficients rms {:.2f} field {:.2f} mm drawn {} rounds {} last {:.3f} "
        "mm, 90 % interval holds {:.0f} %:",
        estimate.subject_from_model.scale,
        std::sqrt(estimate.coefficients.squaredNorm() / estimate.coefficients.size()),
        estimate.field_rms_mm, estimate.surface_points, estimate.rounds, estimate.last_move_mm,
        100 * coverage.at_90);
    for (const auto& [part, share] : coverage.of_part) {
      fmt::print(" {} {:.0f}", part, 100 * share);
    }
    fmt::print("\n");
    if (!out.empty()) {
      WriteFileAtomically(fmt::format("{}_{}_{}.ply", out,
                                      std::filesystem::path(head).stem().string(), variant.name),
                          EncodeMesh(face, ".ply"));
    }
  }
}

std::vector<Variant> Variants() {
  std::vector<Variant> variants;
  const auto add = [&](const char* name, auto change) {
    ShapeFitOptions options;
    change(options);
    variants.push_back({name, options});
  };
  add("isotropic", [](ShapeFitOptions& o) {
    o.field.centres = 0;
    o.surface_points = 0;
    o.tip_normal_sd_mm = o.tip_tangent_sd_mm = 2;
  });
  add("modes_tips", [](ShapeFitOptions& o) {
    o.field.centres = 0;
    o.surface_points = 0;
  });
  add("modes_tips_implicit", [](ShapeFitOptions& o) { o.field.centres = 0; });
  add("all", [](ShapeFitOptions&) {});
  return variants;
}

}  // namespace
}  // namespace semblance

int main(int argc, char** argv) {
  using namespace semblance;
  try {
    RunContext context;
    if (argc > 2) {  // HEAD FACE...: faces that are already there
      const Scored scored = ScoredHead(argv[1], context);
      for (int k = 2; k < argc; ++k) {
        Print(argv[k], CompareFaces(*scored.skull->depth_stage->subject.skin, scored.region,
                                    ReadMesh(argv[k]), context));
      }
      return 0;
    }
    const auto shipped = ReadConfig<Experiment>(kSource / "configs/demo.yaml", {});
    const FacePrior prior = LoadPrior(shipped.prior, LoadTemplate(shipped.face_template));
    for (const std::string head : {"heads/vhm", "heads/cthead", "cranium_measured", "cranium"}) {
      Measure(head, prior, Variants(), argc > 1 ? argv[1] : "", context);
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
  return 0;
}
