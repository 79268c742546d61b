// SPDX-License-Identifier: GPL-3.0-or-later
// What of a skull was seen, and what was made up.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

enum class BoneOrigin : std::uint8_t {
  kObserved,  // of the scan
  kMirrored,  // the other side's, where this one was missing
  kInferred   // bridged: temples, orbits, gaps
};
constexpr auto EnumNames(BoneOrigin) {
  return std::to_array<std::string_view>({"observed", "mirrored", "inferred"});
}

// Of each triangle of a skull's shell: that of the nearest triangle of the skull, or inferred where
// there is none within 2 mm of its middle. of_skull: one per triangle; none: all observed.
std::vector<BoneOrigin> OriginOfShell(const TriMesh& shell, const TriMesh& skull,
                                      std::span<const BoneOrigin> of_skull, int threads);

// Of each vertex of a face: that of the shell's nearest triangle.
std::vector<BoneOrigin> OriginUnder(const TriMesh& face, const TriMesh& shell,
                                    std::span<const BoneOrigin> of_shell, int threads);

// By origin, in the order of the names.
std::array<double, 3> AreaByOrigin_cm2(const TriMesh& mesh, std::span<const BoneOrigin> origin);

}  // namespace semblance
