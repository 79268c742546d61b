// SPDX-License-Identifier: GPL-3.0-or-later
// H-splines as text: JSON whose numbers round-trip to the bit.
#pragma once

#include <string>
#include <string_view>

#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

// {"format": "semblance-hspline", "version": 1, "patches": [u, v], "max_level": L, "closure": ...,
// "offset_reference": ..., "units": "mm",
//  "level0": [[x, y, z], ...] row by row, "offsets": [[level, i, j, x, y, z], ...] in order}.
std::string HSplineToJson(const HSplineSurface& surface);

// `name`: what errors call the text, e.g. its file. Throws IoError for anything else than what
// HSplineToJson writes: no JSON, another format or version, unknown or missing entries, wrong
// sizes, numbers that are not finite.
HSplineSurface HSplineFromJson(std::string_view text, const std::string& name);

}  // namespace semblance
