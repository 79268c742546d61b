// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/triangulation/sheet_places.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "surfaces/mesh/mesh_query.h"

namespace semblance {
namespace {

using Neighbours = std::vector<std::vector<std::int32_t>>;  // per point, ascending

Neighbours AlongEdges(const TriMesh& mesh) {
  Neighbours around(mesh.points.size());
  for (const Triangle& t : mesh.triangles) {
    for (const int k : {0, 1, 2}) {
      around[t[k]].push_back(t[(k + 1) % 3]);
      around[t[k]].push_back(t[(k + 2) % 3]);
    }
  }
  for (std::vector<std::int32_t>& some : around) {
    std::sort(some.begin(), some.end());
    some.erase(std::unique(some.begin(), some.end()), some.end());
  }
  return around;
}

// That two edges reach, and the point itself.
std::vector<std::int32_t> WithinTwoEdges(const Neighbours& around, std::int32_t point) {
  std::vector<std::int32_t> within = around[point];
  for (const std::int32_t n : around[point]) {
    within.insert(within.end(), around[n].begin(), around[n].end());
  }
  within.push_back(point);
  std::sort(within.begin(), within.end());
  within.erase(std::unique(within.begin(), within.end()), within.end());
  return within;
}

using Powers = Eigen::Matrix<double, 6, 1>;

Powers PowersOf(const Vec2& q) {
  Powers powers;
  powers << 1, q.x(), q.y(), q.x() * q.x(), q.x() * q.y(), q.y() * q.y();
  return powers;
}

// The layout near a corner.
struct LocalMap {
  Vec3 origin = Vec3::Zero();
  Eigen::Matrix<double, 2, 3> along = Eigen::Matrix<double, 2, 3>::Zero();  // over the scale
  Eigen::Matrix<double, 2, 6> coefficients = Eigen::Matrix<double, 2, 6>::Zero();

  Vec2 operator()(const Vec3& p) const { return coefficients * PowersOf(along * (p - origin)); }
};

Eigen::Matrix<double, 2, 3> TangentsAt(const Vec3& normal, double scale_mm) {
  const Vec3 first = normal.unitOrthogonal();
  Eigen::Matrix<double, 2, 3> along;
  along << first.transpose() / scale_mm, normal.cross(first).transpose() / scale_mm;
  return along;
}

// A plane alone where there are few corners.
LocalMap MapAround(const TriMesh& mesh, std::span<const Vec2> at, const Neighbours& around,
                   const Vec3& normal, std::int32_t point) {
  constexpr int kFewest = 10;
  const std::vector<std::int32_t> within = WithinTwoEdges(around, point);
  double scale_mm = 0;
  for (const std::int32_t n : within) {
    scale_mm = std::max(scale_mm, (mesh.points[n] - mesh.points[point]).norm());
  }
  LocalMap map{.origin = mesh.points[point], .along = TangentsAt(normal, scale_mm)};
  const Eigen::Index rows = static_cast<Eigen::Index>(within.size()),
                     columns = rows < kFewest ? 3 : 6;
  Eigen::MatrixXd powers(rows, columns);
  Eigen::MatrixX2d places(rows, 2);
  for (Eigen::Index k = 0; k < rows; ++k) {
    const Vec3& p = mesh.points[within[k]];
    const double weight = std::exp(-(p - map.origin).squaredNorm() / (scale_mm * scale_mm));
    powers.row(k) = weight * PowersOf(map.along * (p - map.origin)).head(columns).transpose();
    places.row(k) = weight * at[within[k]].transpose();
  }
  map.coefficients.leftCols(columns) = powers.colPivHouseholderQr().solve(places).transpose();
  return map;
}

std::vector<LocalMap> MapsOf(const TriMesh& mesh, std::span<const Vec2> at) {
  const Neighbours around = AlongEdges(mesh);
  const std::vector<Vec3> normals = VertexNormals(mesh);
  std::vector<LocalMap> maps;
  for (std::size_t k = 0; k < mesh.points.size(); ++k) {
    maps.push_back(MapAround(mesh, at, around, normals[k], static_cast<std::int32_t>(k)));
  }
  return maps;
}

double LongestEdge(const TriMesh& mesh, const Triangle& t) {
  double longest_mm = 0;
  for (const int k : {0, 1, 2}) {
    longest_mm = std::max(longest_mm, (mesh.points[t[k]] - mesh.points[t[(k + 1) % 3]]).norm());
  }
  return longest_mm;
}

}  // namespace

SheetPlaces PlacesOnSheet(const TriMesh& mesh, std::span<const Vec2> at,
                          std::span<const Vec3> points) {
  const std::vector<LocalMap> maps = MapsOf(mesh, at);
  const MeshQuery query(mesh);
  SheetPlaces places;
  for (const Vec3& p : points) {
    const MeshPoint nearest = query.Closest(p);
    const Triangle& t = mesh.triangles[nearest.triangle];
    const double most_mm = LongestEdge(mesh, t);
    const Vec3 off = p - nearest.position;
    const Vec3 looked =
        nearest.position + std::min(1.0, most_mm / std::max(nearest.distance_mm, most_mm)) * off;
    Vec2 place = Vec2::Zero();
    for (const int k : {0, 1, 2}) {
      place += nearest.weights[k] * maps[t[k]](looked);
    }
    places.at.push_back(place);
    places.distance_mm.push_back(nearest.distance_mm);
  }
  return places;
}

}  // namespace semblance
