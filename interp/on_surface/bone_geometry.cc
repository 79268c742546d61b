// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/on_surface/bone_geometry.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/convex_hull_3.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <string>

#include "interp/dowels/dowel.h"
#include "interp/on_surface/matern_field.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::interp {
namespace {

using HullKernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using HullMesh = CGAL::Surface_mesh<HullKernel::Point_3>;

// The convex hull; its flat faces, which may have many corners, become fans of triangles.
TriMesh ConvexHull(const TriMesh& mesh) {
  std::vector<HullKernel::Point_3> points;
  for (const Vec3& p : mesh.points) {
    points.emplace_back(p.x(), p.y(), p.z());
  }
  HullMesh hull;
  CGAL::convex_hull_3(points.begin(), points.end(), hull);
  TriMesh result;
  for (const auto v : hull.vertices()) {
    const HullKernel::Point_3& p = hull.point(v);
    result.points.emplace_back(p.x(), p.y(), p.z());
  }
  for (const auto f : hull.faces()) {
    std::vector<std::int32_t> corners;
    for (const auto v : CGAL::vertices_around_face(hull.halfedge(f), hull)) {
      corners.push_back(static_cast<std::int32_t>(v));
    }
    for (std::size_t k = 2; k < corners.size(); ++k) {
      result.triangles.push_back({corners[0], corners[k - 1], corners[k]});
    }
  }
  return result;
}

std::map<std::string, Vec3> BasesBySite(std::span<const Dowel> dowels) {
  std::map<std::string, Vec3> bases;
  for (const Dowel& dowel : dowels) {
    bases.emplace(dowel.site, dowel.base);
  }
  return bases;
}

// The sum of the vectors from right to left over pairs; zero without a pair.
Vec3 LeftOfPairs(const std::map<std::string, Vec3>& bases) {
  Vec3 sum = Vec3::Zero();
  for (const auto& [site, base] : bases) {
    const auto right = bases.find(WithoutSide(site) + "_r");
    if (SideOfSite(site) == Side::kLeft && right != bases.end()) {
      sum += base - right->second;
    }
  }
  return sum;
}

// The direction to the left, normal to the plane of the midline dowels; zero with fewer than three
// of them, or none beside them.
Vec3 LeftOfMidline(std::span<const Dowel> dowels) {
  std::vector<Vec3> midline;
  for (const Dowel& dowel : dowels) {
    if (SideOfSite(dowel.site) == Side::kMidline) {
      midline.push_back(dowel.base);
    }
  }
  if (midline.size() < 3) {
    return Vec3::Zero();
  }
  const Vec3 mean = std::accumulate(midline.begin(), midline.end(), Vec3(Vec3::Zero())) /
                    static_cast<double>(midline.size());
  Mat3 spread = Mat3::Zero();
  for (const Vec3& p : midline) {
    spread += (p - mean) * (p - mean).transpose();
  }
  const Vec3 across = Eigen::SelfAdjointEigenSolver<Mat3>(spread).eigenvectors().col(0);
  double to_left = 0;
  for (const Dowel& dowel : dowels) {
    const Side side = SideOfSite(dowel.site);
    const double sign = side == Side::kLeft ? 1 : side == Side::kRight ? -1 : 0;
    to_left += sign * (dowel.base - mean).dot(across);
  }
  return to_left * across;
}

std::vector<Vec3> FindOrbits(const std::map<std::string, Vec3>& bases) {
  std::vector<Vec3> centers;
  for (const char* side : {"_l", "_r"}) {
    const auto above = bases.find(std::string("mso") + side),
               below = bases.find(std::string("mio") + side);
    const bool is_above = above != bases.end(), is_below = below != bases.end();
    if (is_above || is_below) {
      centers.emplace_back(
          ((is_above ? above : below)->second + (is_below ? below : above)->second) / 2);
    }
  }
  return centers;
}

Vec3 MeanBase(std::span<const Dowel> dowels) {
  Vec3 sum = Vec3::Zero();
  for (const Dowel& dowel : dowels) {
    sum += dowel.base;
  }
  return sum / static_cast<double>(dowels.size());
}

}  // namespace

HeadFrame FindHeadFrame(std::span<const Dowel> dowels) {
  const std::map<std::string, Vec3> bases = BasesBySite(dowels);
  const Vec3 of_pairs = LeftOfPairs(bases);
  const Vec3 leftward = of_pairs.norm() > 0 ? of_pairs : LeftOfMidline(dowels);
  HeadFrame frame;
  frame.left = leftward.normalized();
  Vec3 forward = Vec3::Zero();
  for (const Dowel& dowel : dowels) {
    forward += dowel.direction - dowel.direction.dot(frame.left) * frame.left;
  }
  if (!(leftward.norm() > 0) || !(forward.norm() > 0)) {
    throw InputError(
        "the axes of the head need a pair of dowels (left and right), or three in the midline and "
        "one beside it; place them, or choose another mean");
  }
  frame.front = forward.normalized();
  frame.up = frame.front.cross(frame.left);
  frame.orbits = FindOrbits(bases);
  if (frame.orbits.empty()) {
    frame.orbits = {MeanBase(dowels)};
  }
  return frame;
}

Eigen::MatrixXd BoneGeometry(const TriMesh& mesh, const HeadFrame& frame) {
  const std::vector<Vec3> normals = VertexNormals(mesh);
  const MeshQuery hull(ConvexHull(mesh));
  Eigen::MatrixXd geometry(kBoneGeometry, std::ssize(mesh.points));
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    const Vec3& p = mesh.points[v];
    double orbit_mm = std::numeric_limits<double>::infinity();
    for (const Vec3& center : frame.orbits) {
      orbit_mm = std::min(orbit_mm, (p - center).norm());
    }
    geometry.col(static_cast<Eigen::Index>(v)) << hull.Closest(p).distance_mm,
        normals[v].dot(frame.front), normals[v].dot(frame.up), orbit_mm;
  }
  return geometry;
}

Eigen::MatrixXd BoneRelief(const TriMesh& mesh, std::span<const double> scales_mm) {
  const std::vector<Vec3> normals = VertexNormals(mesh);
  const MeshLaplacian laplacian = BuildLaplacian(mesh);
  const auto count = std::ssize(mesh.points);
  Eigen::MatrixXd points(count, 3);
  for (Eigen::Index i = 0; i < count; ++i) {
    points.row(i) = mesh.points[static_cast<std::size_t>(i)].transpose();
  }
  Eigen::MatrixXd relief(std::ssize(scales_mm), count);
  for (std::size_t k = 0; k < scales_mm.size(); ++k) {
    const double shift = 1 / (scales_mm[k] * scales_mm[k]);
    const MeshSolver solver(mesh.points, ShiftedStiffness(laplacian, shift));
    const Eigen::MatrixXd smooth = solver.Solve(shift * (laplacian.area_mm2.asDiagonal() * points));
    for (Eigen::Index i = 0; i < count; ++i) {
      relief(static_cast<Eigen::Index>(k), i) =
          (smooth.row(i) - points.row(i)).dot(normals[static_cast<std::size_t>(i)]);
    }
  }
  return relief;
}
}  // namespace semblance::interp
