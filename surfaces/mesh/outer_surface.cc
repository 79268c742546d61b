// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/outer_surface.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "surfaces/base/parallel.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance {
namespace {

constexpr int kSides = 8;
constexpr double kTilt = 60 * std::numbers::pi / 180;
constexpr double kLift_mm = 1e-3;  // off the triangle itself

// The normal first: it is enough for most of a head.
std::array<Vec3, kSides + 1> Directions(const Vec3& normal) {
  const Vec3 side = normal.unitOrthogonal(), other = normal.cross(side);
  std::array<Vec3, kSides + 1> directions;
  directions[0] = normal;
  for (int k = 0; k < kSides; ++k) {
    const double turn = 2 * std::numbers::pi * k / kSides;
    directions[k + 1] = std::cos(kTilt) * normal +
                        std::sin(kTilt) * (std::cos(turn) * side + std::sin(turn) * other);
  }
  return directions;
}

bool IsSeen(const TriMesh& mesh, const MeshQuery& query, const Triangle& triangle,
            double far_away_mm) {
  const Vec3 area = TriangleAreaVector(mesh, triangle);
  if (area.isZero()) {
    return false;
  }
  const Vec3 normal = area.normalized();
  const Vec3 origin = TriangleCentroid(mesh, triangle) + kLift_mm * normal;
  for (const Vec3& direction : Directions(normal)) {
    if (!query.FirstHit(origin, direction, far_away_mm)) {
      return true;
    }
  }
  return false;
}

}  // namespace

std::vector<bool> SeenFromOutside(const TriMesh& mesh, int threads) {
  const MeshQuery query(mesh);
  const double far_away_mm = Bounds(mesh).diagonal().norm();
  std::vector<std::uint8_t> seen(mesh.triangles.size());  // bytes: threads may write neighbours
  ParallelFor(seen.size(), threads, 256, [&](std::size_t t) {
    seen[t] = IsSeen(mesh, query, mesh.triangles[t], far_away_mm) ? 1 : 0;
  });
  return {seen.begin(), seen.end()};
}

}  // namespace semblance
