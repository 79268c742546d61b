// SPDX-License-Identifier: GPL-3.0-or-later
// Planes at which a scan ends. Beyond them nothing is known about a skull.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance::surfaces {

// The plane p[axis] = at_mm; the skull lies on the side where sign * (p[axis] - at_mm) < 0.
struct CutPlane {
  int axis = -1;
  int sign = 0;  // 1 or -1
  double at_mm = kNaN;

  double Beyond_mm(const Vec3& p) const { return sign * (p[axis] - at_mm); }
};

// A side of the skull's bounding box is a cut plane if the open border of the mesh runs along it,
// within 1 mm, for 100 mm or more in all.
std::vector<CutPlane> FindCutPlanes(const TriMesh& skull);

// A side of the bounding box is also the end of a scan if a lid lies in it: triangles that face
// that way within 10 degrees and lie within 0.5 mm of it, with an area of 5 cm^2 or more. (The top
// of a ball of 80 mm has half of that.)
std::vector<CutPlane> FindLids(const TriMesh& mesh);

// For messages, e.g. "z = 0.0 mm (lower end)".
std::string ToPhrase(const CutPlane& plane);

// The part of a face for which the scan has bone: the triangles on the skull's side of all planes,
// at least margin_mm from each.
TriMesh WithinScan(const TriMesh& face, std::span<const CutPlane> planes, double margin_mm);

}  // namespace semblance::surfaces
