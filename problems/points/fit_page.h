// SPDX-License-Identifier: GPL-3.0-or-later
// report.html of `semblance fit`.
#pragma once

#include <string>

#include "problems/points/point_fit.h"

namespace semblance::problems {

// Returns a page with the surface in a 3-D view and as a picture, the points' distances over it and
// as a histogram, its refinement, and whether a tolerance was met. The pictures show a grid of the
// surface, so the page costs one pass over the points and some tenths of a second, and its size
// does not grow with their number. The same result gives the same bytes.
std::string FitPageHtml(const PointFitOptions& options, const PointSource& source,
                        const PointFit& result, int threads);

}  // namespace semblance::problems
