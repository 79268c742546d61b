// SPDX-License-Identifier: GPL-3.0-or-later
// Fewer triangles, the same shape.
#pragma once

#include <array>
#include <limits>
#include <string_view>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

struct DecimateOptions {
  int target_triangles = 4;  // no collapse once so few are left; at least 4
  // No vertex of either mesh further from the other than this; larger than 0. Between vertices a
  // mesh may be off by a little more.
  double tolerance_mm = std::numeric_limits<double>::infinity();
};

// Why it ended. No sound collapse: any more would turn a triangle by more than 60 degrees, make a
// needle, change the topology or move the surface by more than a share of what is left of its
// triangles.
enum class DecimateStop { kNotRun, kTarget, kTolerance, kNoSoundCollapse };
constexpr auto EnumNames(DecimateStop) {
  return std::to_array<std::string_view>({"not run", "target", "tolerance", "no sound collapse"});
}

struct DecimateSummary {
  int triangles = -1;      // that are left
  double error_mm = kNaN;  // no vertex given is further from what is left
  DecimateStop stop = DecimateStop::kNotRun;
};

struct DecimateResult {
  TriMesh mesh;
  DecimateSummary summary;
};

// Edge collapses, cheapest first: by the squared distances from the planes of the triangles that
// stand there now, weighted by area (Garland & Heckbert 1997; without their memory as in Lindstrom
// & Turk 1998). Points on a border stay on a border. The result has the topology of the mesh: its
// components, borders and handles; asked for fewer triangles than sound collapses can give it has
// more, and the summary says so. Same input, same bytes. Throws InputError if the mesh is not
// a consistently oriented manifold or a point is not finite.
DecimateResult Decimate(const TriMesh& mesh, const DecimateOptions& options);

}  // namespace semblance
