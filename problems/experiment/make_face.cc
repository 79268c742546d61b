// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/make_face.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

#include "interp/schemes/people.h"
#include "problems/experiment/dowel_projection.h"
#include "problems/experiment/experiment_config.h"
#include "problems/experiment/face_parts.h"
#include "problems/experiment/joint_face.h"
#include "problems/experiment/likely_face.h"
#include "problems/experiment/spring_face.h"
#include "problems/face/edit_script.h"
#include "problems/face/hspline_prior.h"
#include "problems/face/prior_observations.h"
#include "problems/subject/landmark_files/read_landmarks.h"
#include "surfaces/base/error.h"
#include "surfaces/base/quantile.h"
#include "surfaces/base/thin_plate.h"
#include "surfaces/hspline_query/hspline_project.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

PlacedTemplate Place(const TemplateFace& generic, const std::vector<Dowel>& dowels_on_bone,
                     const DowelNetwork& network, const Experiment& experiment) {
  const Similarity face_from_template = PlaceOnDowels(
      generic, KnownDowels(dowels_on_bone, generic, experiment.sites), experiment.placement);
  TemplateFace placed = InSubjectFrame(generic, face_from_template);
  FitTarget dowels = AllDowels(dowels_on_bone, network, placed, experiment);
  return {std::move(dowels), face_from_template, std::move(placed)};
}

// ---------------------------------------------------------------------------------------------
// Fitting
// ---------------------------------------------------------------------------------------------

// The options of seeding and fitting, as the way to the face changes them.
struct FitPlan {
  std::vector<ScheduleStep> first_fit;
  SeedSource seeds;
  FitOptions fit;
  int rounds;
};

FitPlan PlanFit(const Experiment& experiment) {
  FitPlan plan{experiment.first_fit, experiment.seeds, experiment.fit, experiment.rounds};
  std::visit(
      [&experiment]<class R>(R& relaxation) {
        if constexpr (std::is_base_of_v<PointMoves, R>) {
          for (const auto& [name, site] : experiment.sites) {
            if (site.hold) {  // the (u,v) is set by hand: relaxation must not move it
              relaxation.kept.push_back(name);
            }
          }
        }
      },
      plan.fit.relaxation);
  return plan;
}

bool NeedsBoneAnchors(const std::vector<Term>& terms) {
  return std::any_of(terms.begin(), terms.end(), [](const Term& term) {
    return std::holds_alternative<NonPenetrationTerm>(term) ||
           std::holds_alternative<SpringTerm>(term);
  });
}

// The anchors of seeds: the nearest points of the skull's shell, and the directions from there.
std::vector<BoneAnchor> FindAnchors(const std::vector<FitPoint>& seeds, const TriMesh& shell) {
  const MeshQuery query(shell);
  std::vector<BoneAnchor> anchors;
  for (const FitPoint& seed : seeds) {
    const MeshPoint nearest = query.Closest(seed.position);
    const Vec3 out = nearest.distance_mm > 1e-6  // else the seed lies on the shell
                         ? Vec3(seed.position - nearest.position)
                         : TriangleAreaVector(shell, shell.triangles[nearest.triangle]);
    anchors.push_back({nearest.position, out.normalized()});
  }
  return anchors;
}

// The template, fitted to the dowels alone. The first seeds are taken on it.
HSplineSurface FirstFit(const FitPlan& plan, const TemplateFace& placed, const FitTarget& dowels,
                        const RunContext& context) {
  if (plan.first_fit.empty()) {
    return placed.surface;
  }
  FitOptions first = plan.fit;
  first.plan = ListedPlan{.schedule = plan.first_fit, .aim = PlanAim(plan.fit.plan)};
  first.relaxation = NoRelaxation{};
  return Fit(placed.surface, placed.surface, dowels, FeatureVertices(placed), first, context)
      .surface;
}

FitTarget WithSeeds(FitTarget target, const std::vector<FitPoint>& seeds,
                    const std::vector<Term>& terms, const TriMesh& shell) {
  target.points.insert(target.points.end(), seeds.begin(), seeds.end());
  target.anchors.resize(target.points.size());
  if (NeedsBoneAnchors(terms)) {
    const std::vector<BoneAnchor> anchors = FindAnchors(seeds, shell);
    std::copy(anchors.begin(), anchors.end(), target.anchors.end() - std::ssize(anchors));
  }
  return target;
}

// The additional input of a fit that starts from a prior's face.
struct PriorKnowledge {
  std::vector<ShapePoint> shape = {};
  std::vector<Sphere> features = {};
  const SeedTrustOptions* trust = nullptr;  // null: all seeds weigh the same
};

void Weigh(const FitTarget& dowels, const PriorKnowledge& known, std::vector<FitPoint>& seeds) {
  if (known.trust == nullptr) {
    return;
  }
  std::vector<Vec3> tips;
  for (const FitPoint& point : dowels.points) {
    tips.push_back(point.position);
  }
  WeighSeeds(tips, known.features, *known.trust, seeds);
}

// Drops the seeds at which the face lies nearer to bone than to the implicit face, along the seed's
// line. Before the last round they hold creases, because wrong (u,v) fold the face into the bone
// (RelaxationWorthThorough); in the last round they lift the face off the bone.
void DropBeyondBone(const HSplineSurface& surface, int direction_level, const MeshQuery& bone,
                    SeedResult& seeding) {
  const auto dropped = std::erase_if(seeding.points, [&](const FitPoint& seed) {
    const Vec3 at = surface.Point(seed.uv);
    const Vec3 outward = surface.LevelFrame(direction_level, seed.uv).Normal();
    const double way_mm = (seed.position - at).norm();
    return bone.FirstHit(at, outward, way_mm) || bone.FirstHit(at, -outward, way_mm);
  });
  seeding.missed += static_cast<int>(dropped);
}

SeedResult SeedRound(const FitPlan& plan, int round, const HSplineSurface& surface,
                     const MeshQuery& implicit, const FaceInput& in,
                     std::span<const Sphere> masks) {
  SeedResult seeding = MakeSeeds(surface, implicit, in, masks, plan.seeds);
  const auto* const patches = std::get_if<SeedOptions>(&plan.seeds);
  if (patches != nullptr && round + 1 < plan.rounds) {
    DropBeyondBone(surface, patches->direction_level, MeshQuery(in.shell), seeding);
  }
  return seeding;
}

// Fits the dowels first. Then each round takes seeds from the surface as it lies now and runs the
// schedule with dowels and seeds (see seeding.h for the reason).
FaceFit FitFace(const FitPlan& plan, const PlacedTemplate& placed, const FaceInput& in,
                const PriorKnowledge& known, const RunContext& context) {
  const HSplineSurface& rest = placed.face.surface;
  const std::vector<VertexId> features = FeatureVertices(placed.face);
  const std::vector<Sphere> masks = TemplateMasks(placed.face);
  FitTarget dowels = placed.dowels;
  const MeshQuery query(in.implicit);
  HSplineSurface surface = FirstFit(plan, placed.face, dowels, context);
  std::optional<FaceFit> result;
  for (int round = 0; round < plan.rounds; ++round) {
    context.Report("fit", fmt::format("round {} of {}", round + 1, plan.rounds));
    SeedResult seeding = SeedRound(plan, round, surface, query, in, masks);
    Weigh(dowels, known, seeding.points);
    FitTarget target = WithSeeds(dowels, seeding.points, plan.fit.terms, in.shell);
    target.shape = known.shape;
    FitResult fit = Fit(surface, rest, target, features, plan.fit, context);
    surface = fit.surface;
    for (std::size_t k = 0; k < dowels.points.size(); ++k) {
      dowels.points[k].uv = fit.uv[k];  // relaxation may have moved it
    }
    result.emplace(FaceFit{std::move(seeding), std::move(target), std::move(fit)});
  }
  return std::move(*result);
}

// ---------------------------------------------------------------------------------------------
// Bending
// ---------------------------------------------------------------------------------------------

void CheckEnough(const PointPairs& pairs, const std::string& reference) {
  constexpr std::size_t kFewestLandmarks = 4;  // a thin plate needs as many
  if (pairs.from.size() < kFewestLandmarks) {
    throw InputError(
        fmt::format("{}: it shares {} landmarks with the subject, and from skull to skull at least "
                    "{} are needed",
                    reference, pairs.from.size(), kFewestLandmarks));
  }
}

// The landmarks that the subject shares with the mean person, whose skull lies people's mean depth
// below the template.
PointPairs FromMeanPerson(const PlacedTemplate& placed,
                          const std::map<std::string, Vec3>& subject) {
  PointPairs pairs;
  for (const auto& [site, point] : interp::CarriedPeople().sites) {
    const auto uv = placed.face.site_uv.find(site);
    const auto same = subject.find(site);
    if (uv != placed.face.site_uv.end() && same != subject.end()) {
      const double depth_mm = placed.face_from_template.scale * std::exp(point.depth.mean);
      const SurfaceFrame skin = placed.face.surface.Frame(uv->second);
      pairs.from.push_back(skin.point - depth_mm * skin.Normal());
      pairs.to.push_back(same->second);
    }
  }
  CheckEnough(pairs, "the mean person");
  return pairs;
}

// The landmarks that both skulls have.
PointPairs FromSkullToSkull(const std::filesystem::path& reference,
                            const Similarity& face_from_template,
                            const std::map<std::string, Vec3>& subject) {
  PointPairs pairs;
  for (const Landmark& landmark : InLpsMm(ReadLandmarks(reference).file).landmarks) {
    if (const auto same = subject.find(landmark.site); same != subject.end()) {
      const auto& [x, y, z] = landmark.point;
      pairs.from.push_back(face_from_template * Vec3(x, y, z));
      pairs.to.push_back(same->second);
    }
  }
  CheckEnough(pairs, reference.string());
  return pairs;
}

// ---------------------------------------------------------------------------------------------
// The ways to a face
// ---------------------------------------------------------------------------------------------

MadeFace MakeFace(const AutoFace&, PlacedTemplate, const FaceInput&, const RunContext&) {
  throw std::logic_error("WayToFace never returns auto");
}

MadeFace MakeFace(const PlacedFace&, PlacedTemplate placed, const FaceInput&, const RunContext&) {
  FaceFit unfitted = Unfitted(placed.face.surface, placed.dowels);
  return {std::move(placed), std::move(unfitted), {}};
}

MadeFace MakeFace(const ThinPlateFace& o, PlacedTemplate placed, const FaceInput&,
                  const RunContext&) {
  const PointPairs pairs = FromSitesToTips(placed.face.surface, placed.dowels);
  FaceFit unfitted =
      Unfitted(UnderThinPlate(placed.face.surface, pairs, o.stiffness_mm), placed.dowels);
  return {std::move(placed), std::move(unfitted), {}};
}

MadeFace MakeFace(const ReferenceFace& o, PlacedTemplate placed, const FaceInput& in,
                  const RunContext&) {
  const std::map<std::string, Vec3>& subject = in.subject.points;
  const PointPairs pairs = o.landmarks.empty()
                               ? FromMeanPerson(placed, subject)
                               : FromSkullToSkull(o.landmarks, placed.face_from_template, subject);
  FaceFit unfitted =
      Unfitted(UnderThinPlate(placed.face.surface, pairs, o.stiffness_mm), placed.dowels);
  return {std::move(placed), std::move(unfitted), {}};
}

MadeFace MakeFace(const FittedTemplate&, PlacedTemplate placed, const FaceInput& in,
                  const RunContext& context) {
  FaceFit fitted = FitFace(PlanFit(in.experiment), placed, in, {}, context);
  return {std::move(placed), std::move(fitted), {}};
}

// Sets the (u,v) in which the estimate met the dowels. At the prior's sites they are the prior's,
// whatever `sites` states. Elsewhere they are those of the point of the face nearest to the tip.
void MeetDowels(const LoadedPrior& prior, MadeFace& made) {
  const std::map<std::string, Vec2>& own = made.placed.face.site_uv;
  for (std::size_t k = 0; k < made.fitted.target.points.size(); ++k) {
    FitPoint& point = made.fitted.target.points[k];
    if (!prior.face.sites.contains(point.label)) {
      point.uv = ProjectFrom(made.fitted.fit.surface, point.position, point.uv).uv;
    } else if (const auto site = own.find(point.label); site != own.end()) {
      point.uv = site->second;
    }
    made.fitted.fit.uv[k] = point.uv;
  }
  MeasureResiduals(made.fitted);
}

MadeFace MakeFace(const PriorFace& o, PlacedTemplate placed, const FaceInput& in,
                  const RunContext& context) {
  MadeFace made = FindLikelyFace(o.use, std::move(placed), in, context).made;
  MeetDowels(*in.prior, made);
  TakeDraws(o.use, MoveAsDrawn(*in.prior, made), made);
  return made;
}

// The ratio of the tips' variance to that of measured depths. A fit weighs its points only against
// each other, so its other terms must grow by this ratio.
double TipVarianceRatio(const PriorThenFit& o, const FaceInput& in) {
  if (in.experiment.tissue.depths != DepthSource::kTable) {
    return 1;
  }
  const TableDepthOptions parts = SplitTableError(o.use.table_depths, in.experiment);
  const double measured = std::pow(o.use.estimate.tip_normal_sd_mm, 2);
  double sum = 0;
  for (const Dowel& dowel : in.subject.dowels_on_bone) {
    sum += measured / (measured + std::pow(DepthSd_mm(parts, dowel), 2));
  }
  return static_cast<double>(in.subject.dowels_on_bone.size()) / sum;
}

// The plan of a fit that starts from the prior's face.
FitPlan PlanFitOnPrior(const PriorThenFit& o, const FaceInput& in) {
  FitPlan plan = PlanFit(in.experiment);
  plan.first_fit.clear();  // seeds are taken on the prior's face
  if (auto* const seeds = std::get_if<SeedOptions>(&plan.seeds)) {
    seeds->weight = o.seed_weight;
  }
  std::vector<Term>& terms = plan.fit.terms;
  const bool named = std::ranges::any_of(
      terms, [](const Term& term) { return std::holds_alternative<PriorShapeTerm>(term); });
  if (!named) {
    terms.emplace_back(PriorShapeTerm{.weight = o.shape_weight * TipVarianceRatio(o, in)});
  }
  return plan;
}

// The factor by which the estimate's loss reduced the pull of a dowel; 1 for one that took no part.
// Without it a single wrong dowel, which the estimate resists, would spoil the fit.
double TipWeight(const ShapeEstimate& estimate, const std::string& label) {
  const auto found = std::ranges::find(estimate.tip_labels, label);
  return found == estimate.tip_labels.end()
             ? 1
             : estimate.tip_weight[found - estimate.tip_labels.begin()];
}

MadeFace MakeFace(const PriorThenFit& o, PlacedTemplate placed, const FaceInput& in,
                  const RunContext& context) {
  MadeFace made = FindLikelyFace(o.use, std::move(placed), in, context).made;
  const HSplineSurface& surface = made.placed.face.surface;
  for (FitPoint& point : made.placed.dowels.points) {
    if (!IsHeld(in.experiment.sites, point.label)) {
      point.uv = ProjectFrom(surface, point.position, point.uv).uv;
    }
    point.weight *= TipWeight(*made.prior, point.label);
  }
  const PriorKnowledge known{
      .shape = SampleShape(surface, *made.prior, in.prior->face, in.prior->on_template),
      .features = FeaturesOn(*made.prior, in.prior->face),
      .trust = &o.seed_trust};
  made.fitted = FitFace(PlanFitOnPrior(o, in), made.placed, in, known, context);
  TakeDraws(o.use, MoveAsDrawn(*in.prior, made), made);
  return made;
}

MadeFace MakeFace(const SpringFace& o, PlacedTemplate placed, const FaceInput& in,
                  const RunContext& context) {
  return MakeSpringFace(o, std::move(placed), in, context);
}

MadeFace MakeFace(const JointFace& o, PlacedTemplate placed, const FaceInput& in,
                  const RunContext& context) {
  return MakeJointFace(o, std::move(placed), in, context);
}

}  // namespace

std::shared_ptr<const LoadedPrior> LoadExperimentPrior(const Experiment& experiment,
                                                       const TemplateFace& generic,
                                                       StageCache& cache,
                                                       const RunContext& context) {
  if (!UsesPrior(WayToFace(experiment))) {
    return nullptr;
  }
  return cache.Get<LoadedPrior>(StageKey("prior", experiment.prior, experiment.face_template), [&] {
    LoadedPrior prior{.face = LoadPrior(experiment.prior, generic), .on_template = {}};
    prior.on_template = LayOnTemplate(prior.face, generic, context);
    return prior;
  });
}

TriMesh SeedableFace(const Experiment& experiment, std::span<const CutPlane> cuts,
                     const TriMesh& implicit, Case& subject) {
  for (const CutPlane& plane : cuts) {
    subject.notes.push_back(
        fmt::format("the skull is cut off at {}: no seeds within {:.0f} mm of there, and the face "
                    "beyond it is the template's",
                    ToPhrase(plane), experiment.cut_margin_mm));
  }
  return WithinScan(implicit, cuts, experiment.cut_margin_mm);
}

MadeFace MakeFace(const FaceInput& in, const RunContext& context) {
  PlacedTemplate placed =
      Place(in.generic, in.subject.dowels_on_bone, in.subject.network, in.experiment);
  return std::visit([&](const auto& way) { return MakeFace(way, std::move(placed), in, context); },
                    WayToFace(in.experiment));
}

std::optional<HSplineSurface> EditByHand(const Experiment& experiment, MadeFace& made,
                                         Case& subject) {
  if (experiment.edits.empty()) {
    return std::nullopt;
  }
  const EditScript script = ReadEditScript(experiment.edits);
  HSplineSurface before = made.fitted.fit.surface;
  ApplyEdits(script, made.fitted.fit.surface);
  for (HSplineSurface& sample : made.samples) {
    ApplyEdits(script, sample);
  }
  MeasureResiduals(made.fitted);
  subject.inputs.push_back(experiment.edits);
  subject.notes.push_back(
      fmt::format("the face was changed by hand: {} vertices and {} parts of it, by {}; what is "
                  "measured is the changed face",
                  script.edits.size(), script.resets.size(), experiment.edits.filename().string()));
  return before;
}

FaceUncertainty PriorUncertainty(const UncertaintyOptions& options, const LoadedPrior& prior,
                                 const MadeFace& made, const Tessellation& face) {
  FaceUncertainty result;
  result.samples = made.samples;
  if (!options.sigma) {
    return result;
  }
  if (made.sigma) {
    for (const Vec2& uv : face.uv) {
      result.sigma_mm.push_back(made.sigma->grid.Interpolate(made.sigma->sigma_mm, uv));
    }
  } else {
    result.sigma_mm = SigmaAt(face.uv, *made.prior, prior.face, prior.on_template);
  }
  const std::vector<WeightedValue> by_area = SortedValues(result.sigma_mm, VertexAreas(face.mesh));
  result.median_mm = Quantile(by_area, 0.5);
  result.p95_mm = Quantile(by_area, 0.95);
  return result;
}

}  // namespace semblance::problems
