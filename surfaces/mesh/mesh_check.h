// SPDX-License-Identifier: GPL-3.0-or-later
// Whether a mesh can be a head in millimetres, and what is wrong with it.
#pragma once

#include <string>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// A head, or the scanned part of one, is of this size.
inline constexpr double kSmallestHead_mm = 60, kLargestHead_mm = 500;

// Throws InputError, naming the thing, unless its longest side is that of a head in mm. If it looks
// like a head in another unit, the message names the unit and ends with `remedy`, in which {} is
// the factor to mm.
void CheckHeadSize(double longest_mm, const std::string& name, const std::string& remedy);

// Throws InputError, naming the mesh, if it is empty or not finite, if its bounding box is not
// that of a head in mm (saying which unit it looks like), if it lies more than 100 m from the
// origin, if it has no area, or if it is inside out: of rays sent from
// far outside, most hit a triangle's back first. The mesh is never turned silently. Returns a line
// for each lesser defect that real scans have: non-manifold, inconsistent or open edges, triangles
// without area.
std::vector<std::string> CheckHeadMesh(const TriMesh& mesh, const std::string& name);

}  // namespace semblance
