// SPDX-License-Identifier: GPL-3.0-or-later
// The volume between two surfaces, of which one is given as displacements of the other's vertices
// (thesis 5.3).
#pragma once

#include <map>
#include <span>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

struct EnclosedVolume {
  double outside_cm3 = 0;  // where the other surface lies outside
  double inside_cm3 = 0;   // where it lies inside

  double Enclosed() const { return outside_cm3 + inside_cm3; }
  double Net() const { return outside_cm3 - inside_cm3; }
};

struct VolumeByPart {
  EnclosedVolume all;
  std::map<int, EnclosedVolume> parts;  // a triangle counts by thirds for the parts of its corners
};

// The triangles sweep from p to p + move. Of one triangle with edges e1, e2, whose displacement is
// linear on it, with mean m and differences f1, f2 along the edges, the swept volume is
//   m . (e1 x e2 + (e1 x f2 + f1 x e2) / 2 + f1 x f2 / 3) / 2,
// exactly the integral of the area element over the way, which grows or shrinks with curvature. It
// counts as outside where signed_mm > 0; a triangle on which the sign changes is divided at the
// zero of signed_mm. Triangles with a corner that has no finite signed_mm are left out. move,
// signed_mm and part: one entry per point of the mesh; parts < 0 count for `all` only.
VolumeByPart MeasureEnclosed(const TriMesh& mesh, std::span<const Vec3> move,
                             std::span<const double> signed_mm, std::span<const int> part);

}  // namespace semblance
