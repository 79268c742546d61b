// SPDX-License-Identifier: GPL-3.0-or-later
// How far a fit may be off: how the errors of its points, which may be correlated, propagate to the
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

namespace semblance {

struct PointErrors {
  std::vector<Vec3> directions;  // unit, one per point: along which it may be off
  Eigen::MatrixXd root;          // points x any number; root root^T is the covariance, mm^2
                                 // (pivoted_root.h)
};

// The surface's error is a sum of three, taken as independent. With the level's normal matrix
// M = A'WA + P, of points and other terms at the weights of the fit:
//   M^-1 A'W e, the points' errors e as given;
//   M^-1 P (c - c0), what the other terms hold back: the true net is off the one that they draw to
//     by their own distribution, of the precision P / prior_sd^2;
//   M^-1 (A'W p + P c0) - c, what the schedule has left undone; known, but taken as a deviation.
// What a surface with too few vertices leaves of a misfit is in none of them: an adaptive fit with
// a tolerance of several times the points' noise may be off by more than sigma.
// prior_sd^2 is what the other terms cost at the solution, by coordinate, over the number of
// parameters that the points determine, trace(M^-1 A'WA) (MacKay 1992).
// Where only some of the level's vertices are edited (adaptive fits) the net is that of all levels
// up to it, and M^-1 is within what their vertices can do. Points with a robust loss count with the
// weights that they have at the solution, and tangent_points as points. Terms that couple x, y and
// z otherwise are left out, as if nothing were known of what they say: the errors are then
// overestimated rather than under.
class ErrorPropagation {
 public:
  // surface: fitted to `target`, whose (u,v) are where the fit left them. level: the finest that
  // was fitted; finer detail is taken as known. rest: the placed template. Throws InputError for a
  // level that is not there, errors that are not one per point, or terms of which none with a
  // weight is of the points; and where `weight: auto` cannot be.
  ErrorPropagation(const HSplineSurface& surface, const HSplineSurface& rest,
                   const FitTarget& target, int level, std::span<const Term> terms,
                   const PointErrors& errors);
  ~ErrorPropagation();
  ErrorPropagation(ErrorPropagation&&) noexcept;

  // Standard deviations in mm along `normals` (unit, one per uv) of the surface's points at uv; NaN
  // where no term says anything.
  std::vector<double> Sigma(std::span<const Vec2> uv, std::span<const Vec3> normals) const;

  // Draws from the same distribution; finer detail rides along. count >= 0; the same draws for the
  // same random_seed.
  std::vector<HSplineSurface> Samples(int count, std::uint64_t random_seed) const;

  double prior_sd() const;                         // see above
  double determined() const;                       // trace(M^-1 A'WA): parameters per coordinate
  std::vector<std::string_view> left_out() const;  // names of the terms that were

 private:
  struct Model;
  std::unique_ptr<const Model> model_;
};

}  // namespace semblance
