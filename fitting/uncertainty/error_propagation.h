// SPDX-License-Identifier: GPL-3.0-or-later
// The uncertainty of a fit: the propagation of the points' errors, which may be correlated, to the
// surface.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "fitting/problem/fit_target.h"
#include "fitting/terms/term.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance::fitting {

struct PointErrors {
  std::vector<Vec3> directions;  // unit, one per point: the direction of its error
  Eigen::MatrixXd root;  // points x any number; root root^T is the covariance, mm^2 (PivotedRoot)
};

// The error of the surface, as a sum of three independent parts. With the level's normal matrix M =
// A'WA + P, of points and other terms with the weights of the fit, they are
//
//   M^-1 A'W e               the points' errors e;
//   M^-1 P (c - c0)          the bias towards c0, the net that the other terms prefer: the true
//                            net c differs from c0 by a distribution of precision P / prior_sd^2;
//   M^-1 (A'W p + P c0) - c  the steps that the schedule has not taken. They are known, but count
//                            as a deviation.
//
// prior_sd^2 is the cost of the other terms at the solution, per coordinate, divided by the number
// of parameters that the points determine, trace(M^-1 A'WA) (MacKay 1992).
//
// A misfit that a surface with too few vertices leaves is not included: an adaptive fit with a
// tolerance of several times the points' noise may be wrong by more than sigma. If only some of the
// level's vertices are edited (adaptive fits), the net is that of all levels up to it, and M^-1
// acts within the span of their vertices. Points with a robust loss have their weights at the
// solution, and tangent_points count as points. Other terms that couple x, y and z are left out,
// which overestimates the errors.
class ErrorPropagation {
 public:
  // surface: fitted to `target`, whose (u,v) are those at the end of the fit. level: the finest
  // fitted level; finer detail is taken as known. rest: the placed template. Throws InputError for
  // a level that the surface does not have, errors that are not one per point, terms without a
  // weighted term of the points, or a `weight: auto` without a usable solve.
  ErrorPropagation(const HSplineSurface& surface, const HSplineSurface& rest,
                   const FitTarget& target, int level, std::span<const Term> terms,
                   const PointErrors& errors);
  ~ErrorPropagation();
  ErrorPropagation(ErrorPropagation&&) noexcept;

  // Standard deviations in mm along `normals` (unit, one per uv) of the surface's points at uv; NaN
  // where no term determines the surface.
  std::vector<double> Sigma(std::span<const Vec2> uv, std::span<const Vec3> normals) const;

  // Draws surfaces from the same distribution; finer detail moves with them. count >= 0. The same
  // random_seed gives the same draws.
  std::vector<HSplineSurface> Samples(int count, std::uint64_t random_seed) const;

  double prior_sd() const;
  double determined() const;                       // trace(M^-1 A'WA): parameters per coordinate
  std::vector<std::string_view> left_out() const;  // names of the terms that were left out

 private:
  struct Model;
  std::unique_ptr<const Model> model_;
};

// A low-rank root of a covariance, for PointErrors: its Cholesky factor with pivots, cut off once
// the remaining part of every variance is below `share` of the largest variance (Harbrecht, Peters
// & Schneider 2012).
Eigen::MatrixXd PivotedRoot(Eigen::MatrixXd covariance, double share = 1e-3);

}  // namespace semblance::fitting
