// SPDX-License-Identifier: GPL-3.0-or-later
// report.html of `semblance fit`: one file that needs no other.
#pragma once

#include <string>

#include "problems/points/point_fit.h"

namespace semblance {

// The picture of the surface, in three dimensions and from a fixed side, the points' distances over
// it and as a histogram, where it was refined and how far, and whether a tolerance was met. What is
// drawn is thinned out to a grid, so that the page costs one pass over the points and some tenths
// of a second, and its size does not grow with them. The same result gives the same bytes.
std::string FitPageHtml(const PointFitOptions& options, const PointSource& source,
                        const PointFit& result, int threads);

}  // namespace semblance
