// SPDX-License-Identifier: GPL-3.0-or-later
// Points that may slide along the surface (TangentPointTerm), summed point by point: all that a
// direct factor needs of them. Ceres gets rows instead (term_cost.h).
#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <vector>

#include "fitting/terms/level_view.h"
#include "fitting/terms/point_terms.h"

namespace semblance {

class TangentSums {
 public:
  // Keeps a reference to the view, whose observations are in the order of SortObservations.
  TangentSums(const TangentPointTerm& term, const LevelView& view);

  // dofs: of an element; normal: 3 x 3 of each pair of them, coordinate c of the k-th at 3 k + c.
  using UseSum = std::function<void(std::span<const int> dofs, const Eigen::MatrixXd& normal)>;
  // J^T J of the points of an element, J being the slopes of the residuals whose squares add up to
  // TermCost. An element of very many points comes several times.
  void ForEachElement(const UseSum& use) const;

  // Calls use(dofs) with those of each element.
  void ForEachDof(const std::function<void(std::span<const int> dofs)>& use) const;

  // Adds -J^T r at the net, coordinate c of dof d at 3 d + c.
  void AddDownhill(const ControlNet& net, Eigen::VectorXd& down) const;

 private:
  // Observations begin .. end - 1, all in one element.
  struct Run {
    int element;
    std::size_t begin, end;
  };

  Eigen::MatrixXd NormalOf(const Run& run, const SplineElement& element) const;
  // -J^T r over the element's sixteen vertices.
  PatchMatrix PullOf(const Run& run, const PatchMatrix& vertices) const;
  Mat3 MetricAt(std::size_t observation) const;  // J^T J of the point where the surface is

  const LevelView& view_;
  double scale_, tangential_;
  std::vector<Run> runs_;      // of all observations, in their order
  std::vector<Vec3> normals_;  // of the surface before the solve, per observation; 0: it has none
};

// The normal of the surface before the solve, unit; 0 where it has none.
Vec3 NormalBefore(const LevelView& view, const Vec2& uv);

}  // namespace semblance
