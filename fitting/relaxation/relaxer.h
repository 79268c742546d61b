// SPDX-License-Identifier: GPL-3.0-or-later
// The penalties on the (u,v) of a fit's points, and the moves that lower them, for every mode of
// relaxation.h. relaxation.cc states the invariants.
#pragma once

#include <span>
#include <vector>

#include "fitting/relaxation/dowel_mesh.h"
#include "fitting/relaxation/relaxation.h"

namespace semblance::fitting {

// A place on the surface.
struct SurfaceSample {
  Vec3 point, du, dv, normal;
};

// The weighted penalties of one corner: their sum, half of its gradient, and its Gauss-Newton
// matrix.
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
  // All arguments but the moves must outlive the relaxer.
  Relaxer(const HSplineSurface& surface, const HSplineSurface& rest, const DowelMesh& mesh,
          const NetworkMoves& moves, const FitTarget& target);
  // Moves every corner once. Linked corners move in the order of the template's (u,v); corners
  // without links do not affect each other.
  void Round(RelaxationSummary& summary);
  RelaxationPenalties Penalties() const;
  const std::vector<Vec2>& uv() const { return uv_; }
  void SetUv(const std::vector<Vec2>& uv);  // one per point, equal for the points of a corner

  // The following members serve the joint relaxation.

  // The corners, sorted by the template's (u,v).
  std::vector<int> Order() const;
  // The points of a corner.
  std::span<const int> members(int corner) const {
    return std::span(members_).subspan(first_member_[corner],
                                       first_member_[corner + 1] - first_member_[corner]);
  }
  bool IsKept(int corner) const { return kept_[corner]; }  // PointMoves::kept
  double mean_weight() const { return mean_weight_; }
  // All penalties of a corner but the distance, with its neighbours fixed.
  LocalPenalty WithoutDistance(int corner) const;
  // The matrix D of a corner's resistance move . D move to a move in (u,v).
  Eigen::Matrix2d Damping(int corner) const { return DampingAt(spots_[corner]); }
  // The moves in u and in v whose length on the surface is max_move_mm.
  Vec2 LongestMove(int corner) const;

 private:
  void LinkMembers();
  std::vector<int> Corners() const;  // in the points' order
  void LinkNeighbours();
  LocalPenalty LocalAt(int corner, const Vec2& uv, const SurfaceSample& spot,
                       double distance) const;
  void AddNeighbour(int corner, int other, const Vec2& uv, const SurfaceSample& spot, double share,
                    LocalPenalty& local) const;
  Eigen::Matrix2d DampingAt(const SurfaceSample& spot) const;
  Vec2 ComputeStep(const LocalPenalty& local, const SurfaceSample& spot) const;
  Vec2 ClampUv(const Vec2& uv) const;
  int CountFlips(int corner, const Vec2& uv);
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
  std::vector<Vec3> rest_points_;             // template's points; empty without links
  std::vector<SurfaceSample> spots_;          // surface at uv_
  std::vector<int> order_;                    // corners in the order of their moves
  std::vector<int> first_member_;             // per corner, index into members_; and the end
  std::vector<int> members_;                  // points, sorted by corner
  std::vector<bool> kept_;                    // per corner: it does not move
  std::vector<std::vector<int>> neighbours_;  // per corner
  std::vector<std::vector<int>> around_;      // triangles per corner
};

// Sets the points' new (u,v), one each, and raises summary.max_move_mm to the longest move.
void MovePoints(const HSplineSurface& surface, const std::vector<Vec2>& uv, FitTarget& target,
                RelaxationSummary& summary);

}  // namespace semblance::fitting
