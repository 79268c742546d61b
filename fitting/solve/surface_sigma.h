// SPDX-License-Identifier: GPL-3.0-or-later
// How far a surface that was fitted to scattered points may be off, place by place.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "fitting/solve/attribute_fit.h"
#include "surfaces/base/geometry.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

// What a fit was made of, and what it has found.
struct SigmaOptions {
  double noise_mm = kNaN;    // standard deviation of a point along one axis; of points with weights
                             // the root of their weighted mean square (AutoReport)
  double weight = kNaN;      // of the thin-plate energy (SmoothnessTerm, length_mm 1), > 0 or 0
  double stretch = 1;        // likewise
  double direction_deg = 0;  // likewise
  Vec2 lengths_mm = Vec2::Constant(kNaN);  // what [0,1] stands for along u and v
  std::span<const Vec2> met = {};          // where the surface is held to exact points
};

// The standard deviation along one axis of the penalised least squares sum w |e|^2 / sum w + weight
// * energy, at (u,v): noise sqrt(n^T H^-1 n / count), H being its normal matrix over the unknowns
// and n their functions at (u,v). These are the Bayesian intervals of Wahba (1983): smoothness is
// what is known before of the surface, so that they hold its bias too, on the mean over the domain
// (Nychka 1988) rather than at each place, and grow where points are few. Where the surface is
// held, by the equations C, H^-1 becomes H^-1 - H^-1 C^T (C H^-1 C^T)^-1 C H^-1. They know nothing
// of detail finer than the vertices, of tangents that are held, nor of errors that neighbours
// share.
class SurfaceSigma {
 public:
  // surface: its vertices are the unknowns. points: those of the fit, without columns. left_out:
  // indices of points that do not count, ascending. Where neither points nor smoothness (a weight
  // of 0) determine the surface, sigma is some thousand times as large as elsewhere. Throws
  // InputError for numbers that are not finite, and no point that counts.
  SurfaceSigma(const HSplineSurface& surface, const AttributeColumns& points,
               std::span<const std::uint32_t> left_out, const SigmaOptions& options);
  ~SurfaceSigma();
  SurfaceSigma(SurfaceSigma&&) noexcept;
  SurfaceSigma& operator=(SurfaceSigma&&) noexcept;

  // mm; one per (u,v), each in [0,1] x [0,1].
  std::vector<double> At(std::span<const Vec2> uv) const;
  // Parameters per coordinate that the points determine: the trace of the influence matrix.
  double degrees_of_freedom() const;

 private:
  struct Model;
  std::unique_ptr<const Model> model_;
};

}  // namespace semblance
