// SPDX-License-Identifier: GPL-3.0-or-later
// The correlations of a Matern field between a few points, for every length at once.
#pragma once

#include <Eigen/Core>
#include <span>

#include "interp/on_surface/matern_field.h"

namespace semblance {

struct MaternCorrelations {
  Eigen::MatrixXd value;          // n x n; 1 on the diagonal
  Eigen::MatrixXd by_log_length;  // its derivative
};

// Let a_i be the points as weights of vertices. All covariances come from H(s) = A'(s C + G)^-1 A
// and its derivatives by s = kappa^2. H is found at some poles s_j, and with it the best
// approximation of the pencil (G, C) in the span of all (s_j C + G)^-1 a_i (a rational Krylov
// space; its Gram matrices are differences of H between poles, the Loewner matrices of Antoulas &
// Anderson 1986). What is left is a sum over some hundred modes, H(s) ~ B (s + lambda)^-1 B', which
// meets H and its slope at the poles. So a likelihood is climbed without factoring the mesh again.
class ReducedMatern {
 public:
  // weights: m x n, one column per point. poles: different values of s, 1/mm^2, > 0. Factors once
  // and solves n times per pole. Throws Cancelled if stopped.
  ReducedMatern(const MaternDomain& domain, const Eigen::MatrixXd& weights,
                std::span<const double> poles, const RunContext& run);

  // At the poles' own lengths of alpha 1 and 2 exact; else as near as the poles are close: eight of
  // them over a factor of 150 in length give it to 1e-4.
  MaternCorrelations At(int alpha, double length_mm) const;

 private:
  Eigen::MatrixXd modes_;   // n x r: B
  Eigen::VectorXd lambda_;  // r, >= 0
};

}  // namespace semblance
