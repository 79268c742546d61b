// SPDX-License-Identifier: GPL-3.0-or-later
// The penalties that hold the (u,v) of a fit's points, and the moves against them: for every
// relaxation of relaxation.h.
#pragma once

#include <span>
#include <vector>

#include "fitting/relaxation/dowel_mesh.h"
#include "fitting/relaxation/relaxation.h"

namespace semblance {

// A place on the surface, as the penalties see it.
struct SurfaceSample {
  Vec3 point, du, dv, normal;
};

// One corner's penalties, weighted: their sum, and half the gradient and the Gauss-Newton matrix.
struct LocalPenalty {
  double energy = 0;
  Vec2 gradient = Vec2::Zero();
  Eigen::Matrix2d matrix = Eigen::Matrix2d::Zero();

  void Add(double weight, const Vec3& r, const Vec3& ru, const Vec3& rv) {
    Eigen::Matrix<double, 3, 2> j;
    j << ru, rv;
    energy += weight * r.squaredNorm();
    gradient += weight * (j.transpose() * r);
    matrix += weight * (j.transpose() * j);
  }
};

class Relaxer {
 public:
  // Everything but the moves must outlive it.
  Relaxer(const HSplineSurface& surface, const HSplineSurface& rest, const DowelMesh& mesh,
          const NetworkMoves& moves, const FitTarget& target);
  // Moves every corner once: linked ones in the network's order; others have no effect on each
  // other.
  void Round(RelaxationSummary& summary);
  RelaxationPenalties Penalties() const;
  const std::vector<Vec2>& uv() const { return uv_; }
  void SetUv(const std::vector<Vec2>& uv);  // one per point, equal for the points of a corner

  // For fits that move vertices too. The corners by the template's (u,v), which is the network's
  // own order, and their points.
  std::vector<int> Order() const;
  std::span<const int> members(int corner) const {
    return std::span(members_).subspan(first_member_[corner],
                                       first_member_[corner + 1] - first_member_[corner]);
  }
  bool IsKept(int corner) const { return kept_[corner]; }  // PointMoves::kept
  double mean_weight() const { return mean_weight_; }
  // Of a corner where it is, its neighbours held: all penalties but the distance.
  LocalPenalty Held(int corner) const;
  // The resistance of a corner to moves: move . Damping move, move in (u,v).
  Eigen::Matrix2d Damping(int corner) const { return DampingAt(spots_[corner]); }
  // In (u,v), of `max_move_mm` from a corner along u and along v.
  Vec2 LongestMove(int corner) const;

 private:
  void LinkMembers();
  std::vector<int> Corners() const;  // that stand for points, as these are given
  void LinkNeighbours();
  LocalPenalty LocalAt(int corner, const Vec2& uv, const SurfaceSample& spot,
                       double distance) const;
  void AddNeighbour(int corner, int other, const Vec2& uv, const SurfaceSample& spot, double share,
                    LocalPenalty& local) const;
  Eigen::Matrix2d DampingAt(const SurfaceSample& spot) const;
  Vec2 StepOf(const LocalPenalty& local, const SurfaceSample& spot) const;
  Vec2 Inside(const Vec2& uv) const;
  int FlipsWith(int corner, const Vec2& uv);
  void MoveCorner(int corner, RelaxationSummary& summary);
  double RestDistance(int a, int b) const { return (rest_points_[a] - rest_points_[b]).norm(); }
  Vec3 InMm(const Vec2& uv) const {
    return {uv.x() * mesh_.lengths_mm().x(), uv.y() * mesh_.lengths_mm().y(), 0};
  }

  const HSplineSurface& surface_;
  const DowelMesh& mesh_;
  NetworkMoves moves_;
  const FitTarget& target_;
  double mean_weight_ = 1;
  std::vector<Vec2> uv_;
  std::vector<Vec3> rest_points_;  // of linked points
  std::vector<SurfaceSample> spots_;
  std::vector<int> order_;                    // in which the corners move
  std::vector<int> first_member_;             // of a corner, and after the last one the end
  std::vector<int> members_;                  // points, those of a corner together
  std::vector<bool> kept_;                    // corners that do not move
  std::vector<std::vector<int>> neighbours_;  // of a corner
  std::vector<std::vector<int>> around_;      // triangles of a corner
};

// Gives the points their new (u,v), one each, and notes the longest move.
void MovePoints(const HSplineSurface& surface, const std::vector<Vec2>& uv, FitTarget& target,
                RelaxationSummary& summary);

}  // namespace semblance
