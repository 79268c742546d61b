// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_files/face_export.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <set>
#include <utility>
#include <vector>

#include "surfaces/base/error.h"
#include "surfaces/base/lower_case.h"
#include "surfaces/base/parallel.h"
#include "surfaces/hspline/patch_tree.h"
#include "surfaces/hspline_query/tessellate.h"
#include "surfaces/mesh_files/glb.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "surfaces/mesh_files/vtk_xml.h"

namespace semblance::surfaces {
namespace {

constexpr int kLagrangeQuadrilateral = 70;  // VTK's cell type

// Weights of the control vertices of a uniform cubic B-spline for its points at the parameters 0,
// 1/3, 2/3 and 1 of a patch, along one direction. Four points determine a cubic.
constexpr double kLagrange[4][4] = {{1.0 / 6, 4.0 / 6, 1.0 / 6, 0},
                                    {8.0 / 162, 93.0 / 162, 60.0 / 162, 1.0 / 162},
                                    {1.0 / 162, 60.0 / 162, 93.0 / 162, 8.0 / 162},
                                    {0, 1.0 / 6, 4.0 / 6, 1.0 / 6}};

// VTK's order of the sixteen points a + 4 b: the corners counter-clockwise, the edges (lower,
// right, upper, left, each along growing parameters), and the inner points row by row.
constexpr int kVtkOrder[16] = {0, 3, 15, 12, 1, 2, 7, 11, 13, 14, 4, 8, 5, 6, 9, 10};

std::array<Vec3, 16> PatchPoints(const std::array<Vec3, 16>& vertices) {
  std::array<Vec3, 16> points;
  for (int k = 0; k < 16; ++k) {
    points[k] = Vec3::Zero();
    for (int m = 0; m < 16; ++m) {
      points[k] += kLagrange[k % 4][m % 4] * kLagrange[k / 4][m / 4] * vertices[m];
    }
  }
  return points;
}

// Appends an array in VTK's XML; `value(k)` is the text of entry k.
template <class Value>
void AppendArray(std::string& text, const char* attributes, std::size_t count, const Value& value) {
  fmt::format_to(std::back_inserter(text), "<DataArray {} format=\"ascii\">\n", attributes);
  for (std::size_t k = 0; k < count; ++k) {
    text += value(k);
    text += '\n';
  }
  text += "</DataArray>\n";
}

std::string PatchPointsText(const HSplineSurface& surface, const PatchId& patch) {
  const std::array<Vec3, 16> points = PatchPoints(surface.PatchVertices(patch));
  std::string text;
  for (const int k : kVtkOrder) {
    fmt::format_to(std::back_inserter(text), "{} {} {} ", points[k].x(), points[k].y(),
                   points[k].z());
  }
  return text;
}

std::string ExactBytes(const HSplineSurface& surface, const std::string& extension) {
  if (extension == ".vtu") {
    return SurfaceToVtu(surface);
  }
  return extension == ".step" || extension == ".stp" ? SurfaceToStep(surface)
                                                     : SurfaceToIges(surface);
}

// The surface's curvatures at each vertex; NaN where they do not exist.
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

// 0.1 mm, or 1/5000 of the extent if that is more: a map in metres gets as many triangles as a
// head, which is 0.5 m large.
double DefaultChord(const HSplineSurface& surface) {
  constexpr double kChord_mm = 0.1, kShare = 1.0 / 5000;
  constexpr int kPerPatch = 2;  // the extent need not be exact
  return std::max(kChord_mm,
                  kShare * Bounds(Tessellate(surface, kPerPatch).mesh).diagonal().norm());
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
          fmt::format("export: {} holds the exact surface; remove the chord error of {} mm",
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
  return TriangleBytes(surface, extension, chord_mm.value_or(DefaultChord(surface)), threads);
}

std::string SurfaceToVtu(const HSplineSurface& surface) {
  const PatchTree tree(surface);
  const std::vector<PatchId>& patches = tree.leaves();
  const std::size_t count = patches.size();
  std::string text = fmt::format(
      "<?xml version=\"1.0\"?>\n"
      "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">\n<UnstructuredGrid>\n"
      "<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n<Points>\n",
      16 * count, count);
  AppendArray(text, "type=\"Float64\" NumberOfComponents=\"3\"", count,
              [&](std::size_t k) { return PatchPointsText(surface, patches[k]); });
  text += "</Points>\n<Cells>\n";
  AppendArray(text, "type=\"Int64\" Name=\"connectivity\"", 16 * count,
              [](std::size_t k) { return fmt::format("{}", k); });
  AppendArray(text, "type=\"Int64\" Name=\"offsets\"", count,
              [](std::size_t k) { return fmt::format("{}", 16 * (k + 1)); });
  AppendArray(text, "type=\"UInt8\" Name=\"types\"", count,
              [](std::size_t) { return fmt::format("{}", kLagrangeQuadrilateral); });
  text += "</Cells>\n<CellData>\n";
  AppendArray(text, "type=\"Int32\" Name=\"level\"", count,
              [&](std::size_t k) { return fmt::format("{}", patches[k].level); });
  return text + "</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";
}

std::string TessellationToGlb(const Tessellation& tessellation) {
  const TriMesh& mesh = tessellation.mesh;
  if (mesh.triangles.empty() || tessellation.normals.size() != mesh.points.size()) {
    throw InputError(fmt::format(
        "glTF: {} triangles, {} points and {} normals; at least one triangle and one normal per "
        "point are needed",
        mesh.triangles.size(), mesh.points.size(), tessellation.normals.size()));
  }
  const std::vector<Vec3> of_triangles = VertexNormals(mesh);
  std::vector<Vec3> normals = tessellation.normals;
  for (std::size_t k = 0; k < normals.size(); ++k) {
    normals[k] = normals[k].isZero() ? of_triangles[k] : normals[k];
  }
  const GlbNode face{.name = "face",
                     .parts = {{.material = {.name = "skin", .colour = {0.85, 0.65, 0.54}},
                                .points = mesh.points,
                                .normals = std::move(normals),
                                .triangles = mesh.triangles}}};
  return EncodeGlb({&face, 1});
}

}  // namespace semblance::surfaces
