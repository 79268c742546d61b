// SPDX-License-Identifier: GPL-3.0-or-later
// H-spline surfaces as files; the text is that of hspline_json.h.
#pragma once

#include <filesystem>

#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

// Writes a temporary file beside `path` and renames it. Throws IoError, with the path, if that
// fails; `path` is then as it was.
void WriteHSpline(const std::filesystem::path& path, const HSplineSurface& surface);

// The surface of WriteHSpline, to the bit. Throws IoError, with the path, if the file cannot be
// read or holds anything else.
HSplineSurface ReadHSpline(const std::filesystem::path& path);

}  // namespace semblance
