// SPDX-License-Identifier: GPL-3.0-or-later
// The face prior on real heads, on its mesh alone: how far the most likely face of a statistical
// model, given measured depths, is from the outer skin. A line of figures per head. The heads and
// the model are beside the project, not in it. With arguments HEAD FACE...: the figures of meshes
// that a run has written.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <exception>
#include <numbers>
#include <string>
#include <vector>

#include "problems/metrics/face_metrics.h"
#include "problems/output/disk_cache.h"
#include "problems/pipeline/experiment_config.h"
#include "problems/pipeline/skull_stage.h"
#include "problems/prior/prior_target.h"
#include "surfaces/base/parallel.h"
#include "surfaces/mesh/mesh_query.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance {
namespace {

const std::filesystem::path kSource = SEMBLANCE_SOURCE_DIR;
const std::filesystem::path kData = kSource / "../shared/data";

// Whether a ray from the vertex, within 45 degrees of its normal, leaves the head.
bool SeesOutside(const MeshQuery& skin, const Vec3& p, const Vec3& normal) {
  const Vec3 side = normal.unitOrthogonal(), other = normal.cross(side);
  for (int k = 0; k < 17; ++k) {
    const double angle = 2 * std::numbers::pi * k / 8, tilt = k == 0 ? 0 : k <= 8 ? 0.4 : 0.8;
    const Vec3 ray = normal + tilt * (std::cos(angle) * side + std::sin(angle) * other);
    if (!skin.FirstHit(p + 0.2 * normal, ray, 400)) {
      return true;
    }
  }
  return false;
}

FaceRegion OuterRegion(const Case& subject, const Experiment& experiment,
                       const RunContext& context) {
  FaceRegion region =
      FindFaceRegion(*subject.skin, subject.dowels_on_bone, subject.network, experiment.region);
  const MeshQuery query(*subject.skin);
  const std::vector<Vec3> normals = VertexNormals(*subject.skin);
  std::vector<char> outer(region.scored.size(), 0);
  ParallelFor(outer.size(), context.threads, 256, [&](std::size_t v) {
    outer[v] = region.scored[v] && SeesOutside(query, subject.skin->points[v], normals[v]) ? 1 : 0;
  });
  for (std::size_t v = 0; v < outer.size(); ++v) {
    region.scored[v] = region.scored[v] && outer[v] != 0;
    region.part[v] = region.scored[v] ? region.part[v] : -1;
  }
  return region;
}

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

// Share of the scored skin within 1.645 sigma of the nearest vertex.
double Coverage(const FaceMetrics& metrics, const Case& subject, const ShapeEstimate& estimate,
                const TriMesh& face) {
  const MeshQuery query(face);
  const std::vector<double> areas = VertexAreas(*subject.skin);
  double all = 0, held = 0;
  for (std::size_t v = 0; v < areas.size(); ++v) {
    if (std::isfinite(metrics.signed_mm[v])) {
      const MeshPoint at = query.Closest(subject.skin->points[v]);
      double sigma = 0;
      for (int k = 0; k < 3; ++k) {
        sigma += at.weights[k] * estimate.sigma_mm[face.triangles[at.triangle][k]];
      }
      all += areas[v];
      held += std::abs(metrics.signed_mm[v]) <= 1.645 * sigma ? areas[v] : 0;
    }
  }
  return held / all;
}

// A head of configs/heads with its implicit face, and the skin that is scored.
struct Scored {
  std::shared_ptr<const SkullStage> skull;
  FaceRegion region;
};

Scored ScoredHead(const std::string& head, const RunContext& context) {
  const auto experiment = ReadConfig<Experiment>(kSource / ("configs/heads/" + head + ".yaml"), {});
  StageCache cache(8, std::make_shared<DiskCache>(
                          std::filesystem::temp_directory_path() / "semblance_prior_heads",
                          std::uintmax_t{4} << 30));
  StepClock step(context);
  auto skull = MakeSkullStage(experiment, cache, step, context);
  FaceRegion region = OuterRegion(skull->depth_stage->subject, experiment, context);
  return {std::move(skull), std::move(region)};
}

struct Variant {
  const char* name;
  ShapeFitOptions options;
};

void Measure(const std::string& head, const FacePrior& prior, const std::vector<Variant>& variants,
             const std::string& out, const RunContext& context) {
  const auto [skull, region] = ScoredHead(head, context);
  const Case& subject = skull->depth_stage->subject;
  fmt::print("{}:\n", head);
  Print("implicit", CompareFaces(*subject.skin, region, skull->implicit.mesh, context));
  const ShapeTarget target =
      PriorTarget(prior, subject.dowels_on_bone, nullptr, &skull->implicit.mesh);
  Print("mean placed",
        CompareFaces(*subject.skin, region, Transformed(prior.model.mean, target.start), context));
  for (const Variant& variant : variants) {
    const ShapeEstimate estimate = EstimateShape(prior.model, target, variant.options, context);
    const TriMesh face = Placed(estimate, prior);
    const FaceMetrics metrics = CompareFaces(*subject.skin, region, face, context);
    Print(variant.name, metrics);
    fmt::print(
        "    scale {:.3f} coefficients rms {:.2f} field {:.2f} mm drawn {} rounds {} last {:.3f} "
        "mm, 90 % interval holds {:.0f} %\n",
        estimate.subject_from_model.scale,
        std::sqrt(estimate.coefficients.squaredNorm() / estimate.coefficients.size()),
        estimate.field_rms_mm, estimate.surface_points, estimate.rounds, estimate.last_move_mm,
        100 * Coverage(metrics, subject, estimate, face));
    if (!out.empty()) {
      WriteFileAtomically(fmt::format("{}_{}_{}.ply", out, head, variant.name),
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
    const FacePrior prior =
        LoadPrior(ModesPrior{.mean = kData / "template/ict_head_lps_mm.ply",
                             .modes = kData / "ict_face/identity_modes_um_int16.npy",
                             .sites = kData / "ict_face/sites_on_mean.csv",
                             .features = kData / "template/landmarks68_lps_mm.csv",
                             .scale = 0.001});
    for (const std::string head : {"vhm", "cthead"}) {
      Measure(head, prior, Variants(), argc > 1 ? argv[1] : "", context);
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
  return 0;
}
