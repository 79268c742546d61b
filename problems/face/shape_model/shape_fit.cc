// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/shape_model/shape_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>
#include <ranges>
#include <span>
#include <utility>

#include "problems/face/shape_model/face_problem.h"
#include "problems/face/shape_model/shape_model.h"
#include "problems/face/shape_model/shape_posterior.h"
#include "surfaces/base/error.h"
#include "surfaces/base/farthest_first.h"
#include "surfaces/mesh/correspondences.h"

namespace semblance::problems {
namespace {

constexpr int kPoseRounds = 2;              // first rounds, which move the pose alone
constexpr int kFirstSurfaceRound = 3;       // counted from 0; before, points would find wrong feet
constexpr double kMoveTolerance_mm = 5e-3;  // ends the rounds; far below any error of the data

// ---------------------------------------------------------------------------------------------
// Checks
// ---------------------------------------------------------------------------------------------

void CheckTips(const ShapeModel& model, const ShapeTarget& target) {
  for (const ShapeTip& tip : target.tips) {
    if (tip.at.triangle < 0 ||
        static_cast<std::size_t>(tip.at.triangle) >= model.mean.triangles.size() ||
        !tip.at.weights.allFinite()) {
      throw InputError(
          fmt::format("shape model: '{}' has no point on the model's mesh", tip.label));
    }
    if (!tip.position.allFinite() || !tip.direction.allFinite() || !(tip.along_sd_mm >= 0)) {
      throw InputError(
          fmt::format("shape model: the tip of '{}' is not finite; leave it out", tip.label));
    }
  }
  for (const ShapeMark& mark : target.marks) {
    if (mark.at.empty() || !mark.position.allFinite() || !mark.direction.allFinite() ||
        !(mark.sd_mm > 0)) {
      throw InputError(fmt::format(
          "shape model: the mark '{}' has no point, place, direction or deviation", mark.label));
    }
  }
  for (const auto* sd_mm : {&target.surface_sd_mm, &target.surface_error_mm}) {
    if (target.surface != nullptr && !sd_mm->empty() &&
        sd_mm->size() != target.surface->points.size()) {
      throw InputError(fmt::format(
          "shape model: {} deviations for the {} points of the surface; give one per point or none",
          sd_mm->size(), target.surface->points.size()));
    }
  }
  if (!(target.start.scale > 0)) {
    throw InputError(
        fmt::format("shape model: scale {} of the start; it must be positive", target.start.scale));
  }
}

// ---------------------------------------------------------------------------------------------
// Points of the model that are used
// ---------------------------------------------------------------------------------------------

// Indices of at most `count` points that lie far apart, beginning with point 0.
std::vector<int> SpreadPoints(std::span<const Vec3> points, int count) {
  const std::vector<std::size_t> some =
      FarthestFirst(points, 0, static_cast<std::size_t>(count), Coincident::kLeftOut);
  return {some.begin(), some.end()};
}

std::vector<Vec3> FeaturePositions(const ShapeTarget& target) {
  std::vector<Vec3> positions;
  for (const ShapeFeature& feature : target.features) {
    positions.push_back(feature.position);
  }
  return positions;
}

// The tip nearest to a point of the mean.
struct NearestTip {
  double squared_mm = 0;    // squared distance; 0 without tips
  double shared_sd_mm = 0;  // ShapeTip::shared_sd_mm
};

NearestTip NearestTipTo(const Vec3& p, const ShapeModel& model, const ShapeTarget& target) {
  NearestTip nearest;
  bool first = true;
  for (const ShapeTip& tip : target.tips) {
    const Vec3 at = FindPosition(tip.at, model.mean, model.mean.points);
    const double squared_mm = (at - p).squaredNorm();
    if (std::exchange(first, false) || squared_mm < nearest.squared_mm) {
      nearest = {squared_mm, tip.shared_sd_mm};
    }
  }
  return nearest;
}

// The additional standard deviation of a point far from all observations, where the modes alone are
// too confident. It is 0 without observations, because then the modes are the only information.
double UnseenSd_mm(const Vec3& p, std::span<const ShapeObservation> seen,
                   const ShapeFitOptions& options) {
  if (seen.empty()) {
    return 0;
  }
  double nearest = std::numeric_limits<double>::infinity();
  for (const ShapeObservation& one : seen) {
    nearest = std::min(nearest, (one.row.mean - p).squaredNorm());
  }
  return options.unseen_rate * std::max(0.0, std::sqrt(nearest) - options.unseen_reach_mm);
}

// A point of the model that is drawn to the surface.
struct DrawnPoint {
  int vertex = -1;
  double shared_sd_mm = 0;  // ShapeTip::shared_sd_mm of the nearest tip
};

// Points of the model that lie near a tip and away from the features, spread evenly.
std::vector<DrawnPoint> DrawnPoints(const ShapeModel& model, const ShapeTarget& target,
                                    const ShapeFitOptions& options) {
  const double farthest = options.surface_range_mm * options.surface_range_mm;
  std::vector<int> candidates;
  std::vector<Vec3> places;
  for (int v = 0; v < static_cast<int>(model.mean.points.size()); ++v) {
    const Vec3& p = model.mean.points[v];
    const bool clear = std::ranges::none_of(target.features, [&](const ShapeFeature& f) {
      return (p - f.position).squaredNorm() <= f.clearance_mm * f.clearance_mm;
    });
    if (clear && NearestTipTo(p, model, target).squared_mm <= farthest) {
      candidates.push_back(v);
      places.push_back(p);
    }
  }
  std::vector<DrawnPoint> drawn;
  for (const int k : SpreadPoints(places, options.surface_points)) {
    drawn.push_back({candidates[k], NearestTipTo(places[k], model, target).shared_sd_mm});
  }
  return drawn;
}

// ---------------------------------------------------------------------------------------------
// The surface
// ---------------------------------------------------------------------------------------------

class DrawingSurface {
 public:
  DrawingSurface(const ShapeTarget& target, const ShapeFitOptions& options)
      : mesh_(*target.surface),
        sd_mm_(target.surface_sd_mm),
        error_mm_(target.surface_error_mm.empty() ? target.surface_sd_mm : target.surface_error_mm),
        otherwise_sd_mm_(options.surface_sd_mm),
        correspondences_(mesh_, OpenBorder::kReject),
        match_{.reach_mm = options.surface_reach_mm,
               .least_cosine = std::cos(options.surface_max_angle_deg * std::numbers::pi / 180)} {
    if (target.bone != nullptr) {
      bone_.emplace(*target.bone);
    }
  }

  struct Foot {
    Vec3 position, normal;
    double sd_mm;     // for the weight
    double error_mm;  // for sigma
  };
  // The foot of a point with this normal, if it is within reach, not too far compared with
  // bone, and faces the same way.
  std::optional<Foot> FindFoot(const Vec3& p, const Vec3& normal) const {
    const auto found = correspondences_.Find(p, normal, match_);
    if (!found || IsNearerToBone(p, found->point.distance_mm)) {
      return std::nullopt;
    }
    return Foot{found->point.position, found->normal, ValueAt(found->point, sd_mm_),
                ValueAt(found->point, error_mm_)};
  }

 private:
  bool IsNearerToBone(const Vec3& p, double away_mm) const {
    return bone_ && away_mm > otherwise_sd_mm_ && bone_->Closest(p).distance_mm < away_mm;
  }

  double ValueAt(const MeshPoint& at, std::span<const double> values) const {
    if (values.empty()) {
      return otherwise_sd_mm_;
    }
    const Triangle& t = mesh_.triangles[at.triangle];
    return at.weights[0] * values[t[0]] + at.weights[1] * values[t[1]] +
           at.weights[2] * values[t[2]];
  }

  const TriMesh& mesh_;
  std::span<const double> sd_mm_, error_mm_;  // one per point; empty: otherwise_sd_mm_
  double otherwise_sd_mm_;
  Correspondences correspondences_;
  CorrespondenceOptions match_;
  std::optional<MeshQuery> bone_;
};

// ---------------------------------------------------------------------------------------------
// The estimate
// ---------------------------------------------------------------------------------------------

class ShapeEstimator {
 public:
  ShapeEstimator(const ShapeModel& model, const ShapeTarget& target, const ShapeFitOptions& options)
      : model_(model),
        target_(target),
        options_(options),
        prior_{.scale_sd = options.scale_sd,
               .mode_sd = options.mode_sd,
               .population_sd = options.population_sd},
        frame_(CentredFrame(model)) {
    const std::vector<int> centres = SpreadPoints(model.mean.points, options.field.centres);
    field_ = SmoothFieldFactor(model.mean.points, centres, FeaturePositions(target), options.field);
    parameters_ = StartParameters(frame_, target.start, model.Modes(), std::ssize(centres));
    start_pose_ = parameters_.pose;
    if (target.surface != nullptr && options.surface_points > 0 && options.surface_worth > 0) {
      surface_.emplace(target, options);
      drawn_ = DrawnPoints(model, target, options);
    }
  }

  void Round(int round);
  ShapeEstimate Result(const RunContext& context);
  bool HasConverged(int round) const {
    return round > kFirstSurfaceRound && last_move_mm_ < kMoveTolerance_mm;
  }

 private:
  void Place();
  void ObserveTips();
  void ObserveMarks();
  void ObserveSurface();
  void Solve(bool pose_alone);
  void ComputeSpread(const RunContext& context, ShapeEstimate& result) const;

  const ShapeModel& model_;
  const ShapeTarget& target_;
  const ShapeFitOptions& options_;
  ShapePrior prior_;
  ShapeFrame frame_;
  Eigen::MatrixXd field_;
  std::optional<DrawingSurface> surface_;
  std::vector<DrawnPoint> drawn_;

  ShapeParameters parameters_;
  ShapePose start_pose_;
  TriMesh placed_;             // the present shape
  std::vector<Vec3> normals_;  // one per point of placed_
  std::vector<ShapeObservation> seen_;
  int surface_points_ = 0, rounds_ = 0;
  double last_move_mm_ = kNaN;
  bool usable_ = true;
};

void ShapeEstimator::Place() {
  placed_ = {PlacedPoints(frame_, model_, field_, parameters_), model_.mean.triangles};
  normals_ = VertexNormals(placed_);
}

Vec3 NormalAt(const ModelPoint& at, const TriMesh& mesh, const std::vector<Vec3>& normals) {
  return FindPosition(at, mesh, normals).normalized();
}

void ShapeEstimator::ObserveTips() {
  for (const ShapeTip& tip : target_.tips) {
    const PointSpread spread{.normal = NormalAt(tip.at, model_.mean, normals_),
                             .normal_sd_mm = options_.tip_normal_sd_mm,
                             .tangent_sd_mm = options_.tip_tangent_sd_mm,
                             .direction = tip.direction,
                             .along_sd_mm = tip.along_sd_mm};
    seen_.push_back({.row = PointRowAt(model_, field_, tip.at),
                     .position = tip.position,
                     .whitening = MakeWhitening(spread),
                     .loss_width = options_.tip_loss_width,
                     .shared_mm = tip.shared_sd_mm * tip.direction});
  }
}

void ShapeEstimator::ObserveMarks() {
  for (const ShapeMark& mark : target_.marks) {
    seen_.push_back({.row = MeanRow(model_, field_, mark.at),
                     .position = mark.position,
                     .whitening = mark.direction.transpose() / mark.sd_mm,
                     .loss_width = options_.tip_loss_width});
  }
}

void ShapeEstimator::ObserveSurface() {
  surface_points_ = 0;
  const double weight = options_.surface_worth / options_.surface_points;
  for (const auto& [v, shared_sd_mm] : drawn_) {
    if (const auto foot = surface_->FindFoot(placed_.points[v], normals_[v])) {
      seen_.push_back({.row = VertexRow(model_, field_, v),
                       .position = foot->position,
                       .whitening = foot->normal.transpose() / foot->sd_mm,
                       .loss_width = options_.surface_loss_width,
                       .weight = weight,
                       .shared_mm = shared_sd_mm * foot->normal,
                       .smooth_sd_mm = foot->error_mm});
      ++surface_points_;
    }
  }
}

void ShapeEstimator::Solve(bool pose_alone) {
  FaceProblem problem(frame_, parameters_);
  problem.BeginPart("face_model");
  problem.AddPriors(prior_, start_pose_);
  problem.BeginPart("observations");
  for (const ShapeObservation& one : seen_) {
    problem.Observe(one);
  }
  constexpr int kIterations = 4;  // the observations change with the next round
  usable_ = problem.Solve({.max_iterations = kIterations, .moves_pose_alone = pose_alone}).usable &&
            usable_;
}

// The largest distance between the points of two rounds.
double LargestMove(const std::vector<Vec3>& before, const std::vector<Vec3>& after) {
  double most = 0;
  for (std::size_t v = 0; v < before.size(); ++v) {
    most = std::max(most, (after[v] - before[v]).norm());
  }
  return most;
}

void ShapeEstimator::Round(int round) {
  Place();
  seen_.clear();
  ObserveTips();
  ObserveMarks();
  if (surface_ && round >= kFirstSurfaceRound) {
    ObserveSurface();
  }
  Solve(round < kPoseRounds);
  last_move_mm_ = LargestMove(placed_.points, PlacedPoints(frame_, model_, field_, parameters_));
  rounds_ = round + 1;
}

double Rms(const Eigen::MatrixXd& rows) {
  return rows.size() == 0 ? 0 : std::sqrt(rows.rowwise().squaredNorm().mean());
}

// Computes sigma and the drawn shapes.
void ShapeEstimator::ComputeSpread(const RunContext& context, ShapeEstimate& result) const {
  std::vector<ShapeRow> rows;
  for (int v = 0; v < static_cast<int>(model_.mean.points.size()); ++v) {
    rows.push_back(VertexRow(model_, field_, v));
  }
  const ShapePosterior posterior =
      MakePosterior(frame_, parameters_, seen_, prior_, options_.surface_length_mm);
  result.sigma_mm =
      DeviationsAlong(frame_, parameters_, posterior, rows, normals_, context.threads);
  for (std::size_t v = 0; v < result.sigma_mm.size(); ++v) {
    const double unseen_mm = UnseenSd_mm(model_.mean.points[v], seen_, options_);
    result.sigma_mm[v] = std::hypot(result.sigma_mm[v], options_.discrepancy_mm, unseen_mm);
  }
  for (const std::uint64_t random_seed : target_.draws) {
    result.drawn.push_back(
        PlacedPoints(frame_, model_, field_, DrawParameters(parameters_, posterior, random_seed)));
  }
}

ShapeEstimate ShapeEstimator::Result(const RunContext& context) {
  Place();
  ShapeEstimate result;
  result.subject_from_model = MakeSimilarity(frame_, parameters_);
  result.coefficients = parameters_.coefficients;
  result.points = placed_.points;
  if (target_.compute_spread) {
    ComputeSpread(context, result);
  }
  result.frame = frame_;
  result.parameters = parameters_;
  result.field = field_;
  for (std::size_t k = 0; k < target_.tips.size(); ++k) {  // the first observations are the tips
    const ShapeTip& tip = target_.tips[k];
    const Vec3 at = FindPosition(tip.at, model_.mean, placed_.points);
    result.tip_labels.push_back(tip.label);
    result.tip_residual_mm.push_back(
        (tip.position - at).dot(NormalAt(tip.at, model_.mean, normals_)));
    result.tip_weight.push_back(LossWeight(seen_[k], at));
  }
  for (const ShapeMark& mark : target_.marks) {
    Vec3 at = Vec3::Zero();
    for (const ModelPoint& point : mark.at) {
      at += FindPosition(point, model_.mean, placed_.points) / static_cast<double>(mark.at.size());
    }
    result.mark_residual_mm.push_back((mark.position - at).dot(mark.direction));
  }
  result.field_rms_mm = Rms(
      field_ *
      Eigen::Map<const Eigen::Matrix3Xd>(parameters_.field.data(), 3, field_.cols()).transpose());
  result.surface_points = surface_points_;
  result.rounds = rounds_;
  result.last_move_mm = last_move_mm_;
  result.usable = usable_;
  return result;
}

}  // namespace

ShapeEstimate EstimateShape(const ShapeModel& model, const ShapeTarget& target,
                            const ShapeFitOptions& options, const RunContext& context) {
  CheckShapeModel(model, "shape model");
  CheckTips(model, target);
  ShapeEstimator estimator(model, target, options);
  for (int round = 0; round < options.rounds && !estimator.HasConverged(round); ++round) {
    context.ThrowIfStopped();
    context.Report("shape", fmt::format("round {} of at most {}", round + 1, options.rounds));
    estimator.Round(round);
  }
  return estimator.Result(context);
}

}  // namespace semblance::problems
