// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_io.h"

#include "surfaces/hspline_json.h"
#include "surfaces/whole_file.h"

namespace semblance {

void WriteHSpline(const std::filesystem::path& path, const HSplineSurface& surface) {
  WriteFileAtomically(path, HSplineToJson(surface));
}

HSplineSurface ReadHSpline(const std::filesystem::path& path) {
  return HSplineFromJson(ReadFileBytes(path), path.string());
}

}  // namespace semblance
