// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/relaxation/dowel_mesh.h"

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>

#include "fitting/least_squares/patch_energy.h"

namespace semblance::fitting {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<int, Kernel>;
using Storage = CGAL::Triangulation_data_structure_2<VertexBase>;
using Delaunay = CGAL::Delaunay_triangulation_2<Kernel, Storage>;

double DoubleArea(const std::array<int, 3>& t, std::span<const Vec2> uv) {
  const Vec2 a = uv[t[1]] - uv[t[0]], b = uv[t[2]] - uv[t[0]];
  return a.x() * b.y() - a.y() * b.x();
}

// Indices sorted by u, then v, so that the given order has no effect.
std::vector<int> Ordered(std::span<const Vec2> uv) {
  std::vector<int> order(uv.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return std::pair(uv[a].x(), uv[a].y()) < std::pair(uv[b].x(), uv[b].y());
  });
  return order;
}

Vec2 ToVec(const Kernel::Point_2& p) { return {p.x(), p.y()}; }

bool OnOneCircle(const std::array<Vec2, 4>& p) {
  constexpr double kSame = 1e-9;  // of the radius
  const Vec2 ab = p[1] - p[0], ac = p[2] - p[0];
  const double twice = 2 * (ab.x() * ac.y() - ab.y() * ac.x());
  const Vec2 center = p[0] + Vec2(ac.y() * ab.squaredNorm() - ab.y() * ac.squaredNorm(),
                                  ab.x() * ac.squaredNorm() - ac.x() * ab.squaredNorm()) /
                                 twice;
  const double radius = (center - p[0]).norm();
  return std::abs((center - p[3]).norm() - radius) < kSame * radius;
}

// Returns by how much the upper end of a link is nearer to u = 1/2 than its lower end.
double RiseToMiddle(const Vec2& a, const Vec2& b) {
  const Vec2 &low = a.y() < b.y() ? a : b, &high = a.y() < b.y() ? b : a;
  return std::abs(low.x() - 0.5) - std::abs(high.x() - 0.5);
}

// Four points on one circle, as those of a grid, have two Delaunay links. Takes the one whose upper
// end is nearer to u = 1/2, so that the mirror image of the points gets the mirrored links.
void ChooseLinks(std::span<const Vec2> uv, Delaunay& delaunay) {
  using Handle = Delaunay::Vertex_handle;
  std::vector<std::pair<Handle, Handle>> turned;
  for (auto edge = delaunay.finite_edges_begin(); edge != delaunay.finite_edges_end(); ++edge) {
    const auto& [face, k] = *edge;
    const Handle a = face->vertex(Delaunay::ccw(k)), b = face->vertex(Delaunay::cw(k)),
                 c = face->vertex(k), d = delaunay.mirror_vertex(face, k);
    if (delaunay.is_infinite(c) || delaunay.is_infinite(d) ||
        !OnOneCircle(
            {ToVec(a->point()), ToVec(b->point()), ToVec(c->point()), ToVec(d->point())})) {
      continue;
    }
    constexpr double kTie = 1e-9;
    if (RiseToMiddle(uv[c->info()], uv[d->info()]) >
        RiseToMiddle(uv[a->info()], uv[b->info()]) + kTie) {
      turned.emplace_back(a, b);
    }
  }
  for (const auto& [a, b] : turned) {
    Delaunay::Face_handle face;
    int k = -1;
    if (delaunay.is_edge(a, b, face, k)) {
      delaunay.flip(face, k);
    }
  }
}

}  // namespace

DowelMesh::DowelMesh(const HSplineSurface& template_surface, std::span<const Vec2> uv,
                     DowelLinks links)
    : rest_uv_(uv.begin(), uv.end()),
      corner_(uv.size()),
      lengths_mm_(MeanLengths(template_surface)) {
  std::iota(corner_.begin(), corner_.end(), 0);
  if (links == DowelLinks::kDelaunay) {
    Link(uv);
  }
}

void DowelMesh::Link(std::span<const Vec2> uv) {
  Delaunay delaunay;
  for (const int k : Ordered(uv)) {
    const Vec2 place = uv[k].cwiseProduct(lengths_mm_);
    const std::size_t before = delaunay.number_of_vertices();
    const auto vertex = delaunay.insert(Kernel::Point_2(place.x(), place.y()));
    if (delaunay.number_of_vertices() > before) {
      vertex->info() = k;
    }
    corner_[k] = vertex->info();
  }
  ChooseLinks(uv, delaunay);
  std::set<std::array<int, 2>> edges;
  for (auto face = delaunay.finite_faces_begin(); face != delaunay.finite_faces_end(); ++face) {
    const std::array<int, 3> t = {face->vertex(0)->info(), face->vertex(1)->info(),
                                  face->vertex(2)->info()};
    triangles_.push_back(t);
    for (int k = 0; k < 3; ++k) {
      edges.insert({std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3])});
    }
  }
  edges_.assign(edges.begin(), edges.end());
}

bool DowelMesh::Turned(const std::array<int, 3>& triangle, std::span<const Vec2> uv) const {
  // Smallest share of the template's area. Above 0, because a triangle without area cannot recover;
  // below about 0.1, because moves legitimately squeeze triangles.
  constexpr double kMinShare = 0.01;
  return DoubleArea(triangle, uv) <= kMinShare * DoubleArea(triangle, rest_uv_);
}

int DowelMesh::Flips(std::span<const Vec2> uv) const {
  return static_cast<int>(std::count_if(triangles_.begin(), triangles_.end(),
                                        [&](const auto& t) { return Turned(t, uv); }));
}

double SharpestCrease_deg(const HSplineSurface& surface, const DowelMesh& mesh,
                          std::span<const Vec2> uv) {
  std::vector<Vec3> normals;
  for (const Vec2& place : uv) {
    normals.push_back(surface.Normal(place));
  }
  double cosine = 1;
  for (const auto& [a, b] : mesh.edges()) {
    cosine = std::min(cosine, normals[a].dot(normals[b]));
  }
  return std::acos(std::max(cosine, -1.0)) * 180 / std::numbers::pi;
}

}  // namespace semblance::fitting
