// SPDX-License-Identifier: GPL-3.0-or-later
// Which point of a head's skin belongs to a point of a surface that lies near it.
#pragma once

#include <optional>
#include <vector>

#include "surfaces/hspline/hspline_surface.h"
#include "surfaces/mesh/mesh_query.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

struct SkinMatch {
  Vec3 point = Vec3::Constant(kNaN);  // on the skin, mm
  double distance_mm = kNaN;
};

class SkinMatcher {
 public:
  explicit SkinMatcher(const TriMesh& skin);

  // The closest point of the skin, or, where that does not belong to the point, the nearest one
  // along the normal that does. It belongs if it is within reach_mm, its triangle has no vertex on
  // a border of the mesh, and the skin's normal is within 60 degrees of the surface's (unit).
  std::optional<SkinMatch> Find(const Vec3& point, const Vec3& normal, double reach_mm) const;

 private:
  bool Belongs(const MeshPoint& at, const Vec3& normal, double reach_mm) const;

  TriMesh skin_;
  MeshQuery query_;
  std::vector<Vec3> normals_;    // per vertex
  std::vector<bool> on_border_;  // per vertex
};

// The middles of the cells of a columns x rows grid over the domain, i + columns * j.
std::vector<Vec2> CellMiddles(int columns, int rows);

// Per vertex: whether it is on a border of the mesh.
std::vector<bool> OnBorder(const TriMesh& mesh);

// A regular grid over the domain: its (u,v), and what the skin has there.
struct MatchGrid {
  int columns = 0, rows = 0;
  std::vector<Vec2> uv;                        // CellMiddles
  std::vector<Vec3> points, normals;           // of the surface
  std::vector<std::optional<SkinMatch>> skin;  // where it was found
};

// Matches a columns x rows grid. Where three neighbours' matches would turn their triangle over
// against the surface, by more than 80 degrees, they are dropped: such matches make folds.
MatchGrid MatchToSkin(const HSplineSurface& surface, const SkinMatcher& skin, int columns, int rows,
                      double reach_mm, int threads);

}  // namespace semblance
