// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/decimate/original_vertices.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "surfaces/mesh/mesh_query.h"

namespace semblance::surfaces {
namespace {

// More rounds gain little: two lower the RMS by an eighth and more (docs/explanation/implicit.md).
constexpr int kSettleRounds = 2;
// The share of a step that is taken. Neighbours move in the same round, so a whole step would
// overshoot.
constexpr double kSettleShare = 0.5;
// Holds a point in directions in which no triangle faces.
constexpr double kSettleDamping = 0.01;
constexpr double kMinTurnCosine = 0.5;  // 60 degrees, as in a collapse

// The pull of the original vertices on a point, as the normal equations of sum (h - w n . step)^2.
// Here n is a triangle's normal, h the height of an original vertex over its plane, and w the
// point's weight at the foot of the vertex.
struct Pull {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;  // sum w^2 n n'
  Vec3 right = Vec3::Zero();                              // sum w h n
  double most_mm = 0;                                     // the largest w |h|

  void Add(const Vec3& n, double w, double height_mm) {
    const Vec3 row = w * n;
    xx += row.x() * row.x(), xy += row.x() * row.y(), xz += row.x() * row.z();
    yy += row.y() * row.y(), yz += row.y() * row.z(), zz += row.z() * row.z();
    right += height_mm * row;
    most_mm = std::max(most_mm, w * std::abs(height_mm));
  }

  Vec3 Step() const {
    const double hold = kSettleDamping * (xx + yy + zz);
    if (!(hold > 0)) {
      return Vec3::Zero();
    }
    Mat3 a;
    a << xx + hold, xy, xz, xy, yy + hold, yz, xz, yz, zz + hold;
    const Vec3 step = a.inverse() * right;
    const double length_mm = step.norm();
    return kSettleShare * (length_mm > most_mm ? most_mm / length_mm : 1.0) * step;
  }
};

// Adds the pulls of the original vertices `pulling` on the corners t of their triangle.
void AddPulls(const TriMesh& original, const std::vector<std::int32_t>& pulling, const Triangle& t,
              const std::vector<Vec3>& points, std::vector<Pull>& pulls) {
  const Vec3 &a = points[t[0]], ab = points[t[1]] - a, ac = points[t[2]] - a, m = ab.cross(ac);
  const double square = m.squaredNorm();
  if (!(square > 0)) {
    return;
  }
  const Vec3 n = m / std::sqrt(square), to_b = ac.cross(m) / square, to_c = m.cross(ab) / square;
  for (const std::int32_t v : pulling) {
    const Vec3 ap = original.points[v] - a;
    const double b = std::clamp(to_b.dot(ap), 0.0, 1.0), c = std::clamp(to_c.dot(ap), 0.0, 1 - b);
    const double height_mm = n.dot(ap);
    pulls[t[0]].Add(n, 1 - b - c, height_mm);
    pulls[t[1]].Add(n, b, height_mm);
    pulls[t[2]].Add(n, c, height_mm);
  }
}

bool TurnsTooFar(const Vec3& before, const Vec3& after) {
  return before.dot(after) < kMinTurnCosine * before.norm() * after.norm();
}

// Moves points back until no triangle turns far.
void UndoFarTurns(const std::vector<Vec3>& before, TriMesh& mesh) {
  const TriMesh was{before, {}};
  for (bool more = true; more;) {
    more = false;
    for (const Triangle& t : mesh.triangles) {
      if (TurnsTooFar(TriangleAreaVector(was, t), TriangleAreaVector(mesh, t))) {
        for (const std::int32_t v : t) {
          more = more || mesh.points[v] != before[v];
          mesh.points[v] = before[v];
        }
      }
    }
  }
}

}  // namespace

OriginalVertices::OriginalVertices(const TriMesh& mesh)
    : mesh_(mesh),
      first_(mesh.triangles.size(), -1),
      next_(mesh.points.size(), -1),
      distance_mm_(mesh.points.size(), 0),
      corner_of_(3 * mesh.triangles.size()),
      last_(mesh.points.size() + 1, 0) {
  for (const Triangle& t : mesh.triangles) {
    for (const std::int32_t v : t) {
      ++last_[v + 1];
    }
  }
  std::partial_sum(last_.begin(), last_.end(), last_.begin());
  for (std::int32_t t = 0; t < static_cast<std::int32_t>(mesh.triangles.size()); ++t) {
    for (const std::int32_t v : mesh.triangles[t]) {
      corner_of_[last_[v]++] = t;
    }
  }
  for (std::int32_t v = 0; v < static_cast<std::int32_t>(mesh.points.size()); ++v) {
    if (last_[v] > (v > 0 ? last_[v - 1] : 0)) {
      Assign(corner_of_[last_[v] - 1], v, 0);
    }
  }
}

void OriginalVertices::AppendVertices(std::int32_t triangle,
                                      std::vector<std::int32_t>& vertices) const {
  for (std::int32_t v = first_[triangle]; v >= 0; v = next_[v]) {
    vertices.push_back(v);
  }
}

void OriginalVertices::Assign(std::int32_t triangle, std::int32_t vertex, double distance_mm) {
  next_[vertex] = first_[triangle];
  first_[triangle] = vertex;
  distance_mm_[vertex] = distance_mm;
}

double OriginalVertices::LargestDistance_mm() const {
  return *std::max_element(distance_mm_.begin(), distance_mm_.end());
}

double OriginalVertices::DistanceBound_mm(const Vec3& p,
                                          const std::vector<std::int32_t>& vertices) const {
  double least = std::numeric_limits<double>::infinity();
  std::int32_t nearest = -1;
  for (const std::int32_t v : vertices) {
    const double distance2 = (mesh_.points[v] - p).squaredNorm();
    if (distance2 < least) {
      least = distance2;
      nearest = v;
    }
  }
  for (std::int32_t n = nearest > 0 ? last_[nearest - 1] : 0; nearest >= 0 && n < last_[nearest];
       ++n) {
    const Triangle& t = mesh_.triangles[corner_of_[n]];
    const Vec3 there =
        ClosestPointOnTriangle(p, mesh_.points[t[0]], mesh_.points[t[1]], mesh_.points[t[2]])
            .position;
    least = std::min(least, (there - p).squaredNorm());
  }
  return std::sqrt(least);
}

void OriginalVertices::Settle(const std::vector<std::int32_t>& triangles,
                              const std::function<bool(std::int32_t)>& is_fixed, TriMesh& left) {
  std::vector<std::int32_t> pulling;
  for (int round = 0; round < kSettleRounds; ++round) {
    std::vector<Pull> pulls(left.points.size());
    for (std::size_t n = 0; n < triangles.size(); ++n) {
      pulling.clear();
      AppendVertices(triangles[n], pulling);
      AddPulls(mesh_, pulling, left.triangles[n], left.points, pulls);
    }
    const std::vector<Vec3> before = left.points;
    for (std::int32_t v = 0; v < static_cast<std::int32_t>(before.size()); ++v) {
      if (!is_fixed(v)) {
        left.points[v] += pulls[v].Step();
      }
    }
    UndoFarTurns(before, left);
  }
  UpdateDistances(triangles, left);
}

void OriginalVertices::UpdateDistances(const std::vector<std::int32_t>& triangles,
                                       const TriMesh& left) {
  for (std::size_t n = 0; n < triangles.size(); ++n) {
    const Triangle& t = left.triangles[n];
    const Vec3 &a = left.points[t[0]], &b = left.points[t[1]], &c = left.points[t[2]];
    for (std::int32_t v = first_[triangles[n]]; v >= 0; v = next_[v]) {
      const Vec3& p = mesh_.points[v];
      distance_mm_[v] = (p - ClosestPointOnTriangle(p, a, b, c).position).norm();
    }
  }
}

}  // namespace semblance::surfaces
