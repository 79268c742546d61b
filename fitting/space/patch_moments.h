// SPDX-License-Identifier: GPL-3.0-or-later
// What a patch's points contribute to the normal equations of its sixteen control vertices, in one
// pass over the points.
#pragma once

#include <algorithm>
#include <array>
#include <span>

#include "fitting/least_squares/patch_energy.h"
#include "fitting/space/point_cloud.h"

namespace semblance {

using PatchMatrix = Eigen::Matrix<double, 16, 3>;  // sixteen vertices' x, y, z

// Sums over the points of a patch, in the powers of z = 2 s - 1 and of the same along v.
struct PatchMoments {
  alignas(64) double moments[7][8] = {};  // [q][p]: of w z_u^p z_v^q, p and q up to 6
  // [a + 4 b]: of w z_u^a z_v^b e, e the residual p - S. The fourth lane means nothing.
  alignas(64) double residual[16][4] = {};
  double squares = 0;  // of w |e|^2
  double largest = 0;  // |e|^2, of points whose factor is 0.5 or more

  // All but `moments`, which stay as they are when the surface moves.
  void ForgetResidual() {
    std::fill(&residual[0][0], &residual[0][0] + 64, 0.0);
    squares = largest = 0;
  }
};

// What AddMoments takes and gives per point; each may be null.
struct PointFactors {
  const double* factors = nullptr;  // of the points' weights
  double* squares = nullptr;        // |e|^2
};

// Adds the points of `patch`, whose surface is the bicubic B-spline of `vertices`.
// moments: whether they too are wanted (they do not change with the vertices).
void AddMoments(std::span<const CloudPoint> points, const PatchId& patch,
                const PatchMatrix& vertices, bool moments, const PointFactors& each,
                PatchMoments& sums);

// Sum of w N_k N_l, and of w N_k e, N_k being the weight of vertex k.
Matrix16 GramOfMoments(const PatchMoments& sums);
PatchMatrix ResidualOfMoments(const PatchMoments& sums);

// The same point by point: faster for few points, and where a point's weight is nothing or next to
// nothing the sums are so too. Then sums.residual is of w N_k e, at k, and sums.moments are
// nothing.
void AddPoints(std::span<const CloudPoint> points, const PatchId& patch,
               const PatchMatrix& vertices, const PointFactors& each, PatchMoments& sums);
// factors: of the points' weights, or null.
Matrix16 GramOfPoints(std::span<const CloudPoint> points, const PatchId& patch,
                      const double* factors);
PatchMatrix ResidualOfPoints(const PatchMoments& sums);

// The vertices of the child (right, upper: 0 or 1) of a patch: RefinePatch as a matrix.
const Matrix16& RefinementMatrix(int right, int upper);

}  // namespace semblance
