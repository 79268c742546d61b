// SPDX-License-Identifier: GPL-3.0-or-later
// The implicit face: from a skull's shell and its depths to a closed mesh, in one call.
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

namespace semblance {

// What becomes of the face where the skull ends: it goes around the rim, or ends there too.
enum class FaceEnds { kClosed, kOpen };
constexpr auto EnumNames(FaceEnds) { return std::to_array<std::string_view>({"closed", "open"}); }

struct ImplicitFaceOptions {
  ImplicitOptions field = {};               // what is polygonised
  int resolution = 150;                     // n: cells along the longest side
  Polygonizer polygonizer = NarrowBand{};   // the mesh is the same
  EdgeSearchOptions edges = {};             // how crossings are found
  FaceEnds ends = FaceEnds::kClosed;        // at the rim of the skull
  int target_triangles = 14000;             // more, where fewer would ruin the shape
  std::optional<double> tolerance_mm = {};  // of the decimation; null: no bound
  bool project = false;                     // onto the implicit surface again, after it
};
template <class Visitor>
void Fields(Visitor& visit, ImplicitFaceOptions& o) {
  Fields(visit, o.field);
  visit(FieldInfo{.name = "resolution",
                  .min = 8,
                  .max = 600,
                  .doc = "n: cells along the longest side of the shell with its depth; the "
                         "thesis's runs use 150"},
        o.resolution);
  visit(FieldInfo{.name = "polygonizer",
                  .doc = "how the surface is found in the grid; the mesh is the same"},
        o.polygonizer);
  visit(FieldInfo{.name = "edges", .doc = "how crossings are found"}, o.edges);
  visit(FieldInfo{.name = "ends",
                  .doc = "where the skull ends: closed, the face goes around its rim; open, only "
                         "what lies over bone with a depth is kept, and nothing below a plane "
                         "where the scan was cut off"},
        o.ends);
  visit(
      FieldInfo{.name = "target_triangles",
                .min = 100,
                .max = 10000000,
                .doc = "of the decimated face; the thesis: 14000. More are left where fewer would "
                       "ruin the shape"},
      o.target_triangles);
  visit(FieldInfo{.name = "tolerance_mm",
                  .unit = "mm",
                  .min = 1e-6,
                  .max = 100,
                  .doc = "no collapse that leaves a vertex of the polygons further than this from "
                         "the decimated face: more than target_triangles may be left; null: no "
                         "such bound"},
        o.tolerance_mm);
  visit(FieldInfo{.name = "project",
                  .doc = "lay the decimated face's vertices onto the implicit surface again, which "
                         "decimation leaves by some hundredths of a millimetre"},
        o.project);
}

struct ImplicitFace {
  TriMesh dense;  // as polygonised: manifold, outward, closed or open at the skull's ends
  TriMesh mesh;   // decimated and, if asked for, projected
  double cell_mm = kNaN;
  std::int64_t emitters = -1;
  double emitters_per_square_depth = kNaN;  // see ImplicitSurface
  // Sheets and fragments that were followed and are not the outermost surface: with narrow_band all
  // that there are only where its components are `all`.
  int dropped_components = -1;
  PolygonizeSummary counts;
  DecimateSummary decimation;      // before `project`
  std::vector<std::string> notes;  // what a reader should know, one per line
};

// shell: outward. depth_mm: one per vertex, NaN where it does not emit. Only the outermost surface
// is followed: it is found by going outward from the shell's extreme points, and of the components
// found so the one with the largest volume is kept. Throws InputError as ImplicitSurface does.
ImplicitFace BuildImplicitFace(const TriMesh& shell, std::span<const double> depth_mm,
                               const ImplicitFaceOptions& options, const RunContext& context);

// The component with the largest enclosed volume; `dropped` counts the others. Throws InputError
// for an empty mesh.
TriMesh KeepOutermost(const TriMesh& mesh, int& dropped);

}  // namespace semblance
