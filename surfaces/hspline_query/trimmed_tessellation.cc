// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_query/trimmed_tessellation.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"
#include "surfaces/hspline_query/cell_triangles.h"
#include "surfaces/hspline_query/hspline_batch.h"

namespace semblance {
namespace {

constexpr std::size_t kBlock = 64;
constexpr std::int64_t kMostSplits = 4'000'000;

[[noreturn]] void TooClose(double distance_mm) {
  throw InputError(
      fmt::format("trimming: a distance of {} mm leaves nothing or too many small "
                  "pieces; allow more",
                  distance_mm));
}

// Where a cell lies: all of it within the distance, all beyond it, or neither.
enum class Side { kWithin, kBeyond, kBoth };

// Finds the cells through which the border goes.
class BorderSearch {
 public:
  BorderSearch(const HSplineSurface& surface, const PointQuery& near, double distance_mm)
      : surface_(surface), near_(near), distance_mm_(distance_mm) {}

  // The cells that the border divides are replaced by smaller ones; appends all of them.
  Side Divide(const DomainCell& cell, std::vector<DomainCell>& cells) const {
    const Ball ball = BallAround(cell);
    const double distance = near_.DistanceTo(ball.centre);
    const Side side = distance + ball.radius <= distance_mm_  ? Side::kWithin
                      : distance - ball.radius > distance_mm_ ? Side::kBeyond
                                                              : Side::kBoth;
    if (side != Side::kBoth || ball.radius <= kFine * distance_mm_ || cell.level == kDeepestCell) {
      cells.push_back(cell);
      return side;
    }
    return DivideIntoQuarters(cell, cells);
  }

 private:
  static constexpr double kFine = 1.0 / 8;

  struct Ball {
    Vec3 centre;
    double radius;
  };

  // Holds the surface over the cell: its points are within the chord bound of triangles between the
  // corners.
  Ball BallAround(const DomainCell& cell) const {
    const HSplineShape& shape = surface_.shape();
    const double width = std::ldexp(1.0, -cell.level) / shape.patches_u,
                 height = std::ldexp(1.0, -cell.level) / shape.patches_v;
    const auto at = [&](double s, double t) {
      return surface_.Point({(cell.i + s) * width, (cell.j + t) * height});
    };
    Ball ball{at(0.5, 0.5), 0};
    for (const auto& [s, t] :
         {std::pair{0, 0}, std::pair{1, 0}, std::pair{0, 1}, std::pair{1, 1}}) {
      ball.radius = std::max(ball.radius, (at(s, t) - ball.centre).norm());
    }
    ball.radius += ChordBound(surface_, cell);
    return ball;
  }

  // Quarters that are all on one side make the whole cell one again.
  Side DivideIntoQuarters(const DomainCell& cell, std::vector<DomainCell>& cells) const {
    if (++splits_ > kMostSplits) {
      TooClose(distance_mm_);
    }
    const std::size_t before = cells.size();
    const std::array<DomainCell, 4> quarters = ChildrenOf(cell);
    const Side first = Divide(quarters[0], cells);
    bool alike = first != Side::kBoth;
    for (int k = 1; k < 4; ++k) {
      alike = (Divide(quarters[k], cells) == first) && alike;
    }
    if (!alike) {
      return Side::kBoth;
    }
    cells.resize(before);
    cells.push_back(cell);
    return first;
  }

  const HSplineSurface& surface_;
  const PointQuery& near_;
  double distance_mm_;
  mutable std::atomic<std::int64_t> splits_ = 0;
};

std::set<DomainCell> CellsWithBorder(const HSplineSurface& surface, double chord_mm,
                                     const PointQuery& near, double distance_mm, int threads) {
  const std::set<DomainCell> coarse = CellsWithinChord(surface, chord_mm);
  const std::vector<DomainCell> each(coarse.begin(), coarse.end());
  const BorderSearch search(surface, near, distance_mm);
  std::vector<std::vector<DomainCell>> finer(each.size());
  ParallelFor(each.size(), threads, kBlock,
              [&](std::size_t k) { search.Divide(each[k], finer[k]); });
  std::set<DomainCell> cells;
  for (const std::vector<DomainCell>& part : finer) {
    cells.insert(part.begin(), part.end());
  }
  return cells;
}

std::vector<char> WithinDistance(std::span<const Vec3> points, const PointQuery& near,
                                 double distance_mm, int threads) {
  std::vector<char> within(points.size());
  ParallelFor(points.size(), threads, kBlock, [&](std::size_t k) {
    within[k] = near.DistanceTo(points[k]) <= distance_mm ? 1 : 0;
  });
  return within;
}

// An edge that the border crosses: from the corner within the distance to the one beyond it.
using CutEdge = std::pair<int, int>;

// Where the border crosses edges, as close as bisection brings it, on the inner side.
class Crossings {
 public:
  Crossings(const HSplineShape& shape, const Tessellation& whole, const std::vector<char>& within)
      : shape_(shape), whole_(whole) {
    for (const Triangle& t : whole.mesh.triangles) {
      for (int k = 0; k < 3; ++k) {
        const int a = t[k], b = t[(k + 1) % 3];
        if (within[a] != within[b]) {
          const CutEdge edge = within[a] != 0 ? CutEdge(a, b) : CutEdge(b, a);
          if (index_.emplace(edge, static_cast<int>(edges_.size())).second) {
            edges_.push_back(edge);
          }
        }
      }
    }
  }

  void Bisect(const HSplineBatch& surface, const PointQuery& near, double distance_mm,
              int threads) {
    constexpr int kHalvings = 16;
    inner_.assign(edges_.size(), 0);
    std::vector<Vec2> uv(edges_.size());
    for (int halving = 1; halving <= kHalvings; ++halving) {
      const double step = std::ldexp(1.0, -halving);
      for (std::size_t k = 0; k < edges_.size(); ++k) {
        uv[k] = Along(edges_[k], inner_[k] + step);
      }
      const std::vector<Vec3> points = surface.Points(uv, threads);
      const std::vector<char> within = WithinDistance(points, near, distance_mm, threads);
      for (std::size_t k = 0; k < edges_.size(); ++k) {
        inner_[k] += within[k] != 0 ? step : 0;
      }
    }
  }

  // The vertex at which an edge is cut: one of those added, or its inner corner where the border
  // goes through that.
  int VertexOf(const CutEdge& edge) const {
    const int k = index_.at(edge);
    return inner_[k] == 0 ? edge.first : static_cast<int>(whole_.uv.size()) + k;
  }

  std::vector<Vec2> Places() const {
    std::vector<Vec2> uv;
    for (std::size_t k = 0; k < edges_.size(); ++k) {
      uv.push_back(Along(edges_[k], inner_[k]));
    }
    return uv;
  }

 private:
  // The shorter way round where the surface is closed.
  Vec2 Along(const CutEdge& edge, double t) const {
    const Vec2& from = whole_.uv[edge.first];
    Vec2 way = whole_.uv[edge.second] - from;
    way.x() -= shape_.ClosedU() ? std::round(way.x()) : 0;
    way.y() -= shape_.ClosedV() ? std::round(way.y()) : 0;
    const Vec2 at = from + t * way;
    return {IntoUnit(at.x(), shape_.ClosedU()), IntoUnit(at.y(), shape_.ClosedV())};
  }

  HSplineShape shape_;
  const Tessellation& whole_;
  std::map<CutEdge, int> index_;
  std::vector<CutEdge> edges_;
  std::vector<double> inner_;  // of each edge's way outward, the last place within the distance
};

void AddIfWhole(const Triangle& t, std::vector<Triangle>& triangles) {
  if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) {
    triangles.push_back(t);
  }
}

// The part of a triangle within the distance, with its turn kept.
void CutTriangle(Triangle t, const std::vector<char>& within, const Crossings& crossings,
                 std::vector<Triangle>& triangles) {
  const int count = within[t[0]] + within[t[1]] + within[t[2]];
  if (count == 0 || count == 3) {
    if (count == 3) {
      triangles.push_back(t);
    }
    return;
  }
  const char odd = count == 1 ? 1 : 0;  // that of the corner that differs from both others
  while (within[t[0]] != odd) {
    t = {t[1], t[2], t[0]};
  }
  if (count == 1) {
    AddIfWhole({t[0], crossings.VertexOf({t[0], t[1]}), crossings.VertexOf({t[0], t[2]})},
               triangles);
    return;
  }
  const int right = crossings.VertexOf({t[1], t[0]}), left = crossings.VertexOf({t[2], t[0]});
  AddIfWhole({t[1], t[2], right}, triangles);
  AddIfWhole({right, t[2], left}, triangles);
}

std::vector<Triangle> CutTriangles(std::span<const Triangle> whole, const std::vector<char>& within,
                                   const Crossings& crossings) {
  std::vector<Triangle> triangles;
  for (const Triangle& t : whole) {
    CutTriangle(t, within, crossings, triangles);
  }
  return triangles;
}

void AddVertices(const HSplineBatch& surface, const std::vector<Vec2>& uv, int threads,
                 Tessellation& t) {
  const SurfaceSamples added = surface.PointsAndNormals(uv, threads);
  t.uv.insert(t.uv.end(), uv.begin(), uv.end());
  t.mesh.points.insert(t.mesh.points.end(), added.points.begin(), added.points.end());
  t.normals.insert(t.normals.end(), added.normals.begin(), added.normals.end());
}

template <class T>
std::vector<T> Taken(const std::vector<T>& from, std::span<const std::int32_t> indices) {
  std::vector<T> taken;
  taken.reserve(indices.size());
  for (const std::int32_t index : indices) {
    taken.push_back(from[index]);
  }
  return taken;
}

Tessellation WithoutUnused(Tessellation t) {
  const std::vector<std::int32_t> left = DropUnusedPoints(t.mesh);
  t.uv = Taken(t.uv, left);
  t.normals = Taken(t.normals, left);
  return t;
}

}  // namespace

TrimmedTessellation TessellateNear(const HSplineSurface& surface, double chord_mm,
                                   const PointQuery& near, double distance_mm, int threads) {
  if (!(distance_mm > 0) || !std::isfinite(distance_mm)) {
    throw InputError(
        fmt::format("trimming: a distance of {} mm; it must be above 0 and finite", distance_mm));
  }
  Tessellation mesh = TessellateCells(
      surface, CellsWithBorder(surface, chord_mm, near, distance_mm, threads), threads);
  const double whole_mm2 = Area(mesh.mesh);
  const std::vector<char> within = WithinDistance(mesh.mesh.points, near, distance_mm, threads);
  Crossings crossings(surface.shape(), mesh, within);
  const HSplineBatch batch(surface);
  crossings.Bisect(batch, near, distance_mm, threads);
  std::vector<Triangle> triangles = CutTriangles(mesh.mesh.triangles, within, crossings);
  if (triangles.empty()) {
    TooClose(distance_mm);
  }
  AddVertices(batch, crossings.Places(), threads, mesh);
  mesh.mesh.triangles = std::move(triangles);
  TrimmedTessellation result{.kept = WithoutUnused(std::move(mesh))};
  result.kept_mm2 = Area(result.kept.mesh);
  result.cut_mm2 = std::max(0.0, whole_mm2 - result.kept_mm2);
  return result;
}

}  // namespace semblance
