// SPDX-License-Identifier: GPL-3.0-or-later
// Matern fields on a surface, as the solution of a stochastic differential equation.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <vector>

#include "interp/on_surface/mesh_laplacian.h"
#include "interp/on_surface/mesh_solver.h"
#include "surfaces/base/run_context.h"

namespace semblance {

// The surface that fields live on. Its vertices' values are the field; between them it is linear.
struct MaternDomain {
  std::vector<Vec3> points;
  MeshLaplacian laplacian;
};

// The domain whose fields have, at vertex i, share[i] times the length that they are asked for: as
// on the surface under a metric that is 1 / share^2 times its own, where areas grow by that and the
// stiffness, which is conformally invariant in two dimensions, stays (Lindgren, Rue & Lindstrom
// 2011, section 3.2). share: one per vertex, > 0.
MaternDomain WithLengths(MaternDomain domain, const Eigen::VectorXd& share);

// kappa, 1/mm, of a length as kriging's: sqrt(2 nu) / length with nu = alpha - 1, by which the
// Matern correlation of a plane is that of Rasmussen & Williams (2006, eq. 4.14). For alpha = 1,
// where nu is 0: 1 / length.
double MaternKappa(int alpha, double length_mm);

// u with (kappa^2 - Laplace)^(alpha/2) u = white noise (Lindgren, Rue & Lindstrom 2011, eq. 2 and
// 10): let G be the Laplacian's stiffness, C the diagonal of its areas and K = kappa^2 C + G; the
// precision of u at the vertices is K for alpha = 1, K C^-1 K for 2, K C^-1 K C^-1 K for 3. Open
// borders are free (Neumann): what would leave is reflected, so that the variance doubles there.
class MaternField {
 public:
  // alpha: 1, 2 or 3; kappa > 0. Factors once.
  MaternField(const MaternDomain& domain, int alpha, double kappa);

  // Covariances of all vertices with sums of values: one column per column of weights (m x n).
  // Solves alpha times per column, on run.threads threads; the result does not depend on them.
  Eigen::MatrixXd Covariances(const Eigen::MatrixXd& weights, const RunContext& run) const;

  // Covariances between a vertex and itself and between the ends of each edge: entries where the
  // stiffness has some. For alpha = 1 selected entries of K^-1; else its derivatives by kappa^2, as
  // K^-1 C K^-1 = -dK^-1/dkappa^2, by central differences: to 1e-6 of the variance.
  Eigen::SparseMatrix<double> LocalCovariances() const;

 private:
  const MaternDomain& domain_;
  int alpha_;
  double shift_;  // kappa^2
  MeshSolver solver_;
};

// shift C + G, shift in 1/mm^2.
Eigen::SparseMatrix<double> ShiftedStiffness(const MeshLaplacian& laplacian, double shift);

}  // namespace semblance
