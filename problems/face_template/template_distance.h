// SPDX-License-Identifier: GPL-3.0-or-later
// How well a template's face meets the skin that it was made from.
#pragma once

#include <vector>

#include "surfaces/hspline/hspline_surface.h"
#include "surfaces/mesh/mesh_query.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// How far a surface is from another, weighted by area, mm.
struct SkinDistance {
  double rms_mm = kNaN, p95_mm = kNaN, max_mm = kNaN;
  double covered = kNaN;   // 0..1: the part of the area that has a counterpart and so is measured
  double area_mm2 = kNaN;  // all of it
};

// Measures against one skin.
class TemplateDistance {
 public:
  // face: (u,v) of which the convex hull is the face. The skin must outlive it.
  TemplateDistance(const TriMesh& skin, std::vector<Vec2> face);

  // From each point of the face, 4 by 4 per patch of level 3, to the nearest point of the skin. A
  // point nearest to a border of the skin has no counterpart: there the skin has a hole.
  SkinDistance FaceToSkin(const HSplineSurface& surface, int threads) const;

  // From each vertex of the skin before the face to the nearest point of the surface. Vertices that
  // face away from it (nostrils, the inner side of lids) or are more than 10 mm off have no
  // counterpart.
  SkinDistance SkinToFace(const HSplineSurface& surface, int threads) const;

  bool InFace(const Vec2& uv) const;

 private:
  const TriMesh& skin_;
  MeshQuery query_;
  std::vector<Vec3> normals_;    // per vertex of the skin
  std::vector<double> areas_;    // per vertex
  std::vector<bool> on_border_;  // per vertex
  std::vector<Vec2> hull_;       // counter-clockwise
};

// Pairs of neighbours among points of the surface, 2 by 2 per patch of its finest level, whose
// normals differ by more than 120 degrees.
int CountFolds(const HSplineSurface& surface, int threads);

}  // namespace semblance
