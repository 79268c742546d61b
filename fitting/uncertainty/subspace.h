// SPDX-License-Identifier: GPL-3.0-or-later
// The directions in which a surface that is finer only in places can move, for what is known of it.
#pragma once

#include <Eigen/Core>
#include <memory>

#include "fitting/least_squares/normal_equations.h"
#include "fitting/least_squares/sparse_factor.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

// What each vertex of level 0 and each edited one of levels 1 .. `level` adds to the net of that
// level: vertices of the level x such vertices, columns coarse to fine. 0 x 0 if that is all nets,
// for every vertex of the level is edited; or if none is, for then the level was not fitted.
SparseMatrix SubspaceBasis(const HSplineSurface& surface, int level);

// Solves normal equations of a level's net (`lower`, the triangle) within a space R as above:
// R (R' M R)^-1 R', or M^-1 if R is 0 x 0.
class SubspaceSolver {
 public:
  SubspaceSolver(const SparseMatrix& lower, SparseMatrix space);
  bool usable() const { return factor_->usable(); }
  Eigen::MatrixXd Solve(const Eigen::MatrixXd& right) const;

 private:
  SparseMatrix space_;
  std::unique_ptr<SparseFactor> factor_;
};

}  // namespace semblance
