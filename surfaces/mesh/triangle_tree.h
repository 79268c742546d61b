// SPDX-License-Identifier: GPL-3.0-or-later
// A hierarchy of boxes over the triangles of a mesh. Each box is split across its longest side into
// two parts, each with at least a quarter of its triangles. Closest points and rays look only into
// boxes that can hold a better answer than the best one so far.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance::surfaces {

// A place where a ray meets a triangle.
struct RayHit {
  double along = kNaN;  // from the origin, in lengths of the direction
  int triangle = -1;
  Vec3 weights = Vec3::Constant(kNaN);  // of the triangle's corners; >= 0, sum 1
};

class TriangleTree {
 public:
  // The mesh must have a triangle, and its points must be finite.
  explicit TriangleTree(const TriMesh& mesh);

  // The triangle nearest to p. It takes the one with the lowest index if several have exactly the
  // same distance, as at a corner.
  int Nearest(const Vec3& p) const;

  // The triangles of all leaves within distance_mm of p, unordered.
  std::vector<int> Near(const Vec3& p, double distance_mm) const;

  // The hits with `along` from 0 to 1, unordered. A ray in the plane of a triangle, or a triangle
  // without area, has no hit. A ray through an edge hits all triangles of the edge: none slips
  // through between two triangles (Woop, Benthin & Wald 2013).
  std::vector<RayHit> AllHits(const Vec3& origin, const Vec3& direction) const;

  // The hit with the smallest `along`, then the lowest index; triangle -1 if there is none.
  RayHit FirstHit(const Vec3& origin, const Vec3& direction) const;

  const std::array<Vec3, 3>& Corners(int triangle) const { return corners_[place_[triangle]]; }

 private:
  static constexpr int kLeafTriangles = 4;
  static constexpr int kMostLevels = 80;  // 2^31 triangles, at least a quarter on each side

  // A box in single precision, rounded outwards: half the memory, and twice as many in the cache.
  struct Node {
    std::array<float, 3> low, high;
    // Index of the second part's node; the first part follows its parent. A leaf has the index of
    // its first triangle here.
    std::int32_t next = 0;
    std::int32_t count = 0;  // number of a leaf's triangles; 0: the node has parts

    double SquaredDistance(const Vec3& p) const;
  };
  struct Item {
    Vec3 centre;
    std::int32_t triangle;
  };
  struct Ray;

  static std::size_t Split(std::vector<Item>& items, std::size_t begin, std::size_t end);
  std::int32_t Build(const TriMesh& mesh, std::vector<Item>& items, std::size_t begin,
                     std::size_t end);
  template <class Visit>
  void VisitHits(const Ray& ray, const Visit& visit) const;

  double margin_mm_;  // of the boxes
  std::vector<Node> nodes_;
  std::vector<std::array<Vec3, 3>> corners_;  // of the triangles, leaf by leaf
  std::vector<std::int32_t> triangle_;        // index in the mesh, per entry of corners_
  std::vector<std::int32_t> place_;           // the inverse
};

}  // namespace semblance::surfaces
