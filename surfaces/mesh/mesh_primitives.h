// SPDX-License-Identifier: GPL-3.0-or-later
// Cylinders and spheres as meshes.
#pragma once

#include "surfaces/mesh/tri_mesh.h"

namespace semblance::surfaces {

// A closed cylinder with outward triangles. Throws InputError unless sides >= 3, radius_mm > 0 and
// from != to.
TriMesh MakeCylinder(const Vec3& from, const Vec3& to, double radius_mm, int sides = 20);

// A closed sphere with outward triangles: `rings` bands from pole to pole, 2 x rings columns.
// Throws InputError unless rings >= 2 and radius_mm > 0.
TriMesh MakeSphere(const Vec3& center, double radius_mm, int rings = 12);

// Adds the points and triangles of `part` to the mesh.
void Append(TriMesh& mesh, const TriMesh& part);

}  // namespace semblance::surfaces
