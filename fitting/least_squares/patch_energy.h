// SPDX-License-Identifier: GPL-3.0-or-later
// Energies of a uniform bicubic B-spline as exact quadratic forms of its control vertices, and the
// metric in which bending is measured. If a surface hardly bends along one direction, such as a
// ridge along its crest, a metric that makes bending cost more along it and less across it needs
// fewer points to follow the surface.
#pragma once

#include <Eigen/Core>
#include <array>

#include "surfaces/hspline/bspline.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance::fitting {

// The metric M of bending: a surface with the matrix H of second derivatives along (s,t) bends by
// tr((M H)^2). M is symmetric, positive definite and of determinant 1. The identity gives the plain
// thin-plate energy.
using BendingMetric = Eigen::Matrix2d;

// A metric by its stretch: bending along the direction costs stretch^2 times as much, bending
// across it 1 / stretch^2 times.
struct BendingStretch {
  double stretch = 1;        // >= 1
  double direction_deg = 0;  // from s towards t, in [0, 180)
};
BendingMetric MakeBendingMetric(const BendingStretch& stretch);
BendingStretch FindStretch(const BendingMetric& metric);

// The integrals of H_ss^2, H_st^2, H_tt^2, H_ss H_st, H_st H_tt and H_ss H_tt.
using BendingSums = std::array<double, 6>;
// The factors of these integrals in the integral of tr((M H)^2).
BendingSums BendingFactors(const BendingMetric& metric);
// The integral of tr((M H)^2).
double BendingIn(const BendingMetric& metric, const BendingSums& sums);

// The metric in which a surface bends least, among those with a stretch of at most most_stretch.
BendingMetric MetricOfLeastBending(const BendingSums& sums, double most_stretch);
// The metric as far beyond `to` as `to` is from `from`, with a stretch of at most most_stretch.
BendingMetric MetricBeyond(const BendingMetric& from, const BendingMetric& to, double most_stretch);
// The stretch of one metric relative to the other, >= 1.
double StretchBetween(const BendingMetric& one, const BendingMetric& other);

// The grid of patches of one level, and the control vertices that they share.
struct PatchGrid {
  int patches_u = 0;
  int patches_v = 0;
  bool periodic_u = false;

  int Columns() const { return periodic_u ? patches_u : patches_u + 3; }
  int Rows() const { return patches_v + 3; }
  static PatchGrid Of(const HSplineShape& shape, int level);
  // The shape with this grid as its only level, level 0.
  HSplineShape Shape() const;
  // The sixteen vertices of patch (i, j); that at column a, row b of its 4 x 4 has index a + 4 b.
  // A vertex appears several times if the grid is periodic with fewer than 4 patches along u.
  std::array<int, 16> PatchVertices(int i, int j) const;
  // fitting::StencilAt on this grid; the vertices are PatchVertices of the patch at uv.
  Stencil StencilAt(const Vec2& uv, DerivativeOrder order = {}) const;
};

using Matrix16 = Eigen::Matrix<double, 16, 16>;
// A matrix K for which x^T K x is the energy of a patch, for one coordinate x (16) of its vertices.
using ElementStiffness = Matrix16;

// The integral over a patch of size_s x size_t (mm) of tr((M H)^2), which is f_ss^2 + 2 f_st^2 +
// f_tt^2 for the identity metric; rank 13.
ElementStiffness ThinPlateStiffness(double size_s, double size_t,
                                    const BendingMetric& metric = BendingMetric::Identity());
// The patch's BendingSums as forms: the k-th integral is x^T form[k] x for one coordinate x of its
// vertices.
std::array<ElementStiffness, 6> BendingStiffnesses(double size_s, double size_t);
// The integral over a patch of size_s x size_t (mm) of f_s^2 + f_t^2; rank 15.
ElementStiffness MembraneStiffness(double size_s, double size_t);

// R (rank x 16) with R^T R = form, which must be positive semidefinite.
Eigen::MatrixXd StiffnessRoot(const ElementStiffness& form);

// The sum of x^T form x over all patches and the three coordinates.
double StiffnessEnergy(const ElementStiffness& form, const PatchGrid& grid, const ControlNet& net);

// The mean lengths of [0,1] along u and v, mm: the root mean squares of |S_u| and |S_v| over the
// domain. They do not depend on the level at which the surface is written.
Vec2 MeanLengths(const PatchGrid& grid, const ControlNet& net);
// The mean lengths of level 0.
Vec2 MeanLengths(const HSplineSurface& surface);

}  // namespace semblance::fitting
