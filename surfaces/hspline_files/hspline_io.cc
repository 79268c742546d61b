// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_files/hspline_io.h"

#include "surfaces/base/atomic_file.h"
#include "surfaces/hspline_files/hspline_json.h"

namespace semblance {

void WriteHSpline(const std::filesystem::path& path, const HSplineSurface& surface) {
  WriteFileAtomically(path, HSplineToJson(surface));
}

HSplineSurface ReadHSpline(const std::filesystem::path& path) {
  return HSplineFromJson(ReadFileBytes(path), path.string());
}

}  // namespace semblance
