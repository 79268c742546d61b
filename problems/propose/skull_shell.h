// SPDX-License-Identifier: GPL-3.0-or-later
// The outer side of a skull, coarse and without specks: what is laid over another skull.
#pragma once

#include <string>
#include <vector>

#include "surfaces/mesh/correspondences.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

struct ShellPoint {
  Vec3 position = Vec3::Constant(kNaN);  // mm
  Vec3 normal = Vec3::Constant(kNaN);    // unit, outward
};

struct SkullShell {
  TriMesh mesh;             // need not be manifold
  Correspondences surface;  // the closest points of the mesh and their normals
};

// Vertices 2 mm apart, of the triangles that are seen from outside (outer_surface.h) in bodies of 3
// cm^2 or more. Inner table, sinuses and specks are gone; what shows through orbits and openings
// stays. skull: as CheckHeadMesh wants it. `name`: for messages. Throws InputError if nothing is
// left, or if two bodies have the size of a skull.
SkullShell MakeShell(const TriMesh& skull, const std::string& name, int threads);

// The shell of a mesh that is one already.
SkullShell AsShell(TriMesh mesh);

// Points of the shell, spread evenly: the middle of the first triangle in each cell of a grid.
std::vector<ShellPoint> SpreadPoints(const SkullShell& shell, double cell_mm);

}  // namespace semblance
