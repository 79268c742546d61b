// SPDX-License-Identifier: GPL-3.0-or-later
// The build without OpenCASCADE. CMake compiles either this file or cad_export.cc, so that neither
// needs conditional code.
#include "surfaces/base/error.h"
#include "surfaces/hspline_files/face_export.h"

namespace semblance::surfaces {
namespace {

std::string Refuse(const char* format) {
  throw InputError(
      std::string(format) +
      ": this build cannot write this format; install libocct-data-exchange-dev, then configure "
      "with -DSEMBLANCE_WITH_CAD=ON and build again");
}

}  // namespace

bool HasCad() { return false; }

std::string SurfaceToStep(const HSplineSurface&) { return Refuse("STEP"); }

std::string SurfaceToIges(const HSplineSurface&) { return Refuse("IGES"); }

}  // namespace semblance::surfaces
