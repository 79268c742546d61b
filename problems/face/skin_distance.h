// SPDX-License-Identifier: GPL-3.0-or-later
// A template's face and the skin of the head that it is made from: the points of the skin to which
// the face is fitted, and the distance that remains.
#pragma once

#include <optional>
#include <vector>

#include "surfaces/hspline/hspline_surface.h"
#include "surfaces/mesh/correspondences.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

// ---------------------------------------------------------------------------------------------
// Matching
// ---------------------------------------------------------------------------------------------

struct SkinMatch {
  Vec3 point = Vec3::Constant(kNaN);  // on the skin, mm
  double distance_mm = kNaN;
};

class SkinMatcher {
 public:
  explicit SkinMatcher(const TriMesh& skin);

  // The closest point of the skin that corresponds to the point. If the closest point of all does
  // not, the nearest one along the normal that does. A point corresponds if it lies within
  // reach_mm, if its triangle has no vertex on an open border, and if its normal lies within 60
  // degrees of `normal` (unit).
  std::optional<SkinMatch> Find(const Vec3& point, const Vec3& normal, double reach_mm) const;

 private:
  Correspondences skin_;
};

// A regular grid over the domain, and the points of the skin that match it. Entry i + columns * j
// belongs to cell (i, j).
struct MatchGrid {
  int columns = 0, rows = 0;
  std::vector<Vec2> uv;                        // the middles of the cells
  std::vector<Vec3> points, normals;           // of the surface
  std::vector<std::optional<SkinMatch>> skin;  // none where no point of the skin matches
};

// Matches a grid of columns x rows cells. If the matches of three neighbours would turn their
// triangle by more than 80 degrees against the surface, all three are dropped: such matches make
// folds.
MatchGrid MatchToSkin(const HSplineSurface& surface, const SkinMatcher& skin, int columns, int rows,
                      double reach_mm, int threads);

// ---------------------------------------------------------------------------------------------
// Measuring
// ---------------------------------------------------------------------------------------------

// Distances from one surface to another, weighted by area, mm.
struct SkinDistance {
  double rms_mm = kNaN, p95_mm = kNaN, max_mm = kNaN;
  double covered = kNaN;   // 0..1: the measured part of the area, which has a counterpart
  double area_mm2 = kNaN;  // of the whole surface, measured or not
};

// Measures the distance from one skin.
class TemplateDistance {
 public:
  // face: (u,v) whose convex hull is the face. The skin must outlive this object.
  TemplateDistance(const TriMesh& skin, std::vector<Vec2> face);

  // From 4 x 4 points of the face per patch of level 3 to the nearest points of the skin. A point
  // whose nearest skin is a border has no counterpart, because the skin has a hole there.
  SkinDistance FaceToSkin(const HSplineSurface& surface, int threads) const;

  // From each vertex of the skin in front of the face to the nearest point of the surface. Vertices
  // that face away from the surface (nostrils, the inner side of the lids) or lie more than 10 mm
  // from it have no counterpart.
  SkinDistance SkinToFace(const HSplineSurface& surface, int threads) const;

  bool InFace(const Vec2& uv) const;

 private:
  const TriMesh& skin_;
  Correspondences from_face_;  // none beside a border of the skin
  std::vector<double> areas_;  // one per vertex of the skin
  std::vector<Vec2> hull_;     // counter-clockwise
};

// The number of pairs of neighbours, among 2 x 2 points per patch of the finest level, whose
// normals differ by more than 120 degrees.
int CountFolds(const HSplineSurface& surface, int threads);

}  // namespace semblance::problems
