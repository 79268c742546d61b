// SPDX-License-Identifier: GPL-3.0-or-later
// How well a fitted surface is known.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "fitting/level/level_fit.h"
#include "fitting/problem/fit_target.h"
#include "fitting/terms/term.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

// Standard deviation in mm, along any direction, of the point of the level's surface at each uv:
// the root of s^T C s, s its stencil and C the inverse of the level's normal matrix in units of the
// points' variance. It is the posterior of a Gaussian model: point i is off by sd_mm[i] along each
// axis, and the other terms are the prior, at the strength that their weights have against the
// points (exact if the points are weighted by 1 / sd^2). Where neither points nor terms say
// anything it is very large. sd_mm: one an observation of the view, > 0. Throws InputError for an
// sd that is not, and for a term with a robust loss or one that couples x, y and z (tangent_points,
// symmetry), whose normal matrix this is not.
std::vector<double> PosteriorSigma(const LevelView& view, std::span<const double> sd_mm,
                                   std::span<const Term> terms, std::span<const Vec2> uv);

// The same for one level of a surface that was fitted to `target` (fit.h), whose finer detail is
// taken as known: give the finest level of the schedule. Where only some of the level's vertices
// are edited (adaptive fits), the surface is taken to move as those and the coarser ones can, no
// more (subspace.h). rest: the placed template.
std::vector<double> PosteriorSigma(const HSplineSurface& surface, const HSplineSurface& rest,
                                   const FitTarget& target, std::span<const double> sd_mm,
                                   int level, std::span<const Term> terms,
                                   std::span<const Vec2> uv);

// Draws from the same model: nets of the level, view.start plus random vectors whose standard
// deviation at each uv is PosteriorSigma's, correlated as the model has it (perturb and solve;
// Papandreou & Yuille 2010). count >= 0; the same draws for the same random_seed. Where neither
// points nor terms say anything they are wild. Throws as PosteriorSigma.
std::vector<ControlNet> PosteriorSamples(const LevelView& view, std::span<const double> sd_mm,
                                         std::span<const Term> terms, int count,
                                         std::uint64_t random_seed);

// Whole surfaces; finer detail rides along.
std::vector<HSplineSurface> PosteriorSamples(const HSplineSurface& surface,
                                             const HSplineSurface& rest, const FitTarget& target,
                                             std::span<const double> sd_mm, int level,
                                             std::span<const Term> terms, int count,
                                             std::uint64_t random_seed);

}  // namespace semblance
