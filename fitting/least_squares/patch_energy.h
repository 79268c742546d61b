// SPDX-License-Identifier: GPL-3.0-or-later
// Energies of a uniform bicubic B-spline as exact quadratic forms of its control vertices.
#pragma once

#include <Eigen/Core>
#include <array>

#include "fitting/least_squares/bending_metric.h"
#include "surfaces/hspline/bspline.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

// How the patches of one level share its control vertices. The domain is patches_u x patches_v.
struct PatchGrid {
  int patches_u = 0;
  int patches_v = 0;
  bool periodic_u = false;
  bool periodic_v = false;

  int Columns() const { return periodic_u ? patches_u : patches_u + 3; }
  int Rows() const { return periodic_v ? patches_v : patches_v + 3; }
  static PatchGrid Of(const HSplineShape& shape, int level);
  HSplineShape Shape() const;  // with this as level 0, and no other; periodic in u if it is in v
  // The sixteen vertices of patch (i, j), the one at column a, row b of its 4 x 4 at a + 4 b. Along
  // a periodic direction a vertex stands several times if there are fewer than 4 patches.
  std::array<int, 16> PatchVertices(int i, int j) const;
  // semblance::StencilAt on this net; its vertices are PatchVertices of the patch at uv.
  Stencil StencilAt(const Vec2& uv, DerivativeOrder order = {}) const;
};

using Matrix16 = Eigen::Matrix<double, 16, 16>;
// x^T stiffness x is the energy of one patch for one coordinate x (16) of its vertices.
using ElementStiffness = Matrix16;

// Integral over a patch of size_s x size_t (mm) of f_ss^2 + 2 f_st^2 + f_tt^2; rank 13. With
// another metric M than the plane's own of tr((M H)^2), H being the matrix of second derivatives.
ElementStiffness ThinPlateStiffness(double size_s, double size_t,
                                    const BendingMetric& metric = BendingMetric::Identity());
// The patch's BendingSums: for one coordinate x of its vertices the k-th is x^T form[k] x.
std::array<ElementStiffness, 6> BendingStiffnesses(double size_s, double size_t);
// Integral over a patch of size_s x size_t (mm) of f_s^2 + f_t^2; rank 15.
ElementStiffness MembraneStiffness(double size_s, double size_t);

// R (rank x 16) with R^T R = form, which must be positive semidefinite.
Eigen::MatrixXd StiffnessRoot(const ElementStiffness& form);

// Sum over all patches and the three coordinates of x^T form x.
double StiffnessEnergy(const ElementStiffness& form, const PatchGrid& grid, const ControlNet& net);

// The lengths in mm that [0,1] stands for along u and v: root mean square over the domain of |S_u|
// and of |S_v|. The same whatever level the surface is written at.
Vec2 MeanLengths(const PatchGrid& grid, const ControlNet& net);
// Of level 0, which is that of all levels without detail.
Vec2 MeanLengths(const HSplineSurface& surface);

}  // namespace semblance
