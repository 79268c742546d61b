// SPDX-License-Identifier: GPL-3.0-or-later
// States of a step of the schedule, by the mode of relaxation (fitting/plan/fit_driver.cc runs
// them). FITTED: the surface minimises the terms at the present (u,v). MOVED: the (u,v) have
// changed since the last fit. SLID: the points could slide in the last fit.
//
//   none              FITTED
//   footpoint         FITTED --Relax: all rounds--> MOVED
//   alternating       FITTED --Relax: one round--> MOVED --fit--> FITTED   (`rounds` times)
//   joint             FITTED --RelaxJointly--> MOVED --fit--> FITTED       (`rounds` times)
//   tangent_distance  as alternating, then
//                     FITTED --sliding fit--> SLID --Relax: one round--> MOVED
//                                                                   (`tangent_rounds` times)
//
// A move of one corner (MoveCorner):
//
//   damped Gauss-Newton step, at most max_move_mm long
//     --> a triangle turns over, or the penalties do not fall: halve the step; after 8 trials
//         the corner stays
//     --> otherwise the corner moves there
//
// Invariants of Relax and RelaxJointly.
//   1. Every (u,v) stays in [0,1] x [0,1]. A corner crosses u = 0 of a closed surface only without
//      links.
//   2. The points of a corner have the same (u,v) after every round.
//   3. With the barrier, no accepted move leaves a turned triangle (DowelMesh::Turned) at a moved
//      corner.
//   4. Every accepted move lowers the penalties: Relax those of the moved corner with its
//      neighbours fixed, RelaxJointly the sum of the terms' cost and all penalties.
//   5. A corner in `kept` does not move.
//   6. The order of the given points has no effect on the result.
//   7. Points and surface mirrored at u = 1/2 give the mirrored result, apart from links that cross
//      u = 1/2.
#include "fitting/relaxation/relaxation.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "fitting/relaxation/dowel_mesh.h"
#include "fitting/relaxation/relaxer.h"

namespace semblance::fitting {

namespace {

constexpr double kDistance = 1;  // weight of a point's distance; the other weights relate to it

SurfaceSample SampleAt(const HSplineSurface& surface, const Vec2& uv) {
  const SurfaceFrame frame = surface.Frame(uv);
  Vec3 normal = frame.Normal();
  if (!normal.allFinite()) {
    normal.setZero();
  }
  return {.point = frame.point, .du = frame.du, .dv = frame.dv, .normal = normal};
}

}  // namespace

Relaxer::Relaxer(const HSplineSurface& surface, const HSplineSurface& rest, const DowelMesh& mesh,
                 const NetworkMoves& moves, const FitTarget& target)
    : surface_(surface), mesh_(mesh), moves_(moves), target_(target) {
  const std::size_t count = target.points.size();
  const bool linked = !mesh.edges().empty();
  uv_.reserve(count);
  rest_points_.reserve(linked ? count : 0);
  spots_.reserve(count);
  for (std::size_t k = 0; k < count; ++k) {
    uv_.push_back(target.points[k].uv);
    if (linked) {
      rest_points_.push_back(rest.Point(mesh.rest_uv()[k]));
    }
    spots_.push_back(SampleAt(surface, uv_.back()));
  }
  LinkMembers();
  LinkNeighbours();
  order_ = linked ? Order() : Corners();
}

void Relaxer::LinkMembers() {
  const std::vector<int>& corner = mesh_.corner();
  first_member_.assign(uv_.size() + 1, 0);
  kept_.resize(uv_.size());
  std::vector<double> weights;
  weights.reserve(uv_.size());
  for (std::size_t k = 0; k < uv_.size(); ++k) {
    ++first_member_[corner[k] + 1];
    if (std::ranges::find(moves_.kept, target_.points[k].label) != moves_.kept.end()) {
      kept_[corner[k]] = true;
    }
    weights.push_back(target_.points[k].weight);
  }
  std::partial_sum(first_member_.begin(), first_member_.end(), first_member_.begin());
  members_.resize(uv_.size());
  std::vector<int> next = first_member_;
  for (std::size_t k = 0; k < uv_.size(); ++k) {
    members_[next[corner[k]]++] = static_cast<int>(k);
  }
  std::sort(weights.begin(), weights.end());
  mean_weight_ = std::accumulate(weights.begin(), weights.end(), 0.0) /
                 static_cast<double>(std::max<std::size_t>(weights.size(), 1));
}

std::vector<int> Relaxer::Corners() const {
  std::vector<int> corners;
  corners.reserve(uv_.size());
  for (int k = 0; k < static_cast<int>(uv_.size()); ++k) {
    if (!members(k).empty()) {
      corners.push_back(k);
    }
  }
  return corners;
}

std::vector<int> Relaxer::Order() const {
  std::vector<int> order = Corners();
  // From the middle outwards, so that the mirror image of the points moves as their mirror image.
  const auto key = [&](int corner) {
    constexpr double kSame = 1e9;  // places per unit: mirrored u differ by less
    const Vec2& uv = mesh_.rest_uv()[corner];
    return std::tuple(std::round(kSame * std::abs(uv.x() - 0.5)), uv.y(), uv.x());
  };
  std::sort(order.begin(), order.end(), [&](int a, int b) { return key(a) < key(b); });
  return order;
}

void Relaxer::LinkNeighbours() {
  neighbours_.resize(uv_.size());
  around_.resize(uv_.size());
  for (const auto& [a, b] : mesh_.edges()) {
    neighbours_[a].push_back(b);
    neighbours_[b].push_back(a);
  }
  for (std::size_t t = 0; t < mesh_.triangles().size(); ++t) {
    for (const int corner : mesh_.triangles()[t]) {
      around_[corner].push_back(static_cast<int>(t));
    }
  }
}

void Relaxer::AddNeighbour(int corner, int other, const Vec2& uv, const SurfaceSample& spot,
                           double share, LocalPenalty& local) const {
  if (moves_.bunching > 0) {
    const Vec2 rest = mesh_.rest_uv()[corner] - mesh_.rest_uv()[other];
    local.Add(share * moves_.bunching, InMm(uv - uv_[other] - rest), InMm({1, 0}), InMm({0, 1}));
  }
  const double distance = RestDistance(corner, other);
  const Vec3 way = spot.point - spots_[other].point;
  const double length = way.norm();
  if (moves_.distortion > 0 && length > 0) {
    const Vec3 along = way / length;
    local.Add(share * moves_.distortion, Vec3(length - distance, 0, 0),
              Vec3(along.dot(spot.du), 0, 0), Vec3(along.dot(spot.dv), 0, 0));
  }
  if (moves_.crease > 0) {
    constexpr double kStep = 1e-5;  // of central differences; between truncation and round-off
    const Vec3 nu = SampleAt(surface_, uv + Vec2(kStep, 0)).normal -
                    SampleAt(surface_, uv - Vec2(kStep, 0)).normal;
    const Vec3 nv = SampleAt(surface_, uv + Vec2(0, kStep)).normal -
                    SampleAt(surface_, uv - Vec2(0, kStep)).normal;
    local.Add(share * moves_.crease, distance * (spot.normal - spots_[other].normal),
              distance * nu / (2 * kStep), distance * nv / (2 * kStep));
  }
}

LocalPenalty Relaxer::LocalAt(int corner, const Vec2& uv, const SurfaceSample& spot,
                              double distance) const {
  LocalPenalty local;
  for (const int m : members(corner)) {
    const FitPoint& p = target_.points[m];
    local.Add(distance * p.weight / mean_weight_, spot.point - p.position, spot.du, spot.dv);
    if (moves_.standard > 0 && p.role != PointRole::kSeed) {
      local.Add(moves_.standard, InMm(uv - mesh_.rest_uv()[corner]), InMm({1, 0}), InMm({0, 1}));
    }
  }
  const double share =
      1.0 / static_cast<double>(std::max<std::size_t>(neighbours_[corner].size(), 1));
  for (const int other : neighbours_[corner]) {
    AddNeighbour(corner, other, uv, spot, share, local);
  }
  return local;
}

LocalPenalty Relaxer::WithoutDistance(int corner) const {
  return LocalAt(corner, uv_[corner], spots_[corner], 0);
}

Eigen::Matrix2d Relaxer::DampingAt(const SurfaceSample& spot) const {
  Eigen::Matrix<double, 3, 2> tangents;
  tangents << spot.du, spot.dv;
  Eigen::Matrix2d metric = tangents.transpose() * tangents;
  metric.diagonal().array() += 1e-12 * metric.trace();
  const double weight = kDistance + moves_.bunching + moves_.distortion;
  return ((moves_.damping + 1e-9) * weight) * metric;
}

Vec2 Relaxer::LongestMove(int corner) const {
  const SurfaceSample& spot = spots_[corner];
  return moves_.max_move_mm *
         Vec2(1 / std::max(spot.du.norm(), 1e-9), 1 / std::max(spot.dv.norm(), 1e-9));
}

// Invariant 1.
Vec2 Relaxer::ClampUv(const Vec2& uv) const {
  const bool loose = mesh_.triangles().empty();
  return {IntoUnit(uv.x(), loose && surface_.shape().ClosedU()), std::clamp(uv.y(), 0.0, 1.0)};
}

void Relaxer::SetUv(const std::vector<Vec2>& uv) {
  uv_ = uv;
  for (std::size_t k = 0; k < uv_.size(); ++k) {
    spots_[k] = SampleAt(surface_, uv_[k]);
  }
}

// Levenberg's step, damped by the length of the move on the surface, and at most max_move_mm long.
Vec2 Relaxer::ComputeStep(const LocalPenalty& local, const SurfaceSample& spot) const {
  const Eigen::Matrix2d matrix = local.matrix + DampingAt(spot);
  const Vec2 step = matrix.ldlt().solve(-local.gradient);
  if (!step.allFinite()) {
    return Vec2::Zero();
  }
  const double length = (spot.du * step.x() + spot.dv * step.y()).norm();
  return length > moves_.max_move_mm ? step * (moves_.max_move_mm / length) : step;
}

int Relaxer::CountFlips(int corner, const Vec2& uv) {
  if (!moves_.barrier) {
    return 0;
  }
  const Vec2 kept = std::exchange(uv_[corner], uv);
  int flips = 0;
  for (const int t : around_[corner]) {
    flips += mesh_.Turned(mesh_.triangles()[t], uv_) ? 1 : 0;
  }
  uv_[corner] = kept;
  return flips;
}

// Invariants 3 and 4.
void Relaxer::MoveCorner(int corner, RelaxationSummary& summary) {
  const LocalPenalty here = LocalAt(corner, uv_[corner], spots_[corner], kDistance);
  Vec2 step = ComputeStep(here, spots_[corner]);
  int prevented = 0;
  for (int halving = 0; halving < 8; ++halving, step /= 2) {
    const Vec2 uv = ClampUv(uv_[corner] + step);
    if (const int flips = CountFlips(corner, uv); flips > 0) {
      prevented = std::max(prevented, flips);
      continue;
    }
    const SurfaceSample spot = SampleAt(surface_, uv);
    if (LocalAt(corner, uv, spot, kDistance).energy < here.energy) {
      uv_[corner] = uv;
      spots_[corner] = spot;
      break;
    }
  }
  summary.flips_prevented += prevented;
  summary.steps_shortened += prevented > 0 ? 1 : 0;
}

void Relaxer::Round(RelaxationSummary& summary) {
  for (const int corner : order_) {
    if (!kept_[corner]) {
      MoveCorner(corner, summary);
    }
  }
  for (std::size_t k = 0; k < uv_.size(); ++k) {
    uv_[k] = uv_[mesh_.corner()[k]];
    spots_[k] = spots_[mesh_.corner()[k]];
  }
}

namespace {

double SortedMean(std::vector<double> values) {
  std::sort(values.begin(), values.end());  // invariant 6
  const double count = static_cast<double>(std::max<std::size_t>(values.size(), 1));
  return std::accumulate(values.begin(), values.end(), 0.0) / count;
}

}  // namespace

RelaxationPenalties Relaxer::Penalties() const {
  std::vector<double> distance, standard, bunching, distortion, crease;
  for (std::size_t k = 0; k < uv_.size(); ++k) {
    distance.push_back((spots_[k].point - target_.points[k].position).squaredNorm());
    if (target_.points[k].role != PointRole::kSeed) {
      standard.push_back(InMm(uv_[k] - mesh_.rest_uv()[k]).squaredNorm());
    }
  }
  for (const auto& [a, b] : mesh_.edges()) {
    const Vec2 rest = mesh_.rest_uv()[a] - mesh_.rest_uv()[b];
    const double d = RestDistance(a, b);
    bunching.push_back(InMm(uv_[a] - uv_[b] - rest).squaredNorm());
    distortion.push_back(std::pow((spots_[a].point - spots_[b].point).norm() - d, 2));
    crease.push_back(d * d * (spots_[a].normal - spots_[b].normal).squaredNorm());
  }
  return {.distance = SortedMean(distance),
          .bunching = SortedMean(bunching),
          .distortion = SortedMean(distortion),
          .crease = SortedMean(crease),
          .standard = SortedMean(standard)};
}

void MovePoints(const HSplineSurface& surface, const std::vector<Vec2>& uv, FitTarget& target,
                RelaxationSummary& summary) {
  for (std::size_t k = 0; k < uv.size(); ++k) {
    FitPoint& p = target.points[k];
    const double move_mm = (surface.Point(uv[k]) - surface.Point(p.uv)).norm();
    summary.max_move_mm = std::max(summary.max_move_mm, move_mm);
    p.uv = uv[k];
  }
}

std::optional<NetworkMoves> EffectiveMoves(const Relaxation& relaxation) {
  return std::visit(
      []<class R>(const R& chosen) -> std::optional<NetworkMoves> {
        if constexpr (std::is_base_of_v<NetworkMoves, R>) {
          return chosen;
        } else if constexpr (std::is_base_of_v<PointMoves, R>) {
          return NetworkMoves{chosen, /*bunching=*/0, /*distortion=*/0, /*crease=*/0};
        } else {
          return std::nullopt;
        }
      },
      relaxation);
}

DowelMesh MakeNetwork(const HSplineSurface& rest, const FitTarget& target,
                      const NetworkMoves& moves) {
  std::vector<Vec2> uv;
  for (const FitPoint& p : target.points) {
    uv.push_back(p.uv);
  }
  const bool linked =
      moves.barrier || moves.bunching > 0 || moves.distortion > 0 || moves.crease > 0;
  return {rest, uv, linked ? DowelLinks::kDelaunay : DowelLinks::kNone};
}

RelaxationSummary Relax(const HSplineSurface& surface, const HSplineSurface& rest,
                        const DowelMesh& mesh, const NetworkMoves& moves, FitTarget& target,
                        const MeasuredPenalties& measured) {
  Relaxer relaxer(surface, rest, mesh, moves, target);
  RelaxationSummary summary;
  if (measured.before) {
    summary.before = relaxer.Penalties();
  }
  for (int round = 0; round < moves.rounds; ++round) {
    relaxer.Round(summary);
  }
  if (measured.after) {
    summary.after = relaxer.Penalties();
  }
  MovePoints(surface, relaxer.uv(), target, summary);
  return summary;
}

}  // namespace semblance::fitting
