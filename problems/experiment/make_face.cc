// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/make_face.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include "problems/experiment/dowel_projection.h"
#include "problems/experiment/experiment_config.h"
#include "problems/face/edit_script.h"
#include "problems/face/hspline_prior.h"
#include "problems/face/prior_observations.h"
#include "problems/subject/condition_depths.h"
#include "problems/subject/landmark_files/read_landmarks.h"
#include "surfaces/base/error.h"
#include "surfaces/base/quantile.h"
#include "surfaces/base/thin_plate.h"
#include "surfaces/hspline_query/hspline_project.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

TemplateFace InSubjectFrame(const TemplateFace& generic, const Similarity& face_from_template) {
  TemplateFace placed = generic;
  placed.surface = Transformed(generic.surface, face_from_template);
  for (TemplateFeature& feature : placed.features) {
    if (feature.region) {
      feature.region = TransformedSphere(*feature.region, face_from_template);
    }
  }
  return placed;
}

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

// Moves seeds from the triangles of the implicit face onto the surface itself. Triangles cut its
// curves short, by an amount that depends on the place of the grid's cells.
void LayOnField(const HSplineSurface& surface, const SeedOptions& options,
                const ImplicitSurface* field, std::vector<FitPoint>& seeds) {
  constexpr double kReach_mm = 2;
  if (field == nullptr) {
    return;
  }
  for (FitPoint& seed : seeds) {
    const Vec3 direction = surface.LevelFrame(options.direction_level, seed.uv).Normal();
    seed.position = FindOnLine(*field, seed.position, direction, kReach_mm).value_or(seed.position);
  }
}

SeedResult MakeSeeds(const HSplineSurface& surface, const MeshQuery& query, const FaceInput& in,
                     std::span<const Sphere> masks, const SeedSource& source) {
  const auto* const options = std::get_if<SeedOptions>(&source);
  if (options == nullptr) {
    return {.points = {}, .masked = 0, .missed = 0, .folded = 0};
  }
  SeedResult seeding = SeedDowels(surface, query, in.implicit, masks, *options);
  LayOnField(surface, *options, in.field, seeding.points);
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
    SeedResult seeding = MakeSeeds(surface, query, in, masks, plan.seeds);
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

// Residuals and their RMS, weighted as those of a fit, for a surface that the fit has not made.
void MeasureResiduals(FaceFit& fitted) {
  FitResult& fit = fitted.fit;
  double all = 0, weight = 0, of_dowels = 0, dowel_weight = 0;
  fit.residual_mm.clear();
  for (std::size_t k = 0; k < fitted.target.points.size(); ++k) {
    const FitPoint& point = fitted.target.points[k];
    fit.residual_mm.push_back((fit.surface.Point(fit.uv[k]) - point.position).norm());
    const double squared = point.weight * fit.residual_mm[k] * fit.residual_mm[k];
    all += squared;
    weight += point.weight;
    if (point.role != PointRole::kSeed) {
      of_dowels += squared;
      dowel_weight += point.weight;
    }
  }
  fit.point_rms_mm = std::sqrt(all / weight);
  fit.dowel_rms_mm = std::sqrt(of_dowels / dowel_weight);
}

// A face without a fit, in the form of a fit's result.
FaceFit Unfitted(HSplineSurface surface, const FitTarget& dowels) {
  FitResult fit{.surface = std::move(surface)};
  for (const FitPoint& point : dowels.points) {
    fit.uv.push_back(point.uv);
  }
  fit.restored_features = 0;
  fit.usable = true;
  FaceFit unfitted{{.points = {}, .masked = 0, .missed = 0, .folded = 0}, dowels, std::move(fit)};
  MeasureResiduals(unfitted);
  return unfitted;
}

// ---------------------------------------------------------------------------------------------
// Bending
// ---------------------------------------------------------------------------------------------

struct PointPairs {
  std::vector<Vec3> from, to;
};

PointPairs FromSitesToTips(const HSplineSurface& surface, const FitTarget& dowels) {
  PointPairs pairs;
  for (const FitPoint& point : dowels.points) {
    pairs.from.push_back(surface.Point(point.uv));
    pairs.to.push_back(point.position);
  }
  return pairs;
}

// The landmarks that both skulls have.
PointPairs FromSkullToSkull(const std::filesystem::path& reference,
                            const Similarity& face_from_template,
                            const std::map<std::string, Vec3>& subject) {
  constexpr std::size_t kFewestLandmarks = 4;  // a thin plate needs as many
  PointPairs pairs;
  for (const Landmark& landmark : InLpsMm(ReadLandmarks(reference).file).landmarks) {
    if (const auto same = subject.find(landmark.site); same != subject.end()) {
      const auto& [x, y, z] = landmark.point;
      pairs.from.push_back(face_from_template * Vec3(x, y, z));
      pairs.to.push_back(same->second);
    }
  }
  if (pairs.from.size() < kFewestLandmarks) {
    throw InputError(
        fmt::format("{}: it shares {} landmarks with the subject, and from skull to skull at least "
                    "{} are needed",
                    reference.string(), pairs.from.size(), kFewestLandmarks));
  }
  return pairs;
}

HSplineSurface UnderThinPlate(const HSplineSurface& surface, const PointPairs& pairs,
                              double stiffness_mm) {
  std::vector<Vec3> samples;
  const ThinPlate plate = FitThinPlate(pairs.from, pairs.to, {}, {.stiffness_mm = stiffness_mm});
  const DomainGrid grid = MakeDomainGrid(surface.shape());
  for (std::size_t k = 0; k < grid.size(); ++k) {
    samples.push_back(plate(surface.Point(grid.UvAt(k))));
  }
  return SurfaceThrough(surface.shape(), grid, samples);
}

// ---------------------------------------------------------------------------------------------
// The prior's most likely face
// ---------------------------------------------------------------------------------------------

// The model's points for dowels at sites that the prior lacks: under the points in which the rays
// of the dowels meet the placed template.
std::map<std::string, ModelPoint> OtherSites(const FitTarget& dowels, const LoadedPrior& prior) {
  std::map<std::string, ModelPoint> others;
  for (const FitPoint& point : dowels.points) {
    if (!prior.face.sites.contains(point.label)) {
      others[point.label] = prior.on_template.under[prior.on_template.grid.NearestTo(point.uv)];
    }
  }
  return others;
}

bool HasOtherSites(const FacePrior& prior, const ShapeTarget& target) {
  return std::ranges::any_of(target.tips,
                             [&](const ShapeTip& tip) { return !prior.sites.contains(tip.label); });
}

// Moves the model's points of sites that the prior lacks to the points of the estimated face that
// are nearest to the tips. They were found on a face that was only placed.
void Reproject(const ShapeEstimate& shape, const FacePrior& prior, ShapeTarget& target) {
  const MeshQuery query(TriMesh{shape.points, prior.model.mean.triangles});
  for (ShapeTip& tip : target.tips) {
    if (!prior.sites.contains(tip.label)) {
      const MeshPoint at = query.Closest(tip.position);
      tip.at = {at.triangle, at.weights};
    }
  }
}

// Estimates twice if the prior lacks a dowel's site. Only the second estimate computes the spread.
ShapeEstimate Estimate(const FacePrior& prior, const PriorUse& use, ShapeTarget& target,
                       const RunContext& context) {
  if (HasOtherSites(prior, target)) {
    const bool compute_spread = std::exchange(target.compute_spread, false);
    Reproject(EstimateShape(prior.model, target, use.estimate, context), prior, target);
    target.compute_spread = compute_spread;
  }
  return EstimateShape(prior.model, target, use.estimate, context);
}

// With depths of a table the person's build is unknown. The tips carry this into sigma. Around
// sites without a dowel, for example where no bone was scanned, no tip does, so the deviation of
// the site is added here.
void WidenWhereNoDowelIs(const FacePrior& prior, std::span<const Dowel> dowels,
                         const TableDepthOptions& table, std::vector<double>& sigma_mm) {
  constexpr double kUsualDepth_mm = 10;  // stands for the unknown depth in PublishedSd_mm
  std::map<std::string, Vec3> places;
  for (const auto& [site, at] : prior.sites) {
    places[site] = FindPosition(at, prior.model.mean, prior.model.mean.points);
  }
  std::map<std::string, double> missing_mm;
  for (const auto& [site, place] : places) {
    if (std::ranges::find(dowels, site, &Dowel::site) == dowels.end()) {
      Dowel none;
      none.site = site;
      none.depth_mm = kUsualDepth_mm;
      missing_mm[site] = table.shared * PublishedSd_mm(none);
    }
  }
  for (std::size_t v = 0; v < sigma_mm.size() && !missing_mm.empty(); ++v) {
    const auto nearest = std::ranges::min_element(places, {}, [&](const auto& place) {
      return (place.second - prior.model.mean.points[v]).squaredNorm();
    });
    if (const auto missing = missing_mm.find(nearest->first); missing != missing_mm.end()) {
      sigma_mm[v] = std::hypot(sigma_mm[v], missing->second);
    }
  }
}

// Without a pose of the subject no rule applies.
RuleMarks ApplySubjectRules(const FaceInput& in, const FacePrior& prior) {
  return in.subject.basis.sites ? ApplyRules(in.experiment.rules, in.subject.points,
                                             in.subject.basis.sites->skull_from_average, prior)
                                : RuleMarks();
}

// The random seeds of the faces to draw. The first one may replace the most likely face.
std::vector<std::uint64_t> ListDraws(const PriorUse& use, const UncertaintyOptions& options) {
  std::vector<std::uint64_t> random_seeds;
  if (use.draw > 0) {
    random_seeds.push_back(use.draw);
  }
  for (int k = 0; k < options.samples; ++k) {
    random_seeds.push_back(options.random_seed + k);
  }
  return random_seeds;
}

void TakeDraws(const PriorUse& use, const LoadedPrior& prior, MadeFace& made) {
  const HSplineSurface likely = made.fitted.fit.surface;
  for (std::size_t k = 0; k < made.prior->drawn.size(); ++k) {
    HSplineSurface drawn = MovedAsDrawn(likely, *made.prior, k, prior.face, prior.on_template);
    if (use.draw > 0 && k == 0) {
      made.fitted.fit.surface = std::move(drawn);
      MeasureResiduals(made.fitted);
    } else {
      made.samples.push_back(std::move(drawn));
    }
  }
}

// A table's deviations are those of the population. The options split them into the errors that a
// person's depths share and the rest. Conditioned on known depths of this person, the deviations
// are the depths' own.
TableDepthOptions SplitTableError(const TableDepthOptions& table, const Experiment& experiment) {
  return IsConditioned(experiment.tissue) ? TableDepthOptions{.own = 1, .shared = 0} : table;
}

// The prior's most likely face as a placed template.
MadeFace MostLikelyFace(const PriorUse& use, PlacedTemplate placed, const FaceInput& in,
                        const RunContext& context) {
  const LoadedPrior& prior = *in.prior;
  const std::vector<Dowel>& dowels = in.subject.dowels_on_bone;
  const TableDepthOptions parts = SplitTableError(use.table_depths, in.experiment);
  const TableDepthOptions* const table =
      in.experiment.tissue.depths == DepthSource::kTable ? &parts : nullptr;
  const TriMesh* const implicit = in.implicit.triangles.empty() ? nullptr : &in.implicit;
  ShapeTarget target =
      PriorTarget(prior.face, dowels, table, implicit, OtherSites(placed.dowels, prior));
  if (implicit != nullptr) {
    ImplicitSpread spread =
        ImplicitSpread_mm(use.implicit_spread, *implicit, in.shell, dowels, table, context.threads);
    target.surface_sd_mm = std::move(spread.sd);
    target.surface_error_mm = std::move(spread.error);
  }
  RuleMarks rules = ApplySubjectRules(in, prior.face);
  target.marks = std::move(rules.marks);
  target.draws = ListDraws(use, in.experiment.uncertainty);
  target.compute_spread = in.tells_sigma || !target.draws.empty();
  ShapeEstimate shape = Estimate(prior.face, use, target, context);
  for (std::size_t k = 0; k < rules.rules.size(); ++k) {
    rules.rules[k].residual_mm = shape.mark_residual_mm[k];
  }
  if (table != nullptr) {
    WidenWhereNoDowelIs(prior.face, dowels, *table, shape.sigma_mm);
  }
  placed.face_from_template =
      Composed(shape.subject_from_model, prior.on_template.mean_from_template);
  placed.face = InSubjectFrame(in.generic, placed.face_from_template);
  placed.face.surface =
      MakeFaceSurface(shape, prior.face, prior.on_template, in.generic.surface.shape());
  FaceFit unfitted = Unfitted(placed.face.surface, placed.dowels);
  unfitted.fit.usable = shape.usable;
  return {std::move(placed), std::move(unfitted), std::move(shape), std::move(rules.rules)};
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
  const PointPairs pairs =
      FromSkullToSkull(o.landmarks, placed.face_from_template, in.subject.points);
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
  MadeFace made = MostLikelyFace(o.use, std::move(placed), in, context);
  MeetDowels(*in.prior, made);
  TakeDraws(o.use, *in.prior, made);
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

MadeFace MakeFace(const PriorThenFit& o, PlacedTemplate placed, const FaceInput& in,
                  const RunContext& context) {
  MadeFace made = MostLikelyFace(o.use, std::move(placed), in, context);
  const HSplineSurface& surface = made.placed.face.surface;
  for (FitPoint& point : made.placed.dowels.points) {
    if (!IsHeld(in.experiment.sites, point.label)) {
      point.uv = ProjectFrom(surface, point.position, point.uv).uv;
    }
  }
  const PriorKnowledge known{
      .shape = SampleShape(surface, *made.prior, in.prior->face, in.prior->on_template),
      .features = FeaturesOn(*made.prior, in.prior->face),
      .trust = &o.seed_trust};
  made.fitted = FitFace(PlanFitOnPrior(o, in), made.placed, in, known, context);
  TakeDraws(o.use, *in.prior, made);
  return made;
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
  result.sigma_mm = SigmaAt(face.uv, *made.prior, prior.face, prior.on_template);
  const std::vector<WeightedValue> by_area = SortedValues(result.sigma_mm, VertexAreas(face.mesh));
  result.median_mm = Quantile(by_area, 0.5);
  result.p95_mm = Quantile(by_area, 0.95);
  return result;
}

}  // namespace semblance::problems
