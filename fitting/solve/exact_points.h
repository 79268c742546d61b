// SPDX-License-Identifier: GPL-3.0-or-later
// Places that a surface meets exactly, as linear equations between its unknowns.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "fitting/least_squares/sparse_factor.h"
#include "fitting/problem/fit_target.h"
#include "fitting/space/hierarchical_spline_space.h"

namespace semblance {

// Three equations for a position, and two more for a normal: the tangents along u and v are across
// it. The space must not be edited while they are asked.
class ExactEquations {
 public:
  ExactEquations(const HierarchicalSplineSpace& space, std::span<const ExactPoint> points);

  // A step of least squares, changed so that the equations hold after it and the cost grows least:
  // with the step's own matrix H (of the factor), step - H^-1 C^T (C H^-1 C^T)^-1 (C (x + step) -
  // d). What cannot hold holds as nearly as it can.
  //   values: x, the unknowns before the step.
  Eigen::MatrixX3d Bend(const SparseFactor& factor, const ControlNet& values,
                        const Eigen::MatrixX3d& step) const;

  // Of each point, how far the unknowns are from holding: the distance and the slope against its
  // normal (of [0,1] along u and v, mm), whichever is more.
  std::vector<double> MissesOf(const ControlNet& values) const;

 private:
  // What is linear in the unknowns, the same along x, y and z: the place, or a tangent.
  struct Functional {
    std::vector<int> rows;  // one may appear twice
    std::vector<double> weights;
    Vec3 fixed = Vec3::Zero();  // of what does not take part
  };
  struct Equation {
    int functional = -1;
    Vec3 along = Vec3::Zero();  // unit
    double value = 0;           // along it, mm
    int point = -1;
  };
  Eigen::MatrixXd Rows(Eigen::Index unknowns) const;
  Eigen::VectorXd Forces(const Eigen::MatrixXd& gram, std::span<const Vec3> at) const;
  double MissOf(const Equation& equation, std::span<const Vec3> at) const;
  std::vector<Vec3> At(const ControlNet& values) const;  // of each functional

  std::vector<Functional> functionals_;
  std::vector<Equation> equations_;
  int points_ = 0;
};

}  // namespace semblance
