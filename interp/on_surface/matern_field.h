// SPDX-License-Identifier: GPL-3.0-or-later
// Matern fields on a surface, as solutions of a stochastic differential equation, and their
// correlations between a few points.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <span>
#include <vector>

#include "interp/on_surface/mesh_laplacian.h"
#include "interp/on_surface/mesh_solver.h"
#include "surfaces/base/run_context.h"

namespace semblance::interp {

// The surface on which fields are defined by their values at vertices; a field is linear between
// them.
struct MaternDomain {
  std::vector<Vec3> points;
  MeshLaplacian laplacian;
};

// Makes a domain whose fields have, at vertex i, share[i] times the requested length. This is the
// surface with its metric multiplied by 1 / share^2: areas grow by this factor, and the stiffness,
// which is conformally invariant in two dimensions, stays (Lindgren, Rue & Lindstrom 2011, section
// 3.2). share: one per vertex, > 0.
MaternDomain WithLengths(MaternDomain domain, const Eigen::VectorXd& share);

// kappa, in 1/mm, for a length as defined for kriging: sqrt(2 nu) / length with nu = alpha - 1. On
// a plane this gives the Matern correlation of Rasmussen & Williams (2006, eq. 4.14). For alpha =
// 1, where nu is 0, it is 1 / length.
double MaternKappa(int alpha, double length_mm);

// The field u with (kappa^2 - Laplace)^(alpha/2) u = white noise (Lindgren, Rue & Lindstrom 2011,
// eq. 2 and 10). With the Laplacian's stiffness G, the diagonal matrix C of areas, and K = kappa^2
// C + G, the precision of u at the vertices is K for alpha = 1, K C^-1 K for alpha = 2, and K C^-1
// K C^-1 K for alpha = 3. Open borders have Neumann conditions, which double the variance there.
class MaternField {
 public:
  // Factors K. alpha: 1, 2 or 3; kappa > 0.
  MaternField(const MaternDomain& domain, int alpha, double kappa);

  // Covariances of all vertices with weighted sums of values: one column per column of weights (m x
  // n). Solves alpha times per column on run.threads threads; the result does not depend on their
  // number.
  Eigen::MatrixXd Covariances(const Eigen::MatrixXd& weights, const RunContext& run) const;

  // Variances of vertices and covariances of the ends of each edge, with the sparsity of the
  // stiffness. For alpha = 1 these are selected entries of K^-1. Otherwise they are derivatives of
  // K^-1 with respect to kappa^2, since K^-1 C K^-1 = -dK^-1/dkappa^2, by central differences,
  // accurate to 1e-6 of the variance.
  Eigen::SparseMatrix<double> LocalCovariances() const;

 private:
  const MaternDomain& domain_;
  int alpha_;
  double shift_;  // kappa^2
  MeshSolver solver_;
};

// shift C + G, with shift in 1/mm^2.
Eigen::SparseMatrix<double> ShiftedStiffness(const MeshLaplacian& laplacian, double shift);

struct MaternCorrelations {
  Eigen::MatrixXd value;          // n x n, 1 on the diagonal
  Eigen::MatrixXd by_log_length;  // derivative of value
};

// The correlations of a Matern field between a few points, for every length, so that a likelihood
// search need not factor the mesh again. Let a_i be the points as weights of vertices (columns of
// A). All covariances follow from H(s) = A'(s C + G)^-1 A and its derivatives with respect to s =
// kappa^2. H is computed at some poles s_j. The pencil (G, C) is then approximated in the span of
// all (s_j C + G)^-1 a_i, a rational Krylov space whose Gram matrices are differences of H between
// poles (the Loewner matrices of Antoulas & Anderson 1986). The result is a sum over some hundred
// modes, H(s) ~ B (s + lambda)^-1 B', which agrees with H and its slope at the poles.
class ReducedMatern {
 public:
  // weights: m x n, one column per point. poles: distinct values of s > 0, in 1/mm^2. Per pole it
  // factors once and solves n times. Throws Cancelled if stopped.
  ReducedMatern(const MaternDomain& domain, const Eigen::MatrixXd& weights,
                std::span<const double> poles, const RunContext& run);

  // The correlations for a length: exact at the poles' lengths for alpha 1 and 2. Eight poles over
  // a factor of 150 in length are accurate to 1e-4 between the poles.
  MaternCorrelations At(int alpha, double length_mm) const;

 private:
  Eigen::MatrixXd modes_;   // n x r: B
  Eigen::VectorXd lambda_;  // r, >= 0
};

}  // namespace semblance::interp
