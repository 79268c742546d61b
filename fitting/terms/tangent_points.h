// SPDX-License-Identifier: GPL-3.0-or-later
// Normal equations of TangentPointTerm, summed point by point for a direct factor. Ceres gets rows
// instead (term_cost.h).
#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <vector>

#include "fitting/terms/level_view.h"
#include "fitting/terms/term.h"

namespace semblance::fitting {

class TangentSums {
 public:
  // Keeps a reference to the view. Its observations must be in the order of SortObservations.
  TangentSums(const TangentPointTerm& term, const LevelView& view);

  // Receives the dofs of an element and its matrix J^T J, with coordinate c of the k-th dof at row
  // 3 k + c.
  using UseSum = std::function<void(std::span<const int> dofs, const Eigen::MatrixXd& normal)>;
  // Calls `use` with J^T J of the points of each element. J is the Jacobian of residuals whose
  // squares add up to TermCost. An element with more points than a run holds appears several times.
  void ForEachElement(const UseSum& use) const;

  // Calls `use` with the dofs of each element.
  void ForEachDof(const std::function<void(std::span<const int> dofs)>& use) const;

  // Adds the downhill direction -J^T r at the net, coordinate c of dof d at row 3 d + c.
  void AddDownhill(const ControlNet& net, Eigen::VectorXd& down) const;

 private:
  // Observations begin .. end - 1, which lie in one element.
  struct Run {
    int element;
    std::size_t begin, end;
  };

  Eigen::MatrixXd RunNormalMatrix(const Run& run, const SplineElement& element) const;
  // -J^T r over the element's sixteen vertices.
  PatchMatrix RunDownhill(const Run& run, const PatchMatrix& vertices) const;
  Mat3 MetricAt(std::size_t observation) const;  // J^T J over the surface's point

  const LevelView& view_;
  double scale_, tangential_;
  std::vector<Run> runs_;      // all observations, in their order
  std::vector<Vec3> normals_;  // surface before the solve, per observation; 0: no normal
};

// The unit normal of the surface before the solve; 0 where it has none.
Vec3 NormalBefore(const LevelView& view, const Vec2& uv);

}  // namespace semblance::fitting
