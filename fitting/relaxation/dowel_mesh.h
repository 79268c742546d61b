// SPDX-License-Identifier: GPL-3.0-or-later
// The network of a fit's points in (u,v), which says who is whose neighbour.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "fitting/problem/fit_target.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

enum class DowelLinks { kDelaunay, kNone };

// The Delaunay triangles of the points' (u,v), in mm of the template. Points of the same (u,v)
// share a corner. Where u or v is closed the network is cut at 0, which no point passes. Without
// links it is the points alone, each its own corner.
class DowelMesh {
 public:
  // uv: of each point on the template surface, before any move. Any number of points will do: fewer
  // than three, or all on a line, have no triangles.
  DowelMesh(const HSplineSurface& template_surface, std::span<const Vec2> uv,
            DowelLinks links = DowelLinks::kDelaunay);
  const std::vector<std::array<int, 3>>& triangles() const { return triangles_; }
  const std::vector<std::array<int, 2>>& edges() const { return edges_; }
  // For each point the one that stands for it: itself, or the first of the same (u,v).
  const std::vector<int>& corner() const { return corner_; }
  const std::vector<Vec2>& rest_uv() const { return rest_uv_; }
  const Vec2& lengths_mm() const { return lengths_mm_; }  // of the template along u and v
  // How many triangles are turned over with the points at uv.
  int Flips(std::span<const Vec2> uv) const;
  // Whether one is, or has lost nearly all of its area.
  bool Turned(const std::array<int, 3>& triangle, std::span<const Vec2> uv) const;

 private:
  void Link(std::span<const Vec2> uv);

  std::vector<Vec2> rest_uv_;
  std::vector<int> corner_;
  std::vector<std::array<int, 3>> triangles_;
  std::vector<std::array<int, 2>> edges_;
  Vec2 lengths_mm_;
};

// The largest angle between the surface's normals at two neighbours of the network, whose points
// are at uv; 0 without neighbours.
double SharpestCrease_deg(const HSplineSurface& surface, const DowelMesh& mesh,
                          std::span<const Vec2> uv);

}  // namespace semblance
