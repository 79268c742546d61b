// SPDX-License-Identifier: GPL-3.0-or-later
// surface.ply of `semblance fit`: how fine its triangles are, and what they carry.
#pragma once

#include <span>
#include <string>

#include "problems/points/point_fit.h"

namespace semblance {

// Throws InputError for a chord so fine that surface.ply would have too many triangles; says which
// chord would do. Looks only at one finer than `auto` would have it: on a rough surface, fitted to
// some of the points. Before the fit: what could only be refused after it.
void CheckChord(const AutoOr<double>& chord_mm, const HSplineSurface& start,
                const ScatteredPoints& points, const RunContext& context);

// How far a triangle may be from the surface: a chord that is asked for is kept unless there is no
// writing it; `auto` is 1/5000 of the extent, or as much more as keeps the triangles within a
// million or so.
double ChordFor(const HSplineSurface& surface, const AutoOr<double>& chord_mm);

// Binary PLY with normals, and each attribute as a scalar of its name; red, green and blue, 0 to
// 255, together as colours.
std::string SurfacePly(const PointFit& result, double chord_mm, int threads);

}  // namespace semblance
