// SPDX-License-Identifier: GPL-3.0-or-later
// H-splines as JSON, text or file; numbers round-trip to the bit.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

// Throws InputError if a vertex is at no finite place: JSON has no word for that.
void CheckFinite(const HSplineSurface& surface);

// {"format": "semblance-hspline", "version": 1, "patches": [u, v], "max_level": L, "closure": ...,
// "offset_reference": ..., "units": "mm",
//  "level0": [[x, y, z], ...] row by row, "offsets": [[level, i, j, x, y, z], ...] in order}.
// Throws as CheckFinite.
std::string HSplineToJson(const HSplineSurface& surface);

// `name`: what errors call the text, e.g. its file. Throws IoError for anything but what
// HSplineToJson writes: no JSON, another format or version, unknown or missing entries, wrong
// sizes, numbers that are not finite.
HSplineSurface HSplineFromJson(std::string_view text, const std::string& name);

// Writes the text atomically (atomic_file.h). Throws IoError, with the path, if that fails; `path`
// is then as it was.
void WriteHSpline(const std::filesystem::path& path, const HSplineSurface& surface);

// The surface of WriteHSpline, to the bit. Throws IoError, with the path, if the file cannot be
// read or holds anything else.
HSplineSurface ReadHSpline(const std::filesystem::path& path);

}  // namespace semblance
