// SPDX-License-Identifier: GPL-3.0-or-later
// A standard deviation for schemes that state none: from how far they missed dowels that they were
// not shown, and how far the next dowel was.
#pragma once

#include <span>

#include "surfaces/base/geometry.h"

namespace semblance {

// sd_mm = scale_mm sqrt(distance / distance_mm), the distance to the nearest dowel, between 0.1 and
// 2 times distance_mm: as of a rough field, whose squared differences grow as the distance does.
struct SdByDistance {
  double scale_mm = kNaN;
  double distance_mm = kNaN;  // mean of the distances that it was learned at

  double At(double to_nearest_mm) const;  // NaN where nothing could be learned
};

// errors_mm: predicted less true; distances_mm: from each to the nearest dowel shown. Pairs with a
// value that is not finite are left out. The scale is such that the half of the errors is within
// 0.674 sd, which a few great ones, at the rim, do not move. NaN of fewer than three.
SdByDistance FitSdByDistance(std::span<const double> errors_mm,
                             std::span<const double> distances_mm);

}  // namespace semblance
