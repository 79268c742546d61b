// SPDX-License-Identifier: GPL-3.0-or-later
// The contributions of a patch's points to the normal equations of its sixteen control vertices, in
// one pass over the points. Products of cubics are polynomials of degree 6, so 7 x 7 moments of the
// points replace 16 x 16 products per point.
#pragma once

#include <algorithm>
#include <array>
#include <span>

#include "fitting/least_squares/patch_energy.h"
#include "fitting/space/point_cloud.h"

namespace semblance::fitting {

using PatchMatrix = Eigen::Matrix<double, 16, 3>;  // sixteen vertices' x, y, z

// Sums over the points of a patch, in powers of z_u = 2 s - 1 and z_v = 2 t - 1, where (s,t) in
// [0,1]^2 is the place in the patch.
struct PatchMoments {
  alignas(64) double moments[7][8] = {};  // [q][p]: sum of w z_u^p z_v^q, p and q up to 6
  // [a + 4 b]: sum of w z_u^a z_v^b e, where e = p - S is the residual. The fourth lane is unused.
  alignas(64) double residual[16][4] = {};
  double squares = 0;  // sum of w |e|^2
  double largest = 0;  // largest |e|^2 of points with a factor of at least 0.5

  // Clears all sums but `moments`, which do not depend on the surface.
  void ForgetResidual() {
    std::fill(&residual[0][0], &residual[0][0] + 64, 0.0);
    squares = largest = 0;
  }
};

// Inputs and outputs per point; each may be null.
struct PointFactors {
  const double* factors = nullptr;  // multiply the points' weights
  double* squares = nullptr;        // receives |e|^2
};

// Adds the points of `patch`, whose surface is the bicubic B-spline of `vertices`. moments: whether
// to add to sums.moments too.
void AddMoments(std::span<const CloudPoint> points, const PatchId& patch,
                const PatchMatrix& vertices, bool moments, const PointFactors& each,
                PatchMoments& sums);

// The sums of w N_k N_l, and of w N_k e, where N_k is the B-spline of vertex k.
Matrix16 GramOfMoments(const PatchMoments& sums);
PatchMatrix ResidualOfMoments(const PatchMoments& sums);

// Computes the same sums point by point. This is faster for few points, and a point with a tiny
// weight contributes tiny terms without round-off. sums.residual then holds the sum of w N_k e at
// k, and sums.moments stays empty.
void AddPoints(std::span<const CloudPoint> points, const PatchId& patch,
               const PatchMatrix& vertices, const PointFactors& each, PatchMoments& sums);
// factors: multiply the points' weights; null: all 1.
Matrix16 GramOfPoints(std::span<const CloudPoint> points, const PatchId& patch,
                      const double* factors);
PatchMatrix ResidualOfPoints(const PatchMoments& sums);

// The matrix that maps a patch's vertices to those of its child (right, upper: 0 or 1); see
// RefinePatch.
const Matrix16& RefinementMatrix(int right, int upper);

}  // namespace semblance::fitting
