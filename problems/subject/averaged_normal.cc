// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/averaged_normal.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <vector>

namespace semblance {
namespace {

constexpr int kMaxSplits = 14;

// The area of the triangle inside the ball, by splitting where the ball's surface may cut it.
double AreaInside(const Vec3& a, const Vec3& b, const Vec3& c, const Sphere& ball, int splits) {
  const Vec3 center = (a + b + c) / 3;
  const double reach = std::sqrt(std::max(
      {(a - center).squaredNorm(), (b - center).squaredNorm(), (c - center).squaredNorm()}));
  const double distance = (center - ball.center).norm();
  if (distance > ball.radius_mm + reach) {
    return 0;
  }
  const bool whole = distance + reach <= ball.radius_mm;
  if (whole || splits == 0 || reach < ball.radius_mm / 16) {
    return distance <= ball.radius_mm ? (b - a).cross(c - a).norm() / 2 : 0;
  }
  const Vec3 ab = (a + b) / 2, bc = (b + c) / 2, ca = (c + a) / 2;
  return AreaInside(a, ab, ca, ball, splits - 1) + AreaInside(ab, b, bc, ball, splits - 1) +
         AreaInside(ca, bc, c, ball, splits - 1) + AreaInside(ab, bc, ca, ball, splits - 1);
}

double AreaInside(const TriMesh& mesh, int t, const Sphere& ball) {
  const Triangle& triangle = mesh.triangles[t];
  Box3 box;
  for (const auto p : triangle) {
    box.extend(mesh.points[p]);
  }
  if (box.squaredExteriorDistance(ball.center) > ball.radius_mm * ball.radius_mm) {
    return 0;  // nearly all triangles of a mesh
  }
  return AreaInside(mesh.points[triangle[0]], mesh.points[triangle[1]], mesh.points[triangle[2]],
                    ball, kMaxSplits);
}

// Of each triangle that reaches into the ball, and of `first`.
std::map<int, double> AreasInside(const TriMesh& mesh, int first, const Sphere& ball) {
  std::map<int, double> areas;
  for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t) {
    const double area = AreaInside(mesh, t, ball);
    if (area > 0 || t == first) {
      areas[t] = area;
    }
  }
  return areas;
}

// Triangles are connected at shared points, also at those outside the ball: the points of a coarse
// mesh all are.
std::map<int, std::vector<int>> TrianglesByPoint(const TriMesh& mesh,
                                                 const std::map<int, double>& areas) {
  std::map<int, std::vector<int>> by_point;
  for (const auto& [t, area] : areas) {
    for (const auto p : mesh.triangles[t]) {
      by_point[p].push_back(t);
    }
  }
  return by_point;
}

Vec3 UnitNormal(const TriMesh& mesh, int t) {
  return TriangleAreaVector(mesh, mesh.triangles[t]).normalized();  // zero stays zero
}

}  // namespace

Vec3 AveragedNormal(const TriMesh& mesh, int first, const Sphere& ball) {
  const std::map<int, double> area_inside = AreasInside(mesh, first, ball);
  const auto by_point = TrianglesByPoint(mesh, area_inside);
  const Vec3 facing = UnitNormal(mesh, first);
  const double least_cosine = facing.isZero() ? -2 : std::cos(80 * std::numbers::pi / 180);
  Vec3 sum = Vec3::Zero();
  std::vector<int> connected = {first};
  std::set<int> seen = {first};
  for (std::size_t next = 0; next < connected.size(); ++next) {
    sum += area_inside.at(connected[next]) * UnitNormal(mesh, connected[next]);
    for (const auto p : mesh.triangles[connected[next]]) {
      for (const int t : by_point.at(p)) {
        if (facing.dot(UnitNormal(mesh, t)) >= least_cosine && seen.insert(t).second) {
          connected.push_back(t);
        }
      }
    }
  }
  return sum.normalized();  // zero stays zero
}

}  // namespace semblance
