// SPDX-License-Identifier: GPL-3.0-or-later
// Checks whether a mesh can be a head in millimetres, and names its defects.
#pragma once

#include <string>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance::surfaces {

// The range of the longest side of a head, or of the scanned part of one.
inline constexpr double kSmallestHead_mm = 60, kLargestHead_mm = 500;

// Throws InputError with the name of the mesh unless its longest side is that of a head in mm. If
// the size suggests another unit, the message names the unit and ends with `remedy`, in which {}
// stands for the factor to mm.
void CheckHeadSize(double longest_mm, const std::string& name, const std::string& remedy);

// Throws InputError with the name of the mesh if the mesh is empty, has no area, is not finite,
// lies more than 100 m from the origin, or is inside out, and if its longest side is not that of a
// head in mm (the message guesses the unit). Inside out means that most rays from far outside hit
// the back of a triangle first; the mesh is never turned silently. Returns one line for each lesser
// defect of real scans: open, non-manifold or inconsistent edges, a surface that is there twice.
// JoinCopies (join_copies.h) comes first.
std::vector<std::string> CheckHeadMesh(const TriMesh& mesh, const std::string& name);

}  // namespace semblance::surfaces
