// SPDX-License-Identifier: GPL-3.0-or-later
// The first (implicit) face: builds a closed mesh from a skull's shell and its tissue depths.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "surfaces/base/run_context.h"
#include "surfaces/decimate/decimate.h"
#include "surfaces/emitters/implicit_surface.h"
#include "surfaces/implicit/polygonizer.h"

namespace semblance::surfaces {

// The face at the border of the skull: it goes around the rim, or it ends there too.
enum class FaceEnds { kClosed, kOpen };
constexpr auto EnumNames(FaceEnds) { return std::to_array<std::string_view>({"closed", "open"}); }

struct ImplicitFaceOptions {
  ImplicitOptions field = {};
  int resolution = 150;
  Polygonizer polygonizer = NarrowBand{};
  EdgeSearchOptions edges = {};
  FaceEnds ends = FaceEnds::kClosed;
  int target_triangles = 14000;
  std::optional<double> tolerance_mm = {};
  bool project = false;
};
template <class Visitor>
void Fields(Visitor& visit, ImplicitFaceOptions& o) {
  Fields(visit, o.field);
  visit(FieldInfo{.name = "resolution",
                  .min = 8,
                  .max = 600,
                  .doc = "n: cells along the longest side of the shell with its depth; the "
                         "thesis's runs use 150. It is raised, to 150 at most, where cells would "
                         "be larger than 3/4 of the thinnest tissue"},
        o.resolution);
  visit(
      FieldInfo{.name = "polygonizer",
                .doc = "method that finds the surface in the grid; the mesh does not depend on it"},
      o.polygonizer);
  visit(FieldInfo{.name = "edges", .doc = "search for the surface on cell edges"}, o.edges);
  visit(FieldInfo{.name = "ends",
                  .doc = "at the border of the skull: closed, the face goes around the rim; open, "
                         "only the part over bone with a depth is kept, and nothing below the "
                         "plane of an incomplete scan"},
        o.ends);
  visit(FieldInfo{.name = "target_triangles",
                  .min = 100,
                  .max = 10000000,
                  .doc = "size of the decimated face (thesis: 14000); more remain if fewer would "
                         "ruin the shape"},
        o.target_triangles);
  visit(FieldInfo{.name = "tolerance_mm",
                  .unit = "mm",
                  .min = 1e-6,
                  .max = 100,
                  .doc = "largest distance of a polygonised vertex from the decimated face; more "
                         "than target_triangles may remain; null: no bound"},
        o.tolerance_mm);
  visit(FieldInfo{.name = "project",
                  .doc = "move the decimated face's vertices back onto the implicit surface, which "
                         "decimation leaves by some hundredths of a millimetre"},
        o.project);
}

struct ImplicitFace {
  TriMesh dense;  // before decimation: manifold, outward, closed or open at the skull's border
  TriMesh mesh;   // decimated and, if requested, projected
  double cell_mm = kNaN;
  std::int64_t emitters = -1;
  double emitters_per_square_depth = kNaN;  // ImplicitSurface::EmittersPerSquareDepth
  // Number of followed sheets and fragments that are not the outermost surface. With narrow_band it
  // counts all of them only if `components` is `all`.
  int dropped_components = -1;
  PolygonizeSummary counts;
  DecimateSummary decimation;      // before `project`
  std::vector<std::string> notes;  // hints for the user, one per line
};

// Builds the face. shell: with outward triangles. depth_mm: one per vertex, NaN where nothing
// emits. The surface is followed from the points where it is crossed last on the way outward from
// the shell's extreme points; of the components found, the one with the largest volume is kept.
// Throws InputError as ImplicitSurface does, or if no closed surface is found.
ImplicitFace BuildImplicitFace(const TriMesh& shell, std::span<const double> depth_mm,
                               const ImplicitFaceOptions& options, const RunContext& context);

// The point nearest to `start` on the line along `direction` (a unit vector) in which the line
// meets the surface within reach_mm. Searches along the direction if `start` is inside, else
// against it.
std::optional<Vec3> FindOnLine(const ImplicitSurface& surface, const Vec3& start,
                               const Vec3& direction, double reach_mm);

// Returns the component with the largest enclosed volume and counts the others in `dropped`. Throws
// InputError for an empty mesh.
TriMesh KeepOutermost(const TriMesh& mesh, int& dropped);

}  // namespace semblance::surfaces
