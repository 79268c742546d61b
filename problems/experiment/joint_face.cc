// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/joint_face.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "problems/experiment/face_parts.h"
#include "problems/experiment/likely_face.h"
#include "problems/experiment/outer_bone.h"
#include "problems/face/hspline_prior.h"
#include "problems/face/joint_fit.h"
#include "problems/face/joint_posterior.h"
#include "problems/subject/extra_sites.h"
#include "surfaces/hspline_query/hspline_project.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

// A dowel's tip, the (u,v) of its site and the foot to which it has slid.
struct SlidingDowel {
  FitPoint point;  // uv: of the site
  Vec2 foot_uv = Vec2::Constant(kNaN);
  bool is_held = false;
  Vec3 direction = Vec3::Zero();  // of further errors, as in ShapeTip
  double along_sd_mm = 0;
  double shared_sd_mm = 0;
};

// The implicit face as an observed surface.
class ImplicitObserver {
 public:
  ImplicitObserver(const TriMesh& implicit, const ShapeTarget& target)
      : mesh_(implicit),
        sd_mm_(target.surface_sd_mm),
        error_mm_(target.surface_error_mm),
        query_(implicit),
        normals_(VertexNormals(implicit)) {}

  const MeshQuery& query() const { return query_; }

  SurfaceObservation Observe(const FitPoint& seed, const ShapeFitOptions& options,
                             double weight) const {
    const MeshPoint at = query_.Closest(seed.position);
    const ModelPoint place{at.triangle, at.weights};
    const Vec3 normal = FindPosition(place, mesh_, normals_).normalized();
    const double sd_mm = sd_mm_.empty() ? options.surface_sd_mm : ValueAt(at, sd_mm_);
    return {.uv = seed.uv,
            .position = seed.position,
            .whitening = normal.transpose() / sd_mm,
            .loss_width = options.surface_loss_width,
            .weight = weight,
            .shared_mm = normal,  // times the deviation, which follows from the nearest dowel
            .smooth_sd_mm = error_mm_.empty() ? sd_mm : ValueAt(at, error_mm_)};
  }

 private:
  double ValueAt(const MeshPoint& at, const std::vector<double>& values) const {
    const Triangle& t = mesh_.triangles[at.triangle];
    return at.weights.dot(Vec3(values[t[0]], values[t[1]], values[t[2]]));
  }

  const TriMesh& mesh_;
  const std::vector<double>& sd_mm_;
  const std::vector<double>& error_mm_;
  MeshQuery query_;
  std::vector<Vec3> normals_;
};

// The rules' marks as observations of the model.
std::vector<ShapeObservation> ObserveMarks(const ShapeTarget& target, const ShapeModel& model,
                                           const Eigen::MatrixXd& field,
                                           const ShapeFitOptions& options) {
  std::vector<ShapeObservation> marks;
  for (const ShapeMark& mark : target.marks) {
    marks.push_back({.row = MeanRow(model, field, mark.at),
                     .position = mark.position,
                     .whitening = mark.direction.transpose() / mark.sd_mm,
                     .loss_width = options.tip_loss_width});
  }
  return marks;
}

// The steps of the plan, then those of its sweeps: all its levels, coarse to fine, at fraction 1.
std::vector<ScheduleStep> AllSteps(const SchedulePlan& plan) {
  std::vector<ScheduleStep> steps = PlanSteps(plan);
  std::set<int> levels;
  for (const ScheduleStep& step : steps) {
    levels.insert(step.level);
  }
  const auto* const listed = std::get_if<ListedPlan>(&plan);
  const auto* const in_order = std::get_if<CoarseToFinePlan>(&plan);
  const int sweeps = listed != nullptr     ? listed->sweeps
                     : in_order != nullptr ? in_order->sweeps
                                           : 0;
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    std::ranges::transform(levels, std::back_inserter(steps), [](int level) {
      return ScheduleStep{level, 1};
    });
  }
  return steps;
}

// The corners of the patches of the level.
DomainGrid CornersOfPatches(const HSplineShape& shape, int level) {
  return {.columns = (shape.patches_u << level) + 1, .rows = (shape.patches_v << level) + 1};
}

class JointFitter {
 public:
  JointFitter(const JointFace& options, LikelyFace likely, const FaceInput& in,
              const RunContext& context)
      : options_(options),
        in_(in),
        context_(context),
        target_(std::move(likely.target)),
        made_(std::move(likely.made)),
        surface_(made_.placed.face.surface),
        model_(MakeVertexModel(in.prior->face, in.prior->on_template, made_.prior->field,
                               surface_.shape())),
        state_(StartJoint(surface_.shape(), made_.prior->frame, made_.prior->parameters)),
        features_(FeaturesOn(*made_.prior, in.prior->face)),
        bone_(in.shell),
        outer_bone_(SampleOuterBone(in.subject.skull, in.subject.origin, in.shell, bone_,
                                    kBoneSample_mm2, context)) {
    const ShapeFitOptions& estimate = options.use.estimate;
    weights_ = {.residual = options.residual,
                .prior = {.scale_sd = estimate.scale_sd,
                          .mode_sd = estimate.mode_sd,
                          .population_sd = estimate.population_sd},
                .start_pose = state_.parameters.pose};
    data_.marks = ObserveMarks(target_, in.prior->face.model, made_.prior->field, estimate);
    PlaceDowels();
    SlideDowels();
    if (!in.implicit.triangles.empty()) {
      implicit_.emplace(in.implicit, target_);
    }
  }

  MadeFace Run() {
    for (int round = 0; round < in_.experiment.rounds; ++round) {
      context_.Report("fit", fmt::format("round {} of {}", round + 1, in_.experiment.rounds));
      Seed();
      levels_.clear();
      slides_.clear();
      for (const ScheduleStep& step : AllSteps(in_.experiment.fit.plan)) {
        Step(step);
      }
    }
    return Result();
  }

 private:
  // The (u,v) that `sites` states, or else those of the site on the model; elsewhere the point of
  // the face nearest to the tip.
  void PlaceDowels() {
    const std::map<std::string, Vec2>& own = made_.placed.face.site_uv;
    const ExtraSites& stated = in_.experiment.sites;
    for (FitPoint& point : made_.placed.dowels.points) {
      SlidingDowel dowel{.point = point, .is_held = IsHeld(stated, point.label)};
      const auto given = stated.find(point.label);
      const bool has_uv = given != stated.end() && given->second.uv.has_value();
      if (const auto site = own.find(point.label); !has_uv && site != own.end()) {
        dowel.point.uv = site->second;
      } else if (!has_uv) {
        dowel.point.uv = ProjectFrom(surface_, point.position, point.uv).uv;
      }
      const auto tip = std::ranges::find(target_.tips, point.label, &ShapeTip::label);
      if (tip != target_.tips.end()) {
        dowel.direction = tip->direction;
        dowel.along_sd_mm = tip->along_sd_mm;
        dowel.shared_sd_mm = tip->shared_sd_mm;
      }
      dowel.foot_uv = dowel.point.uv;
      dowels_.push_back(dowel);
    }
  }

  SeedSource Seeds() const {
    SeedSource seeds = in_.experiment.seeds;
    if (auto* const patches = std::get_if<SeedOptions>(&seeds)) {
      patches->method = options_.seed_method;
    }
    return seeds;
  }

  void Seed() {
    data_.seeds.clear();
    seeding_ = implicit_ ? MakeSeeds(surface_, implicit_->query(), in_,
                                     TemplateMasks(made_.placed.face), Seeds())
                         : SeedResult{.points = {}, .masked = 0, .missed = 0, .folded = 0};
    std::erase_if(seeding_.points, [&](const FitPoint& seed) {
      return !IsTrusted(seed.position) || IsFarFromFace(seed);
    });
    // A seed stands for the area of its patch: patches round the mouth are small.
    std::vector<double> areas;
    for (const FitPoint& seed : seeding_.points) {
      const SurfaceFrame frame = surface_.Frame(seed.uv);
      areas.push_back(frame.du.cross(frame.dv).norm());
    }
    const double all = std::accumulate(areas.begin(), areas.end(), 0.0);
    for (std::size_t k = 0; k < areas.size(); ++k) {
      FitPoint& seed = seeding_.points[k];
      seed.weight = options_.use.estimate.surface_worth * areas[k] / all;
      data_.seeds.push_back(implicit_->Observe(seed, options_.use.estimate, seed.weight));
      data_.seeds.back().shared_mm *= NearestDowel(seed.position).shared_sd_mm;
    }
  }

  // A seed counts near dowels and away from nose, mouth and eyes, as points of the estimate do.
  bool IsTrusted(const Vec3& p) const {
    const double range_mm = options_.use.estimate.surface_range_mm;
    return std::ranges::none_of(features_,
                                [&](const Sphere& feature) {
                                  return (feature.center - p).norm() < feature.radius_mm;
                                }) &&
           !dowels_.empty() && (NearestDowel(p).point.position - p).norm() < range_mm;
  }

  // Returns true if the face is far from the seed and nearer to the bone below it, along the seed's
  // line. The implicit face is then off by half the tissue or more, as where the filled skull
  // bridges the temple, and the face model knows better. A face inside the bone keeps its seeds,
  // which lift it.
  bool IsFarFromFace(const FitPoint& seed) const {
    const Vec3 at = surface_.Point(seed.uv);
    const double way_mm = (seed.position - at).norm();
    return way_mm > options_.use.estimate.surface_sd_mm &&
           bone_.FirstHit(at, -surface_.Frame(seed.uv).Normal(), way_mm).has_value();
  }

  const SlidingDowel& NearestDowel(const Vec3& p) const {
    return *std::ranges::min_element(dowels_, {}, [&](const SlidingDowel& dowel) {
      return (dowel.point.position - p).squaredNorm();
    });
  }

  void ObserveDowels() {
    data_.dowels.clear();
    for (const SlidingDowel& dowel : dowels_) {
      ObserveDowel(dowel);
    }
  }

  // Bone that lies outside the face pushes the face out of it, as skin covers bone. Samples far
  // outside are left out: metal, or bone of a wrong place, must not pull a face to itself.
  void ObserveBoneOutside() {
    constexpr double kFarthest_mm = 4;  // as PlausibilityLimits::bone_most_mm
    MeasureOutside(Tessellate(surface_, kQuadsPerPatch), outer_bone_, context_);
    for (const BoneSample& sample : outer_bone_) {
      if (sample.outside_mm > -kLeastTissue_mm && sample.outside_mm < kFarthest_mm) {
        const Vec3 normal = surface_.Frame(sample.face_uv).Normal();
        data_.dowels.push_back({.uv = sample.face_uv,
                                .position = sample.position + kLeastTissue_mm * normal,
                                .whitening = normal.transpose() / kBoneSd_mm,
                                .loss_width = options_.use.estimate.tip_loss_width});
      }
    }
  }

  void Step(const ScheduleStep& step) {
    context_.ThrowIfStopped();
    ObserveDowels();
    ObserveBoneOutside();
    levels_.push_back(SolveJointStep(model_, data_, weights_, step, state_));
    MoveModel(state_, *made_.prior);
    surface_ = Assemble(*made_.prior, state_);
    SlideDowels();
  }

  // Brings each dowel to its foot on the present surface.
  void SlideDowels() {
    double farthest_mm = 0;
    for (SlidingDowel& dowel : dowels_) {
      if (dowel.is_held) {
        continue;
      }
      const Vec2 foot = ProjectFrom(surface_, dowel.point.position, dowel.foot_uv).uv;
      farthest_mm =
          std::max(farthest_mm, (surface_.Point(foot) - surface_.Point(dowel.foot_uv)).norm());
      dowel.foot_uv = foot;
    }
    slides_.push_back({.before = {}, .after = {}, .max_move_mm = farthest_mm});
  }

  // Tight along the normal at the foot, loose across it at the site.
  void ObserveDowel(const SlidingDowel& dowel) {
    const ShapeFitOptions& estimate = options_.use.estimate;
    const Vec3 normal = surface_.Frame(dowel.foot_uv).Normal();
    const double normal_sd_mm =
        std::hypot(estimate.tip_normal_sd_mm, dowel.along_sd_mm * normal.dot(dowel.direction));
    const Vec3 across = normal.unitOrthogonal();
    Eigen::Matrix<double, 2, 3> tangents;
    tangents << across.transpose(), normal.cross(across).transpose();
    SurfaceObservation seen{.uv = dowel.foot_uv,
                            .position = dowel.point.position,
                            .whitening = normal.transpose() / normal_sd_mm,
                            .loss_width = estimate.tip_loss_width,
                            .weight = dowel.point.weight,
                            .shared_mm = dowel.shared_sd_mm * dowel.direction};
    data_.dowels.push_back(seen);
    seen.uv = dowel.point.uv;
    seen.whitening = tangents / estimate.tip_tangent_sd_mm;
    data_.dowels.push_back(seen);
  }

  // The face as one H-spline: at every level the model's net and the deviation from it.
  HSplineSurface Assemble(const ShapeEstimate& estimate, const JointState& state) const {
    HSplineSurface surface =
        MakeFaceSurface(estimate, in_.prior->face, in_.prior->on_template, surface_.shape());
    std::vector<ControlNet> nets;
    for (int level = 0; level <= surface.shape().max_level; ++level) {
      ControlNet& net = nets.emplace_back(surface.Net(level));
      for (std::size_t k = 0; k < net.vertices.size(); ++k) {
        net.vertices[k] += state.residual[level].vertices[k];
      }
    }
    for (std::size_t level = 0; level < nets.size(); ++level) {
      surface.SetNet(static_cast<int>(level), nets[level]);
    }
    return surface;
  }

  // Growth of sigma away from what was observed, for example where no bone was scanned.
  double UnseenSd_mm(const Vec3& p) const {
    const ShapeFitOptions& estimate = options_.use.estimate;
    double nearest_mm = std::numeric_limits<double>::infinity();
    for (const std::vector<SurfaceObservation>* const seen : {&data_.dowels, &data_.seeds}) {
      for (const SurfaceObservation& one : *seen) {
        nearest_mm = std::min(nearest_mm, (one.position - p).norm());
      }
    }
    return estimate.unseen_rate * std::max(0.0, nearest_mm - estimate.unseen_reach_mm);
  }

  // Positions on the prior's mean.
  std::vector<Vec3> OnMean(std::span<const Vec2> uv) const {
    const auto& [face, laid] = *in_.prior;
    std::vector<Vec3> places;
    for (const Vec2& at : uv) {
      places.push_back(FindPosition(laid.under[laid.grid.NearestTo(at)], face.model.mean,
                                    face.model.mean.points));
    }
    return places;
  }

  // Adds sigma and the random faces.
  void AddSpread() {
    const std::vector<std::uint64_t> draws =
        in_.draws_faces ? ListDraws(options_.use, in_.experiment.uncertainty)
                        : std::vector<std::uint64_t>();
    if (!in_.tells_sigma && draws.empty()) {
      return;
    }
    ObserveDowels();  // where the last step has brought them
    const int level = levels_.back().level;
    const JointPosterior posterior(model_, data_, weights_, options_.use.estimate.surface_length_mm,
                                   level, state_);
    if (in_.tells_sigma) {
      made_.sigma = FindSigma(posterior, level);
    }
    std::vector<HSplineSurface> drawn;
    for (const std::uint64_t random_seed : draws) {
      const JointState state = posterior.Draw(random_seed);
      ShapeEstimate estimate = *made_.prior;
      MoveModel(state, estimate);
      drawn.push_back(Assemble(estimate, state));
    }
    TakeDraws(options_.use, std::move(drawn), made_);
  }

  SigmaGrid FindSigma(const JointPosterior& posterior, int level) const {
    constexpr double kUnexpressed = 0.8;  // chosen by configs/studies/joint_sigma.yaml
    const ShapeFitOptions& estimate = options_.use.estimate;
    SigmaGrid sigma{.grid = CornersOfPatches(surface_.shape(), level), .sigma_mm = {}};
    std::vector<Vec2> uv;
    std::vector<Vec3> normals;
    for (std::size_t k = 0; k < sigma.grid.size(); ++k) {
      uv.push_back(sigma.grid.UvAt(k));
      normals.push_back(surface_.Frame(uv.back()).Normal());
    }
    sigma.sigma_mm = posterior.DeviationsAlong(uv, normals);
    for (std::size_t k = 0; k < uv.size(); ++k) {
      sigma.sigma_mm[k] = std::hypot(sigma.sigma_mm[k], kUnexpressed * estimate.discrepancy_mm,
                                     UnseenSd_mm(surface_.Point(uv[k])));
    }
    if (in_.experiment.tissue.depths == DepthSource::kTable) {
      WidenWhereNoDowelIs(in_.prior->face, in_.subject.dowels_on_bone,
                          SplitTableError(options_.use.table_depths, in_.experiment), OnMean(uv),
                          sigma.sigma_mm);
    }
    return sigma;
  }

  MadeFace Result() {
    FitResult fit{.surface = surface_, .levels = levels_, .relaxations = slides_};
    fit.restored_features = 0;
    fit.usable = std::ranges::all_of(levels_, &LevelSummary::usable);
    FitTarget points;
    for (const SlidingDowel& dowel : dowels_) {
      points.points.push_back(dowel.point);
      fit.uv.push_back(dowel.foot_uv);
    }
    for (const FitPoint& seed : seeding_.points) {
      points.points.push_back(seed);
      fit.uv.push_back(seed.uv);
    }
    made_.fitted = {std::move(seeding_), std::move(points), std::move(fit)};
    MeasureResiduals(made_.fitted);
    AddSpread();
    return std::move(made_);
  }

  void MoveModel(const JointState& state, ShapeEstimate& estimate) const {
    estimate.parameters = state.parameters;
    estimate.coefficients = state.parameters.coefficients;
    estimate.subject_from_model = MakeSimilarity(state.frame, state.parameters);
    estimate.points =
        PlacedPoints(state.frame, in_.prior->face.model, estimate.field, state.parameters);
  }

  // The bone that must lie inside the face. Samples of 9 mm2 are closer to each other than the
  // finest vertices. More tissue keeps more bone inside but pushes true faces out: with 0.5, 1, 1.5
  // and 2 mm the mean distance over three heads (docs/experiments/heads.md, measured depths) is
  // 1.108, 1.111, 1.121 and 1.133 mm, and 1.115 mm without this rule. The deviation is that of a
  // dowel.
  static constexpr double kBoneSample_mm2 = 9, kLeastTissue_mm = 0.5, kBoneSd_mm = 0.5;
  static constexpr int kQuadsPerPatch = 2;

  const JointFace& options_;
  const FaceInput& in_;
  const RunContext& context_;
  ShapeTarget target_;
  MadeFace made_;
  HSplineSurface surface_;
  VertexModel model_;
  JointState state_;
  std::vector<Sphere> features_;
  JointWeights weights_;
  JointData data_;
  std::vector<SlidingDowel> dowels_;
  std::optional<ImplicitObserver> implicit_;
  MeshQuery bone_;
  std::vector<BoneSample> outer_bone_;
  SeedResult seeding_;
  std::vector<LevelSummary> levels_;
  std::vector<RelaxationSummary> slides_;
};

}  // namespace

MadeFace MakeJointFace(const JointFace& options, PlacedTemplate placed, const FaceInput& in,
                       const RunContext& context) {
  FaceInput of_start = in;
  of_start.tells_sigma = of_start.draws_faces = false;  // both are of the last step
  JointFitter fitter(options, FindLikelyFace(options.use, std::move(placed), of_start, context), in,
                     context);
  return fitter.Run();
}

}  // namespace semblance::problems
