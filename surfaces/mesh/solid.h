// SPDX-License-Identifier: GPL-3.0-or-later
// The inside of a closed mesh.
#pragma once

#include <vector>

#include "surfaces/mesh/mesh_query.h"

namespace semblance::surfaces {

// The signed volume (mm^3) that each component encloses: positive if its triangles face outward. An
// open component counts as closed by triangles to the middle of the mesh's box.
std::vector<double> EnclosedVolumes(const TriMesh& mesh, const Components& components);

// Returns true if the mesh is closed, no edge has more than two triangles or joins two of opposite
// orientation, and every component faces outward. Walls of inner cavities do not.
bool BoundsSolid(const TriMesh& mesh);

// Keeps a search tree for many questions. Const calls are safe from several threads at once.
class Solid {
 public:
  // mesh: one for which BoundsSolid is true; parts may overlap and cross each other. Throws
  // InputError as MeshQuery does.
  explicit Solid(const TriMesh& mesh);

  // Returns true if p lies inside: a ray from there leaves the mesh more often than it enters. Two
  // of three rays decide, because a ray through an edge may meet both of its triangles.
  bool Contains(const Vec3& p) const;

 private:
  bool IsLeft(const Vec3& p, const Vec3& direction) const;

  Box3 box_;
  std::vector<Vec3> area_vectors_;  // one per triangle
  MeshQuery query_;
};

}  // namespace semblance::surfaces
