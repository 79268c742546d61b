// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/parameters/mesh_map.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/border.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_parameterization/ARAP_parameterizer_3.h>
#include <CGAL/Surface_mesh_parameterization/Barycentric_mapping_parameterizer_3.h>
#include <CGAL/Surface_mesh_parameterization/LSCM_parameterizer_3.h>
#include <CGAL/Surface_mesh_parameterization/Mean_value_coordinates_parameterizer_3.h>
#include <CGAL/Surface_mesh_parameterization/Square_border_parameterizer_3.h>
#include <CGAL/Surface_mesh_parameterization/parameterize.h>
#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <string>
#include <utility>

#include "fitting/folds/fold_check.h"
#include "surfaces/base/error.h"

namespace semblance::fitting {
namespace {

namespace layout = CGAL::Surface_mesh_parameterization;
namespace processing = CGAL::Polygon_mesh_processing;
using LayoutKernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using LayoutMesh = CGAL::Surface_mesh<LayoutKernel::Point_3>;
using Vertex = LayoutMesh::Vertex_index;
using Border = LayoutMesh::Halfedge_index;
using PositionMap = LayoutMesh::Property_map<Vertex, LayoutKernel::Point_2>;

[[noreturn]] void FailLayout(const std::string& what) {
  throw InputError("parameters: the mesh cannot be laid out on the plane: " + what);
}

void CheckOnePiece(const TriMesh& mesh) {
  std::vector<char> used(mesh.points.size(), 0);
  for (const Triangle& t : mesh.triangles) {
    used[t[0]] = used[t[1]] = used[t[2]] = 1;
  }
  if (const auto loose = std::count(used.begin(), used.end(), 0); loose > 0) {
    FailLayout(fmt::format("{} of its {} points belong to no triangle; remove them", loose,
                           mesh.points.size()));
  }
  if (const int pieces = ConnectedComponents(mesh).count; pieces != 1) {
    FailLayout(fmt::format("it has {} pieces; keep one", pieces));
  }
}

LayoutMesh HalfedgesOf(const TriMesh& mesh) {
  CheckOnePiece(mesh);
  std::vector<LayoutKernel::Point_3> points;
  points.reserve(mesh.points.size());
  for (const Vec3& p : mesh.points) {
    points.emplace_back(p.x(), p.y(), p.z());
  }
  std::vector<std::array<std::size_t, 3>> corners;
  corners.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    corners.push_back({static_cast<std::size_t>(t[0]), static_cast<std::size_t>(t[1]),
                       static_cast<std::size_t>(t[2])});
  }
  if (!processing::is_polygon_soup_a_polygon_mesh(corners)) {
    const EdgeReport edges = CheckEdges(mesh);
    FailLayout(
        fmt::format("it is not a consistently oriented manifold ({} edges with more than two "
                    "triangles, {} with two that run against each other, or triangles that meet in "
                    "a point alone); repair it first",
                    edges.non_manifold, edges.inconsistent));
  }
  LayoutMesh halfedges;
  processing::polygon_soup_to_polygon_mesh(points, corners, halfedges);
  return halfedges;
}

double LengthOf(const LayoutMesh& mesh, Border border) {
  double length = 0;
  for (const Border h : CGAL::halfedges_around_face(border, mesh)) {
    length +=
        std::sqrt(CGAL::squared_distance(mesh.point(mesh.source(h)), mesh.point(mesh.target(h))));
  }
  return length;
}

// Returns the longest border, and fills the others with triangles between their points.
Border OnlyBorder(LayoutMesh& mesh) {
  std::vector<Border> borders;
  processing::extract_boundary_cycles(mesh, std::back_inserter(borders));
  if (borders.empty()) {
    FailLayout(
        "it is closed and has no border; cut it open, or give the columns u and v with parameters: "
        "given");
  }
  const auto longest = std::max_element(
      borders.begin(), borders.end(),
      [&](const Border& a, const Border& b) { return LengthOf(mesh, a) < LengthOf(mesh, b); });
  for (const Border& hole : borders) {
    if (hole != *longest) {
      std::vector<LayoutMesh::Face_index> patch;
      processing::triangulate_hole(mesh, hole, std::back_inserter(patch));
      if (patch.empty()) {
        FailLayout("a hole in it cannot be bridged; fill it first");
      }
    }
  }
  const auto count = [](auto n) { return static_cast<long long>(n); };
  if (const long long euler = count(mesh.number_of_vertices()) - count(mesh.number_of_edges()) +
                              count(mesh.number_of_faces());
      euler != 1) {
    FailLayout(fmt::format("it has {} handles; cut them open", (1 - euler) / 2));
  }
  return *longest;
}

// The four vertices of the border that lie farthest towards the corners of its rectangle, in CGAL's
// order around the border; nothing if two of them are the same.
std::optional<std::array<Vertex, 4>> CornersOf(const LayoutMesh& mesh, Border border) {
  std::vector<Vertex> around;
  std::vector<Vec3> places;
  Vec3 mean = Vec3::Zero();
  for (const Border h : CGAL::halfedges_around_face(border, mesh)) {
    around.push_back(mesh.source(h));
    const LayoutKernel::Point_3& p = mesh.point(around.back());
    places.emplace_back(p.x(), p.y(), p.z());
    mean += places.back();
  }
  mean /= static_cast<double>(places.size());
  Mat3 moments = Mat3::Zero();
  for (const Vec3& p : places) {
    moments += (p - mean) * (p - mean).transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(moments);
  std::vector<std::size_t> corners;
  for (const double u : {-1.0, 1.0}) {
    for (const double v : {-1.0, 1.0}) {
      const Vec3 towards =
          u * eigen.eigenvectors().col(2) / std::sqrt(std::max(eigen.eigenvalues()[2], 1e-300)) +
          v * eigen.eigenvectors().col(1) / std::sqrt(std::max(eigen.eigenvalues()[1], 1e-300));
      const auto farthest = std::max_element(
          places.begin(), places.end(),
          [&](const Vec3& a, const Vec3& b) { return towards.dot(a) < towards.dot(b); });
      corners.push_back(static_cast<std::size_t>(farthest - places.begin()));
    }
  }
  std::sort(corners.begin(), corners.end());
  if (std::adjacent_find(corners.begin(), corners.end()) != corners.end()) {
    return std::nullopt;
  }
  return std::array<Vertex, 4>{around[corners[0]], around[corners[1]], around[corners[2]],
                               around[corners[3]]};
}

using SquareBorder = layout::Square_border_arc_length_parameterizer_3<LayoutMesh>;

SquareBorder SquareOf(const LayoutMesh& mesh, Border border) {
  const auto corners = CornersOf(mesh, border);
  return corners ? SquareBorder((*corners)[0], (*corners)[1], (*corners)[2], (*corners)[3])
                 : SquareBorder();
}

layout::Error_code Parameterize(LayoutMesh& mesh, Border border, MeshMap map, PositionMap places) {
  switch (map) {
    case MeshMap::kLscm:
      return layout::parameterize(mesh, layout::LSCM_parameterizer_3<LayoutMesh>(), border, places);
    case MeshMap::kMeanValue:
      return layout::parameterize(
          mesh,
          layout::Mean_value_coordinates_parameterizer_3<LayoutMesh, SquareBorder>(
              SquareOf(mesh, border)),
          border, places);
    case MeshMap::kTutte:
      return layout::parameterize(
          mesh,
          layout::Barycentric_mapping_parameterizer_3<LayoutMesh, SquareBorder>(
              SquareOf(mesh, border)),
          border, places);
    default:
      return layout::parameterize(mesh, layout::ARAP_parameterizer_3<LayoutMesh>(), border, places);
  }
}

double SignedArea(const TriMesh& mesh, const std::vector<Vec2>& at) {
  double area = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec2 a = at[t[1]] - at[t[0]], b = at[t[2]] - at[t[0]];
    area += (a.x() * b.y() - a.y() * b.x()) / 2;
  }
  return area;
}

// Rotates the layout so that its longest side lies along the first axis.
void TurnLengthwise(std::vector<Vec2>& at) {
  Vec2 mean = Vec2::Zero();
  for (const Vec2& p : at) {
    mean += p / static_cast<double>(at.size());
  }
  Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
  for (const Vec2& p : at) {
    moments += (p - mean) * (p - mean).transpose();
  }
  Vec2 along = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(moments).eigenvectors().col(1);
  along *= along.x() + along.y() < 0 ? -1 : 1;
  for (Vec2& p : at) {
    p = Vec2((p - mean).dot(along), (p - mean).dot(Vec2(-along.y(), along.x())));
  }
}

std::vector<Vec2> Places(const TriMesh& mesh, LayoutMesh& halfedges, Border border, MeshMap map) {
  const PositionMap places =
      halfedges.add_property_map<Vertex, LayoutKernel::Point_2>("v:place").first;
  const layout::Error_code error = Parameterize(halfedges, border, map, places);
  std::vector<Vec2> at;
  for (std::size_t k = 0; k < mesh.points.size(); ++k) {
    const LayoutKernel::Point_2& p = places[Vertex(static_cast<Vertex::size_type>(k))];
    at.emplace_back(p.x(), p.y());
  }
  const double area = SignedArea(mesh, at);
  if (error != layout::OK || !std::isfinite(area) || area == 0) {
    FailLayout(
        fmt::format("'{}' failed ({})", EnumNames(map)[static_cast<std::size_t>(map)],
                    error == layout::OK ? "no area is left" : layout::get_error_message(error)));
  }
  const double scale = std::sqrt(Area(mesh) / std::abs(area));
  for (Vec2& p : at) {
    p = scale * Vec2(p.x(), area < 0 ? -p.y() : p.y());
  }
  if (map == MeshMap::kArap || map == MeshMap::kLscm) {
    TurnLengthwise(at);
  }
  return at;
}

}  // namespace

MeshLayout LayOut(const TriMesh& mesh, MeshMap map) {
  // Largest share of the area that ARAP may fold. Mean-value coordinates do not fold but distort
  // more.
  constexpr double kMostFolded = 0.002;
  LayoutMesh halfedges = HalfedgesOf(mesh);
  const Border border = OnlyBorder(halfedges);
  if (map != MeshMap::kAuto) {
    return {.at = Places(mesh, halfedges, border, map), .map = map};
  }
  std::vector<Vec2> rigid = Places(mesh, halfedges, border, MeshMap::kArap);
  const PlaneMap plane{.positions = mesh.points, .at = rigid};
  if (FaultsOfTriangles(plane, mesh.triangles).folded <= kMostFolded &&
      FaultsOfPoints(plane).folded <= kMostFolded) {
    return {.at = std::move(rigid), .map = MeshMap::kArap};
  }
  return {.at = Places(mesh, halfedges, border, MeshMap::kMeanValue), .map = MeshMap::kMeanValue};
}

}  // namespace semblance::fitting
