// SPDX-License-Identifier: GPL-3.0-or-later
// Small bodies to put into pictures.
#pragma once

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// Closed, outward. sides >= 3, radius_mm > 0, from != to, else InputError.
TriMesh MakeCylinder(const Vec3& from, const Vec3& to, double radius_mm, int sides = 20);

// Closed, outward: `rings` bands from pole to pole, twice as many round. rings >= 2, radius_mm > 0,
// else InputError.
TriMesh MakeSphere(const Vec3& center, double radius_mm, int rings = 12);

// Adds `part` as further components.
void Append(TriMesh& mesh, const TriMesh& part);

}  // namespace semblance
