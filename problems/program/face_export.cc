// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/program/face_export.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <set>

#include "surfaces/base/error.h"
#include "surfaces/hspline_files/cad_export.h"
#include "surfaces/hspline_files/surface_export.h"
#include "surfaces/hspline_query/adaptive_tessellation.h"
#include "surfaces/mesh/mesh_io.h"

namespace semblance {
namespace {

std::string LowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::string ExactBytes(const HSplineSurface& surface, const std::string& extension) {
  if (extension == ".vtu") {
    return SurfaceToVtu(surface);
  }
  return extension == ".step" || extension == ".stp" ? SurfaceToStep(surface)
                                                     : SurfaceToIges(surface);
}

std::string TriangleBytes(Tessellation tessellation, const std::string& extension) {
  if (extension == ".glb") {
    return TessellationToGlb(tessellation);
  }
  const bool has_normals = extension == ".ply";
  return EncodeMesh(
      tessellation.mesh, extension,
      has_normals ? MeshAttributes{std::move(tessellation.normals), {}, {}} : MeshAttributes{});
}

}  // namespace

std::string EncodeFace(const HSplineSurface& surface, const std::string& given,
                       std::optional<double> chord_mm, int threads) {
  const std::set<std::string> exact = {".vtu", ".step", ".stp", ".iges", ".igs"},
                              triangles = {".glb", ".ply", ".obj", ".off", ".stl"};
  const std::string extension = LowerCase(given);
  if (exact.contains(extension)) {
    if (chord_mm) {
      throw InputError(
          fmt::format("export: {} holds the exact surface; leave the chord error of {} mm away",
                      extension, *chord_mm));
    }
    return ExactBytes(surface, extension);
  }
  if (!triangles.contains(extension)) {
    throw InputError(
        fmt::format("export: '{}' is no format; the file's name must end in .vtu .step .stp .iges "
                    ".igs .glb .ply .obj .off or .stl",
                    given));
  }
  constexpr double kChord_mm = 0.1;
  return TriangleBytes(TessellateToChord(surface, chord_mm.value_or(kChord_mm), threads),
                       extension);
}

}  // namespace semblance
