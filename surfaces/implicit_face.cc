// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/implicit_face.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"
#include "surfaces/implicit/trim_to_border.h"
#include "surfaces/marching/edge_intersections.h"
#include "surfaces/mesh/solid.h"

namespace semblance::surfaces {
namespace {

// The emitting vertex of the shell that lies furthest along a direction; -1 if none emits.
int ExtremePoint(const TriMesh& shell, std::span<const double> depth_mm, const Vec3& direction) {
  int extreme = -1;
  for (int v = 0; v < static_cast<int>(shell.points.size()); ++v) {
    const bool further =
        extreme < 0 || shell.points[v].dot(direction) > shell.points[extreme].dot(direction);
    extreme = std::isfinite(depth_mm[v]) && further ? v : extreme;
  }
  return extreme;
}

// The grid corner nearest to a point, but not on the grid's border.
GridIndex InnerCorner(const SampleGrid& grid, const Vec3& p) {
  GridIndex at;
  for (int a = 0; a < 3; ++a) {
    at[a] = std::clamp(static_cast<int>(std::lround((p[a] - grid.origin[a]) / grid.cell_mm[a])), 1,
                       grid.counts[a] - 2);
  }
  return at;
}

struct LastCrossing {
  bool leaves_grid = false;
  int lower = -1;  // lower corner, along the axis, of the outermost crossed edge; -1: none
};

// Finds the last sign change of the field along a line of corners, in steps of 1 or -1 along an
// axis.
LastCrossing FindLastCrossing(const ScalarField& field, const SampleGrid& grid, GridIndex at,
                              int axis, int step) {
  LastCrossing last;
  for (; at[axis] > 0 && at[axis] + 1 < grid.counts[axis]; at[axis] += step) {
    const bool inside = field(grid.Corner(at)) > 0;
    if (last.leaves_grid && !inside) {
      last.lower = step > 0 ? at[axis] - 1 : at[axis];
    }
    last.leaves_grid = inside;
  }
  return last;
}

double ThinnestDepth_mm(std::span<const double> depth_mm) {
  double thinnest = std::numeric_limits<double>::infinity();
  for (const double depth : depth_mm) {
    thinnest = std::isfinite(depth) ? std::min(thinnest, depth) : thinnest;
  }
  return thinnest;
}

// The longest side of the shell with its depth.
double FaceExtent_mm(const TriMesh& shell, double depth_mm) {
  return Bounds(shell).sizes().maxCoeff() + 2 * depth_mm;
}

// The polygons cut into bone where cells are larger than 3/4 of the thinnest depth. Over a shell
// without a solid inside they miss the layer of tissue in places that depend on the grid's pose,
// and the face gets holes there. So a coarser resolution is raised, but to the default at most,
// because the cost grows with its square.
int FineEnough(int resolution, double extent_mm, double thinnest_mm) {
  constexpr double kCellOfThinnest = 0.75;
  const int needed =
      static_cast<int>(std::ceil(std::min(extent_mm / (kCellOfThinnest * thinnest_mm),
                                          static_cast<double>(ImplicitFaceOptions().resolution))));
  return std::max(resolution, needed);
}

// Makes a grid of cubic cells: `resolution` cells along the longest side of the shell plus its
// largest depth, and a margin of `margin` times the depth on each side. Shell and grid have the
// same centre, so that a mirrored shell gets the mirrored grid.
SampleGrid GridAround(const TriMesh& shell, double depth_mm, int resolution, double margin) {
  const Box3 box = Bounds(shell);
  SampleGrid grid;
  grid.cell_mm = Vec3::Constant(FaceExtent_mm(shell, depth_mm) / resolution);
  for (int axis = 0; axis < 3; ++axis) {
    const double side_mm = box.sizes()[axis] + 2 * margin * depth_mm;
    grid.counts[axis] = static_cast<int>(std::ceil(side_mm / grid.cell_mm[axis])) + 5;
    grid.origin[axis] = box.center()[axis] - 0.5 * (grid.counts[axis] - 1) * grid.cell_mm[axis];
  }
  return grid;
}

// Goes outward from the six emitting vertices that lie furthest along the axes, and appends the
// cells of the last crossings. Returns false if the field is positive at the grid's border, that is
// if the surface leaves the grid.
bool FindStartCells(const TriMesh& shell, std::span<const double> depth_mm,
                    const ScalarField& field, const SampleGrid& grid,
                    std::vector<StartCell>& starts) {
  constexpr double kOutward = 0.4;  // of the depth; such a point lies inside the surface
  for (int axis = 0; axis < 3; ++axis) {
    for (const int step : {-1, 1}) {
      const Vec3 direction = step * Vec3::Unit(axis);
      const int extreme = ExtremePoint(shell, depth_mm, direction);
      const Vec3 inside = shell.points[extreme] + kOutward * depth_mm[extreme] * direction;
      GridIndex at = InnerCorner(grid, inside);
      const LastCrossing last = FindLastCrossing(field, grid, at, axis, step);
      if (last.leaves_grid) {
        return false;
      }
      if (last.lower >= 0) {
        at[axis] = last.lower;
        starts.push_back({grid.Index(at), EdgeBits(1 << EdgeFrom(0, axis))});
      }
    }
  }
  return true;
}

// Restores the corners of triangles that turned by a right angle or more, until no triangle has.
void RestoreTurned(const TriMesh& before, TriMesh& mesh) {
  bool turned = true;
  while (turned) {
    turned = false;
    for (const Triangle& t : mesh.triangles) {
      if (TriangleAreaVector(mesh, t).dot(TriangleAreaVector(before, t)) <= 0) {
        for (const std::int32_t v : t) {
          turned |= mesh.points[v] != before.points[v];
          mesh.points[v] = before.points[v];
        }
      }
    }
  }
}

// Moves each vertex along its normal onto the surface, by at most reach_mm. A vertex stays if the
// surface is further away, or if a triangle would turn by a right angle or more.
void ProjectOnto(const ImplicitSurface& surface, double reach_mm, const RunContext& context,
                 TriMesh& mesh) {
  const TriMesh before = mesh;
  const std::vector<Vec3> normals = VertexNormals(before);
  ParallelFor(mesh.points.size(), context.threads, 64, [&](std::size_t v) {
    const Vec3& p = before.points[v];
    mesh.points[v] = FindOnLine(surface, p, normals[v], reach_mm).value_or(p);
  });
  RestoreTurned(before, mesh);
}

// Polygonises in ever larger grids until the surface fits.
void PolygonizeOutermost(const TriMesh& shell, std::span<const double> depth_mm,
                         const ImplicitSurface& surface, const ImplicitFaceOptions& options,
                         const RunContext& context, ImplicitFace& face) {
  const ScalarField field = [&surface](const Vec3& p) { return surface.Flattened(p); };
  const double extent_mm = FaceExtent_mm(shell, surface.MaxDepth_mm());
  const double thinnest_mm = ThinnestDepth_mm(depth_mm);
  const int resolution = FineEnough(options.resolution, extent_mm, thinnest_mm);
  if (resolution > options.resolution) {
    face.notes.push_back(fmt::format(
        "resolution: raised from {} to {}; cells of {:.2f} mm would lose parts of the thinnest "
        "tissue, {:.2f} mm",
        options.resolution, resolution, extent_mm / options.resolution, thinnest_mm));
  }
  for (const double margin : {1.6, 3.0, 6.0, 12.0}) {
    const SampleGrid grid = GridAround(shell, surface.MaxDepth_mm(), resolution, margin);
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
      "implicit face: no closed surface was found around the shell; check that its triangles face "
      "outward and that the resolution is fine enough for its depths");
}

void DecimateFace(const ImplicitFaceOptions& options, ImplicitFace& face) {
  DecimateOptions decimate{.target_triangles = options.target_triangles};
  decimate.tolerance_mm = options.tolerance_mm.value_or(decimate.tolerance_mm);
  DecimateResult decimated = Decimate(face.dense, decimate);
  face.mesh = std::move(decimated.mesh);
  face.decimation = decimated.summary;
  if (face.decimation.stop != DecimateStop::kTarget) {
    face.notes.push_back(fmt::format(
        "decimation: {} triangles remain, where {} were requested; fewer would {}",
        face.decimation.triangles, options.target_triangles,
        face.decimation.stop == DecimateStop::kTolerance
            ? fmt::format("deviate by more than the tolerance, {:.3g} mm", decimate.tolerance_mm)
            : "ruin the shape"));
  }
}

void AppendNotes(const ImplicitFaceOptions& options, std::span<const double> depth_mm,
                 ImplicitFace& face) {
  if (!std::holds_alternative<FlatEmitter>(options.field.emitter) &&
      face.emitters_per_square_depth > 1) {
    face.notes.push_back(fmt::format(
        "emitter density: {:.1f} triangles on a square of the depth; this emitter's surface moves "
        "outward as the mesh gets denser (use 'flat' for the exact depth)",
        face.emitters_per_square_depth));
  }
  const double thinnest_mm = ThinnestDepth_mm(depth_mm);
  if (face.cell_mm > thinnest_mm) {
    face.notes.push_back(
        fmt::format("resolution: cells of {:.2f} mm are larger than the thinnest tissue, {:.2f} mm",
                    face.cell_mm, thinnest_mm));
  }
}

}  // namespace

TriMesh KeepOutermost(const TriMesh& mesh, int& dropped) {
  if (mesh.triangles.empty()) {
    throw InputError("outermost surface: the mesh has no triangles");
  }
  const Components components = ConnectedComponents(mesh);
  const std::vector<double> volume = EnclosedVolumes(mesh, components);
  const int largest =
      static_cast<int>(std::max_element(volume.begin(), volume.end()) - volume.begin());
  std::vector<bool> keep(mesh.triangles.size());
  for (std::size_t t = 0; t < keep.size(); ++t) {
    keep[t] = components.of_triangle[t] == largest;
  }
  dropped = components.count - 1;
  return Submesh(mesh, keep);
}

std::optional<Vec3> FindOnLine(const ImplicitSurface& surface, const Vec3& start,
                               const Vec3& direction, double reach_mm) {
  constexpr int kSteps = 8;
  const EdgeSearchOptions search{.method = EdgeSearch::kRegulaFalsi, .tolerance = 1e-3};
  double from = surface.Flattened(start);
  const Vec3 step = (from > 0 ? 1 : -1) * reach_mm / kSteps * direction;
  for (int n = 0; n < kSteps; ++n) {
    const Vec3 at = start + n * step;
    const double to = surface.Flattened(at + step);
    if ((from > 0) != (to > 0)) {
      std::int64_t evaluations = 0;
      const auto field = [&](double t) { return surface.Flattened(at + t * step); };
      return at + SearchCrossing(from, to, search, field, evaluations) * step;
    }
    from = to;
  }
  return std::nullopt;
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

}  // namespace semblance::surfaces
