// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_files/face_export.h"

#include <fmt/format.h>

#include <set>
#include <utility>
#include <vector>

#include "surfaces/base/error.h"
#include "surfaces/base/lower_case.h"
#include "surfaces/base/parallel.h"
#include "surfaces/hspline_files/cad_export.h"
#include "surfaces/hspline_files/surface_export.h"
#include "surfaces/hspline_query/adaptive_tessellation.h"
#include "surfaces/hspline_query/curvature.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "surfaces/mesh_files/vtk_xml.h"

namespace semblance {
namespace {

std::string ExactBytes(const HSplineSurface& surface, const std::string& extension) {
  if (extension == ".vtu") {
    return SurfaceToVtu(surface);
  }
  return extension == ".step" || extension == ".stp" ? SurfaceToStep(surface)
                                                     : SurfaceToIges(surface);
}

// The curvatures of the surface itself at each vertex; NaN where it has none.
std::vector<VertexScalar> CurvatureScalars(const HSplineSurface& surface,
                                           const std::vector<Vec2>& uv, int threads) {
  std::vector<double> mean(uv.size(), kNaN), gaussian(uv.size(), kNaN);
  ParallelFor(uv.size(), threads, 256, [&](std::size_t v) {
    if (const std::optional<SurfaceCurvature> curvature = CurvatureAt(surface, uv[v])) {
      mean[v] = curvature->MeanPerMm();
      gaussian[v] = curvature->GaussianPerMm2();
    }
  });
  return {{"quality", mean},
          {"scalar_mean_curvature_per_mm", mean},
          {"scalar_gaussian_curvature_per_mm2", gaussian}};
}

std::string TriangleBytes(const HSplineSurface& surface, const std::string& extension,
                          double chord_mm, int threads) {
  Tessellation tessellation = TessellateToChord(surface, chord_mm, threads);
  if (extension == ".glb") {
    return TessellationToGlb(tessellation);
  }
  MeshAttributes attributes;
  if (extension == ".ply" || extension == ".vtp") {
    attributes.scalars = CurvatureScalars(surface, tessellation.uv, threads);
    attributes.normals = std::move(tessellation.normals);
  }
  if (extension == ".vtp") {
    return EncodeVtp(tessellation.mesh, attributes);
  }
  return EncodeMesh(tessellation.mesh, extension, attributes, chord_mm);
}

}  // namespace

std::string EncodeFace(const HSplineSurface& surface, const std::string& given,
                       std::optional<double> chord_mm, int threads) {
  const std::set<std::string> exact = {".vtu", ".step", ".stp", ".iges", ".igs"},
                              triangles = {".glb", ".vtp", ".ply", ".obj", ".off", ".stl"};
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
    throw InputError(fmt::format(
        "export: '{}' is not a known format; the file's name must end in .vtu .step .stp .iges "
        ".igs .glb .vtp .ply .obj .off or .stl",
        given));
  }
  constexpr double kChord_mm = 0.1;
  return TriangleBytes(surface, extension, chord_mm.value_or(kChord_mm), threads);
}

}  // namespace semblance
