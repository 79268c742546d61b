// SPDX-License-Identifier: GPL-3.0-or-later
// Which of a scanned skin faces the outside air. A surface between tissue and air, as it is taken
// from a scan, also has the walls of airways and sinuses, and where the scan ended a lid or a rim.
#pragma once

#include <vector>

#include "surfaces/mesh/cut_planes.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

struct OuterSkin {
  std::vector<bool> outer;     // one per vertex
  std::vector<CutPlane> ends;  // sides of the bounding box that the scan was cut off at
};

// A vertex is outer if a ball of probe_mm radius that comes from outside can touch it there, on the
// outer side of its normal: what the ball does not get into (nostrils, ears' canals, a mouth that
// is closed) is inside. Found by moving the ball's centre on a grid, so the radius is met within
// sqrt(3) cells of probe_mm / 6. A side of the bounding box is an end of the scan if an open border
// runs along it (FindCutPlanes) or a lid closes it (FindLids); the ball comes from none of them, so
// a lid is not outer, nor is an airway that a cut opens. Triangles face outwards. Throws InputError
// if the mesh has no triangle, is not finite, or is more than 1000 probes long.
OuterSkin FindOuterSkin(const TriMesh& skin, double probe_mm);

}  // namespace semblance
