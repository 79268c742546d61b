// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/triangulation/point_sheet.h"

#include <CGAL/Advancing_front_surface_reconstruction.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "surfaces/base/random.h"

namespace semblance {
namespace {

using FrontKernel = CGAL::Exact_predicates_inexact_constructions_kernel;

// Of a triangle: the radius of the smallest empty ball through its corners; none with an edge much
// longer than its corners are apart from others.
struct ShortEdges {
  const EvenPoints* points;

  template <class Front, class Cell>
  double operator()(const Front& front, Cell& cell, int opposite) const {
    constexpr double kLongest = 4.5;  // spacings
    for (const int side : {1, 2, 3}) {
      const std::size_t a = cell->vertex((opposite + side) % 4)->info(),
                        b = cell->vertex((opposite + side % 3 + 1) % 4)->info();
      const double edge_mm = (points->positions[a] - points->positions[b]).norm();
      if (edge_mm > kLongest * std::min(points->spacings_mm[a], points->spacings_mm[b])) {
        return front.infinity();
      }
    }
    return front.smallest_radius_delaunay_sphere(cell, opposite);
  }
};

using FrontVertex = CGAL::Advancing_front_surface_reconstruction_vertex_base_3<FrontKernel>;
using FrontCell = CGAL::Advancing_front_surface_reconstruction_cell_base_3<FrontKernel>;
using Tetrahedra =
    CGAL::Delaunay_triangulation_3<FrontKernel,
                                   CGAL::Triangulation_data_structure_3<FrontVertex, FrontCell>>;

// Each a little off: the front breaks ties between triangles, as points of a lattice have them, by
// where they lie in memory. So points on a plane have tetrahedra, too.
std::vector<std::pair<FrontKernel::Point_3, std::size_t>> PlacesOf(const EvenPoints& points) {
  constexpr double kOff = 1e-6;  // of the spacing
  Random random(1);
  std::vector<std::pair<FrontKernel::Point_3, std::size_t>> places;
  for (std::size_t k = 0; k < points.positions.size(); ++k) {
    const Vec3 p = points.positions[k] + kOff * points.spacings_mm[k] * random.InBox(-1, 1);
    places.emplace_back(FrontKernel::Point_3(p.x(), p.y(), p.z()), k);
  }
  return places;
}

TriMesh FrontOver(const EvenPoints& points) {
  const auto places = PlacesOf(points);
  TriMesh mesh{.points = points.positions, .triangles = {}};
  Tetrahedra tetrahedra(places.begin(), places.end());
  if (tetrahedra.dimension() < 3) {
    return mesh;
  }
  CGAL::Advancing_front_surface_reconstruction<Tetrahedra, ShortEdges> front(tetrahedra,
                                                                             ShortEdges{&points});
  front.run();
  const auto& surface = front.triangulation_data_structure_2();
  for (auto face = surface.faces_begin(); face != surface.faces_end(); ++face) {
    if (face->is_on_surface()) {
      Triangle& corners = mesh.triangles.emplace_back();
      for (const int k : {0, 1, 2}) {
        corners[k] = static_cast<std::int32_t>(face->vertex(k)->vertex_3()->info());
      }
    }
  }
  return mesh;
}

struct Pieces {
  std::size_t count = 0;
  double beside = kNaN;  // share of the triangles that are not of the largest
  TriMesh largest;
};

Pieces PiecesOf(const TriMesh& mesh) {
  const Components components = ConnectedComponents(mesh);
  std::vector<std::size_t> sizes(components.count, 0);
  for (const int piece : components.of_triangle) {
    ++sizes[piece];
  }
  const auto largest = std::max_element(sizes.begin(), sizes.end());
  std::vector<bool> keep;
  for (const int piece : components.of_triangle) {
    keep.push_back(piece == largest - sizes.begin());
  }
  return {.count = sizes.size(),
          .beside = 1 - static_cast<double>(*largest) / static_cast<double>(keep.size()),
          .largest = Submesh(mesh, keep)};
}

// Lengths of the closed lines along which there is one triangle, the longest first.
std::vector<double> BorderLengths(const TriMesh& mesh) {
  std::vector<std::vector<std::int32_t>> next(mesh.points.size());
  for (const auto& [a, b] : BorderEdges(mesh)) {
    next[a].push_back(b);
    next[b].push_back(a);
  }
  std::vector<double> lengths_mm;
  for (std::size_t first = 0; first < next.size(); ++first) {
    double length_mm = 0;
    for (auto at = static_cast<std::int32_t>(first); !next[at].empty();) {
      const std::int32_t to = next[at].back();
      next[at].pop_back();
      std::erase(next[to], at);
      length_mm += (mesh.points[to] - mesh.points[at]).norm();
      at = to;
    }
    if (length_mm > 0) {
      lengths_mm.push_back(length_mm);
    }
  }
  std::sort(lengths_mm.rbegin(), lengths_mm.rend());
  return lengths_mm;
}

// Of one piece with so many borders.
std::int64_t HandlesOf(const TriMesh& mesh, std::size_t borders) {
  const auto count = [](std::size_t n) { return static_cast<std::int64_t>(n); };
  const std::int64_t euler =
      count(mesh.points.size()) - CheckEdges(mesh).edges + count(mesh.triangles.size());
  return (2 - count(borders) - euler) / 2;
}

constexpr char kInstead[] =
    "give u and v, or triangles between the points (a PLY, OBJ, STL or OFF with faces) with "
    "parameters: mesh";

// Why it is no single open sheet; empty if it is one.
std::string FaultOf(const Pieces& pieces) {
  constexpr double kMostBeside = 0.1;     // share of the triangles
  constexpr double kShortest = 0.5;       // of the root of the area; a flat disc has 3.5
  constexpr double kSecondLongest = 0.5;  // of the longest
  if (pieces.beside > kMostBeside) {
    return fmt::format(
        "it is in {} pieces, and {:.3g} % of it are not in the largest; leave out all but one, or "
        "{}",
        pieces.count, 100 * pieces.beside, kInstead);
  }
  const std::vector<double> borders_mm = BorderLengths(pieces.largest);
  if (const std::int64_t handles = HandlesOf(pieces.largest, borders_mm.size()); handles > 0) {
    return fmt::format(
        "it goes round in {} handles; if it is a ring, take parameters: torus with closure: "
        "periodic_uv, else "
        "{}",
        handles, kInstead);
  }
  const double side_mm = std::sqrt(Area(pieces.largest));
  if (borders_mm.empty() || borders_mm[0] < kShortest * side_mm) {
    return fmt::format(
        "it is closed, or nearly so: its longest border has {:.3g} mm, of an area of {:.3g} mm "
        "times {:.3g} mm; take parameters: sphere with closure: periodic_u, or {}",
        borders_mm.empty() ? 0 : borders_mm[0], side_mm, side_mm, kInstead);
  }
  if (borders_mm.size() > 1 && borders_mm[1] > kSecondLongest * borders_mm[0]) {
    return fmt::format(
        "it has two long borders, of {:.3g} and {:.3g} mm, as a tube has; if it is one, take "
        "parameters: cylinder with closure: periodic_u, else {}",
        borders_mm[0], borders_mm[1], kInstead);
  }
  return "";
}

// Towards the axis that most of it faces, on balance.
void TurnForward(TriMesh& mesh) {
  Vec3 sum = Vec3::Zero();
  for (const Triangle& t : mesh.triangles) {
    sum += TriangleAreaVector(mesh, t);
  }
  Eigen::Index largest = 0;
  sum.cwiseAbs().maxCoeff(&largest);
  if (sum[largest] < 0) {
    for (Triangle& t : mesh.triangles) {
      std::swap(t[1], t[2]);
    }
  }
}

// The front begins anywhere, and lists its triangles and their corners as the memory has it.
void PutInOrder(std::vector<Triangle>& triangles) {
  for (Triangle& t : triangles) {
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  }
  std::sort(triangles.begin(), triangles.end());
}

}  // namespace

PointSheet SheetBetween(const EvenPoints& points) {
  const TriMesh all = FrontOver(points);
  if (all.triangles.empty()) {
    return {.mesh = {}, .fault = fmt::format("no triangles are found between them; {}", kInstead)};
  }
  Pieces pieces = PiecesOf(all);
  PointSheet sheet{.mesh = {}, .fault = FaultOf(pieces)};
  if (sheet.fault.empty()) {
    TurnForward(pieces.largest);
    PutInOrder(pieces.largest.triangles);
    sheet.mesh = std::move(pieces.largest);
  }
  return sheet;
}

}  // namespace semblance
