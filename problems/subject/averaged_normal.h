// SPDX-License-Identifier: GPL-3.0-or-later
// The normal of a rough surface around one of its points.
#pragma once

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// The unit mean normal, weighted by area, of the part of the mesh inside `ball` (the area of a
// triangle counts as far as it lies inside, to some percent) that hangs together inside it with the
// triangle `seed` and faces within 80 degrees of it (anyhow, if `seed` has no area). Zero if there
// is no such area.
Vec3 AveragedNormal(const TriMesh& mesh, int seed, const Sphere& ball);

}  // namespace semblance
