// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/implicit_face.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "surfaces/base/error.h"
#include "surfaces/implicit/project_onto.h"
#include "surfaces/implicit/start_cells.h"
#include "surfaces/implicit/trim_to_border.h"

namespace semblance {
namespace {

// In a grid that is made larger until the surface fits into it.
void PolygonizeOutermost(const TriMesh& shell, std::span<const double> depth_mm,
                         const ImplicitSurface& surface, const ImplicitFaceOptions& options,
                         const RunContext& context, ImplicitFace& face) {
  const ScalarField field = [&surface](const Vec3& p) { return surface.Flattened(p); };
  for (const double margin : {1.6, 3.0, 6.0, 12.0}) {
    const SampleGrid grid = GridAround(shell, surface.MaxDepth_mm(), options.resolution, margin);
    std::vector<StartCell> starts;
    if (!FindStartCells(shell, depth_mm, field, grid, starts)) {
      continue;
    }
    const PolygonizeResult found =
        PolygonizeSurface(options.polygonizer, surface, grid, starts, options.edges, context);
    if (found.touches_border || found.mesh.triangles.empty()) {
      continue;
    }
    face.cell_mm = grid.cell_mm.x();
    face.counts = found.summary;
    face.dense = KeepOutermost(found.mesh, face.dropped_components);
    return;
  }
  throw InputError(
      "implicit face: no closed surface was found around the shell; is it outward, and is the "
      "resolution fine enough for its depths?");
}

void DecimateFace(const ImplicitFaceOptions& options, ImplicitFace& face) {
  DecimateOptions decimate{.target_triangles = options.target_triangles};
  decimate.tolerance_mm = options.tolerance_mm.value_or(decimate.tolerance_mm);
  DecimateResult decimated = Decimate(face.dense, decimate);
  face.mesh = std::move(decimated.mesh);
  face.decimation = decimated.summary;
  if (face.decimation.stop != DecimateStop::kTarget) {
    face.notes.push_back(fmt::format(
        "decimation: {} triangles are left of {} asked for; fewer would {}",
        face.decimation.triangles, options.target_triangles,
        face.decimation.stop == DecimateStop::kTolerance
            ? fmt::format("lie further off than the tolerance, {:.3g} mm", decimate.tolerance_mm)
            : "ruin the shape"));
  }
}

void AppendNotes(const ImplicitFaceOptions& options, std::span<const double> depth_mm,
                 ImplicitFace& face) {
  if (!std::holds_alternative<FlatEmitter>(options.field.emitter) &&
      face.emitters_per_square_depth > 1) {
    face.notes.push_back(fmt::format(
        "emitter density: {:.1f} triangles on a square of the depth; this emitter's surface lies "
        "the further out the denser the mesh (use 'flat' for the exact depth)",
        face.emitters_per_square_depth));
  }
  double thinnest = std::numeric_limits<double>::infinity();
  for (const double depth : depth_mm) {
    thinnest = std::isfinite(depth) ? std::min(thinnest, depth) : thinnest;
  }
  if (face.cell_mm > thinnest) {
    face.notes.push_back(
        fmt::format("resolution: cells of {:.2f} mm are larger than the thinnest tissue, {:.2f} mm",
                    face.cell_mm, thinnest));
  }
}

}  // namespace

TriMesh KeepOutermost(const TriMesh& mesh, int& dropped) {
  if (mesh.triangles.empty()) {
    throw InputError("outermost surface: the mesh has no triangles");
  }
  const Components components = ConnectedComponents(mesh);
  std::vector<double> volume(components.count, 0);
  const Vec3 middle = Bounds(mesh).center();  // of a mesh that is open the volume depends on it
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& c = mesh.triangles[t];
    const Vec3 a = mesh.points[c[0]] - middle, b = mesh.points[c[1]] - middle;
    volume[components.of_triangle[t]] += a.dot(b.cross(mesh.points[c[2]] - middle));
  }
  const int largest =
      static_cast<int>(std::max_element(volume.begin(), volume.end()) - volume.begin());
  std::vector<bool> keep(mesh.triangles.size());
  for (std::size_t t = 0; t < keep.size(); ++t) {
    keep[t] = components.of_triangle[t] == largest;
  }
  dropped = components.count - 1;
  return Submesh(mesh, keep);
}

ImplicitFace BuildImplicitFace(const TriMesh& shell, std::span<const double> depth_mm,
                               const ImplicitFaceOptions& options, const RunContext& context) {
  const ImplicitSurface surface(shell, depth_mm, options.field);
  ImplicitFace face;
  face.emitters = surface.EmitterCount();
  face.emitters_per_square_depth = surface.EmittersPerSquareDepth();
  PolygonizeOutermost(shell, depth_mm, surface, options, context, face);
  if (options.ends == FaceEnds::kOpen) {
    face.dense = TrimToSkull(face.dense, shell, depth_mm, context);
  }
  context.Report("decimate");
  DecimateFace(options, face);
  if (options.project) {
    ProjectOnto(surface, face.cell_mm, context, face.mesh);
  }
  AppendNotes(options, depth_mm, face);
  return face;
}

}  // namespace semblance
