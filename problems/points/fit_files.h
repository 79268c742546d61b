// SPDX-License-Identifier: GPL-3.0-or-later
// The data files of `semblance fit`: the surface as triangles, and the residuals of the points.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "problems/points/point_fit.h"

namespace semblance::problems {

// The chord in the coordinates of a fit whose heights were multiplied by `factor`.
inline AutoOr<double> InUnitsOfFit(AutoOr<double> chord_mm, double factor) {
  chord_mm.value *= factor;
  return chord_mm;
}

// Throws InputError, naming a chord that would do, for a chord so fine that surface.ply would have
// too many triangles. It looks only at a chord finer than `auto`, on a rough surface that is fitted
// to some of the points. So what could only be refused after the fit is refused before it.
void CheckChord(const AutoOr<double>& chord_mm, const HSplineSurface& start,
                const ScatteredPoints& points, const RunContext& context);

// Chooses the largest distance of a triangle from the surface. A given chord is kept unless
// surface.ply could not be written; `auto` is 1/5000 of the extent, or as much more as keeps the
// number of triangles at about a million. For heights over x and y the chord is along z.
double ChooseChord(const PointFit& result, const AutoOr<double>& chord_mm);

// Encodes surface.ply: binary, with normals and with each attribute as a scalar of its name. The
// attributes red, green and blue, if they range from 0 to 255, become colours.
std::string SurfacePly(const PointFit& result, double chord_mm, int threads);

// Columns of the residuals' file, one number per point.
struct ResidualColumns {
  const FitResult& fit;
  const std::vector<PointAttribute>& attributes;   // as given
  const std::vector<std::vector<double>>& fitted;  // each attribute, at the points
  const std::vector<double>& sigma_mm;             // of the surface at the points, or empty
  std::span<const double> weights = {};            // of the points, or empty
};

// Encodes one line per point, in the order of the table: its number, (u,v) and distance; 1 for an
// outlier if the fit looks for outliers; the weight if weights differ; sigma_mm if it is known; and
// for each attribute the fitted value, and the given value less the fitted one.
std::string ResidualsCsv(const ResidualColumns& columns);

// Encodes the same as binary PLY: vertices at (u, v, 0) with the scalars residual_mm, outlier,
// sigma_mm, NAME and NAME_residual as floats.
std::string ResidualsPly(const ResidualColumns& columns);

}  // namespace semblance::problems
