// SPDX-License-Identifier: GPL-3.0-or-later
// Finds the part of a scanned skin that faces the outside air. A surface between tissue and air
// that was taken from a scan also has the walls of airways and sinuses, and a lid or a rim where
// the scan ended.
#pragma once

#include <vector>

#include "surfaces/mesh/cut_planes.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

struct OuterSkin {
  std::vector<bool> outer;     // one per vertex
  std::vector<CutPlane> ends;  // sides of the bounding box at which the scan was cut off
};

// A vertex is outer if a ball of radius probe_mm that comes from outside can touch it on the outer
// side of its normal. Cavities that the ball cannot enter (nostrils, ear canals, a closed mouth)
// are inside. The centre of the ball moves on a grid with cells of probe_mm / 6, so the radius is
// exact to sqrt(3) cells. The ball does not pass through holes: a lid from the middle of each open
// border closes it, so that walls behind it (sinuses, airways, an inner layer) stay inside. A side
// of the bounding box is an end of the scan if an open border runs along it (FindCutPlanes) or a
// lid closes it (FindLids). The ball comes from no end. So neither a lid nor an airway that a cut
// opens is outer. Triangles face outwards. Throws InputError if the mesh has no triangle, is not
// finite, or is more than 1000 probes long.
OuterSkin FindOuterSkin(const TriMesh& skin, double probe_mm);

}  // namespace semblance::problems
