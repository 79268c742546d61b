// SPDX-License-Identifier: GPL-3.0-or-later
// The network of a fit's points in (u,v), which defines their neighbours.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "fitting/problem/fit_target.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance::fitting {

enum class DowelLinks { kDelaunay, kNone };

// The Delaunay triangles of the points' (u,v), scaled to mm of the template. Points of the same
// (u,v) share a corner. On a surface closed in u the network is cut at u = 0, and no point crosses
// the cut. Without links there are no triangles, and each point is its own corner.
class DowelMesh {
 public:
  // uv: the points' places in the template, before any move. Fewer than three points, or points on
  // a line, have no triangles.
  DowelMesh(const HSplineSurface& template_surface, std::span<const Vec2> uv,
            DowelLinks links = DowelLinks::kDelaunay);
  const std::vector<std::array<int, 3>>& triangles() const { return triangles_; }
  const std::vector<std::array<int, 2>>& edges() const { return edges_; }
  // The corner of each point: the point itself, or the first point of the same (u,v).
  const std::vector<int>& corner() const { return corner_; }
  const std::vector<Vec2>& rest_uv() const { return rest_uv_; }
  const Vec2& lengths_mm() const { return lengths_mm_; }  // MeanLengths of the template
  // Counts the turned triangles with the points at uv.
  int Flips(std::span<const Vec2> uv) const;
  // Returns whether a triangle is turned over, or has lost 99 % of its area in the template.
  bool Turned(const std::array<int, 3>& triangle, std::span<const Vec2> uv) const;

 private:
  void Link(std::span<const Vec2> uv);

  std::vector<Vec2> rest_uv_;
  std::vector<int> corner_;
  std::vector<std::array<int, 3>> triangles_;
  std::vector<std::array<int, 2>> edges_;
  Vec2 lengths_mm_;
};

// The largest angle between the surface's normals at two neighbours of the network, with the points
// at uv; 0 without neighbours.
double SharpestCrease_deg(const HSplineSurface& surface, const DowelMesh& mesh,
                          std::span<const Vec2> uv);

}  // namespace semblance::fitting
