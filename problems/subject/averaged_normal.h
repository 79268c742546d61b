// SPDX-License-Identifier: GPL-3.0-or-later
// The normal of a rough surface around one of its points.
#pragma once

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// The unit mean normal, weighted by area, of the mesh inside `ball`: of the triangles that are
// connected there with the triangle `first` and face within 80 degrees of it (in any direction if
// `first` has no area). A triangle's area counts as far as it lies inside, to some percent. Zero if
// there is no such area.
Vec3 AveragedNormal(const TriMesh& mesh, int first, const Sphere& ball);

}  // namespace semblance
