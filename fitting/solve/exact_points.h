// SPDX-License-Identifier: GPL-3.0-or-later
// Exact points as linear equations between the unknowns of a space.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "fitting/least_squares/sparse_factor.h"
#include "fitting/problem/fit_target.h"
#include "fitting/space/hierarchical_spline_space.h"

namespace semblance::fitting {

// The equations of exact points: three for a position, and two more for a normal, which must be
// perpendicular to the tangents along u and v. The space must not be edited while this object is in
// use.
class ExactEquations {
 public:
  ExactEquations(const HierarchicalSplineSpace& space, std::span<const ExactPoint> points);

  // Changes a least-squares step so that the equations C x = d hold after it, at the least increase
  // of the cost:
  //
  //   step - H^-1 C^T (C H^-1 C^T)^-1 (C (x + step) - d),
  //
  // where H is the matrix of the factor and `values` is x, the unknowns before the step. Equations
  // that contradict each other are solved in the least-squares sense.
  Eigen::MatrixX3d ConstrainStep(const SparseFactor& factor, const ControlNet& values,
                                 const Eigen::MatrixX3d& step) const;

  // The miss of each point, mm: the largest absolute residual of its equations. For a tangent this
  // is the component of S_u or S_v along the normal.
  std::vector<double> Misses(const ControlNet& values) const;

 private:
  // A place or a tangent as a linear function of the unknowns, the same for x, y and z.
  struct Functional {
    std::vector<int> rows;  // one may appear twice
    std::vector<double> weights;
    Vec3 fixed = Vec3::Zero();  // contribution of the fixed dofs
  };
  // along . functional = value
  struct Equation {
    int functional = -1;
    Vec3 along = Vec3::Zero();  // unit
    double value = 0;           // mm
    int point = -1;
  };
  Eigen::MatrixXd Rows(Eigen::Index unknowns) const;
  Eigen::VectorXd Forces(const Eigen::MatrixXd& gram, std::span<const Vec3> at) const;
  double Miss(const Equation& equation, std::span<const Vec3> at) const;
  std::vector<Vec3> At(const ControlNet& values) const;  // the value of each functional

  std::vector<Functional> functionals_;
  std::vector<Equation> equations_;
  int points_ = 0;
};

}  // namespace semblance::fitting
