// SPDX-License-Identifier: GPL-3.0-or-later
// The standard deviation of a surface that was fitted to scattered points, at any place.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "surfaces/base/geometry.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance::fitting {

// Points of a fit, with attributes as columns. The referenced arrays must outlive it.
struct AttributeColumns {
  std::span<const Vec2> uv;                      // in [0,1] x [0,1]
  std::span<const double> weights = {};          // > 0, one per point; empty: all 1
  std::vector<std::span<const double>> columns;  // each with one number per point

  double Weight(std::size_t k) const { return weights.empty() ? 1 : weights[k]; }
};

// A surface with the same vertices and edited offsets, all of them zero, and offsets in world axes.
HSplineSurface EmptyLike(const HSplineSurface& surface);

// The parameters of the fit.
struct SigmaOptions {
  // Standard deviation of a point along one axis; for points with weights the root of the weighted
  // mean square (AutoReport).
  double noise_mm = kNaN;
  double weight = kNaN;      // weight of the thin-plate energy (SmoothnessTerm, length_mm 1), >= 0
  double stretch = 1;        // of the same SmoothnessTerm
  double direction_deg = 0;  // of the same SmoothnessTerm
  Vec2 lengths_mm = Vec2::Constant(kNaN);  // lengths of [0,1] along u and v
  std::span<const Vec2> met = {};          // (u,v) of exact points
};

// The standard deviation along one axis of the minimiser of sum w |e|^2 / sum w + weight * energy:
//
//   sigma(u,v) = noise sqrt(n^T H^-1 n / count),
//
// where H is the normal matrix over the unknowns, n holds their B-splines at (u,v), and count is
// the number of points. These are the Bayesian intervals of Wahba (1983), with smoothness as the
// prior. They include the bias on average over the domain (Nychka 1988), not at each place, and
// grow where points are few. With exact points, given by the equations C, H^-1 is replaced by H^-1
// - H^-1 C^T (C H^-1 C^T)^-1 C H^-1. Not included are detail finer than the vertices, held
// tangents, and errors that neighbouring points share.
class SurfaceSigma {
 public:
  // surface: its vertices are the unknowns. points: those of the fit, without columns. left_out:
  // ascending indices of points without effect. If neither points nor smoothness (weight 0)
  // determine the surface, sigma is about a thousand times as large as elsewhere. Throws InputError
  // for numbers that are not finite, or if no point is left.
  SurfaceSigma(const HSplineSurface& surface, const AttributeColumns& points,
               std::span<const std::uint32_t> left_out, const SigmaOptions& options);
  ~SurfaceSigma();
  SurfaceSigma(SurfaceSigma&&) noexcept;
  SurfaceSigma& operator=(SurfaceSigma&&) noexcept;

  // sigma in mm at each (u,v) in [0,1] x [0,1].
  std::vector<double> At(std::span<const Vec2> uv) const;
  // The number of parameters per coordinate that the points determine: the trace of the influence
  // matrix.
  double degrees_of_freedom() const;
  // The same for a surface whose smoothness and vertices were chosen with its points: sigma times
  // sqrt(count / (count - degrees of freedom)), at most about 7 times sigma. The factor is 1 for
  // many points per parameter. Without it, 90 % intervals held 53 % of the truth for 16 points and
  // 76 % for 30, and with it 69 and 87 % (`fit_bench files` over `kinds_of_points.py`, seeds 41 to
  // 50).
  std::vector<double> OfChosen(std::span<const Vec2> uv) const;

 private:
  struct Model;
  std::unique_ptr<const Model> model_;
};

}  // namespace semblance::fitting
