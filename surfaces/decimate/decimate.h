// SPDX-License-Identifier: GPL-3.0-or-later
// Fewer triangles, the same shape.
#pragma once

#include <array>
#include <limits>
#include <string_view>

#include "surfaces/base/geometry.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

struct DecimateOptions {
  int target_triangles = 4;  // collapses stop once so few are left; at least 4
  // No vertex of either mesh lies further from the other than this; > 0. Between its vertices a
  // mesh may be off by a little more.
  double tolerance_mm = std::numeric_limits<double>::infinity();
};

// Why it ended. No sound collapse: each further one would turn a triangle by more than 60 degrees,
// make a needle, change the topology, or move the surface far for the size of its triangles.
enum class DecimateStop { kNotRun, kTarget, kTolerance, kNoSoundCollapse };
constexpr auto EnumNames(DecimateStop) {
  return std::to_array<std::string_view>({"not run", "target", "tolerance", "no sound collapse"});
}

struct DecimateSummary {
  int triangles = -1;      // in the result
  double error_mm = kNaN;  // no vertex of the original mesh lies further from the result
  DecimateStop stop = DecimateStop::kNotRun;
};

struct DecimateResult {
  TriMesh mesh;
  DecimateSummary summary;
};

// Collapses edges, cheapest first. The cost is the squared distance from the planes of the
// triangles that are there now, weighted by area (Garland & Heckbert 1997; memoryless as in
// Lindstrom & Turk 1998). Vertices on a border stay on a border. Without a tolerance the vertices
// that are left then settle among the original ones (original_vertices.h). Components, borders and
// handles stay. Asked for fewer triangles than sound collapses can give, it leaves more, and the
// summary says so. Same input, same bytes. Throws InputError if an option is out of range, the mesh
// is not a consistently oriented manifold or a point is not finite.
DecimateResult Decimate(const TriMesh& mesh, const DecimateOptions& options);

}  // namespace semblance
