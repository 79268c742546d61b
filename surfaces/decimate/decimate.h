// SPDX-License-Identifier: GPL-3.0-or-later
// Decimation: fewer triangles for the same shape.
#pragma once

#include <array>
#include <limits>
#include <string_view>

#include "surfaces/base/geometry.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::surfaces {

struct DecimateOptions {
  int target_triangles = 4;  // collapses stop at this number; at least 4
  // The largest distance of a vertex of either mesh from the other mesh; > 0. Between the vertices
  // the distance may be a little larger.
  double tolerance_mm = std::numeric_limits<double>::infinity();
};

// Why the collapses ended. "No sound collapse": every further collapse would turn a triangle by
// more than 60 degrees, make a needle, change the topology, or move the surface far compared with
// the size of its triangles.
enum class DecimateStop { kNotRun, kTarget, kTolerance, kNoSoundCollapse };
constexpr auto EnumNames(DecimateStop) {
  return std::to_array<std::string_view>({"not run", "target", "tolerance", "no sound collapse"});
}

struct DecimateSummary {
  int triangles = -1;  // in the result
  // An upper bound on the distance of an original vertex from the result.
  double error_mm = kNaN;
  DecimateStop stop = DecimateStop::kNotRun;
};

struct DecimateResult {
  TriMesh mesh;
  DecimateSummary summary;
};

// Collapses edges, the cheapest first. The cost is the squared distance from the planes of the
// current triangles, weighted by area (Garland & Heckbert 1997; without memory of earlier
// triangles, as in Lindstrom & Turk 1998). Components, borders and handles are preserved, and
// border vertices stay on their border. If sound collapses cannot reach the target, more triangles
// remain and the summary tells why. Without a tolerance the remaining vertices finally settle among
// the original ones (original_vertices.h). The result does not depend on threads or addresses.
//
// The mesh need not be a manifold: it is cut apart as half_edge_mesh.h describes, the vertices at
// the cuts stay where they are, and the result is joined there again. No triangle is lost. Throws
// InputError if an option is out of range or a point is not finite.
DecimateResult Decimate(const TriMesh& mesh, const DecimateOptions& options);

}  // namespace semblance::surfaces
