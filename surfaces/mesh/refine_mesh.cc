// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/refine_mesh.h"

#include <algorithm>
#include <map>
#include <utility>

namespace semblance::surfaces {
namespace {

// Over the triangles' sides, so that an edge of two triangles counts twice.
double MeanEdge_mm(const TriMesh& mesh) {
  double sum_mm = 0;
  for (const Triangle& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      sum_mm += (mesh.points[t[k]] - mesh.points[t[(k + 1) % 3]]).norm();
    }
  }
  return sum_mm / (3.0 * static_cast<double>(std::max<std::size_t>(mesh.triangles.size(), 1)));
}

// The points between the corners of a mesh's triangles, each added to the mesh once.
class Middles {
 public:
  explicit Middles(TriMesh& mesh) : mesh_(mesh) {}

  std::int32_t Between(std::int32_t a, std::int32_t b) {
    const auto [found, is_new] = index_.try_emplace(std::pair(std::min(a, b), std::max(a, b)),
                                                    static_cast<std::int32_t>(mesh_.points.size()));
    if (is_new) {
      const Vec3 middle = (mesh_.points[a] + mesh_.points[b]) / 2;
      mesh_.points.push_back(middle);
    }
    return found->second;
  }

 private:
  TriMesh& mesh_;
  std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> index_;
};

void Quarter(TriMesh& mesh) {
  Middles middles(mesh);
  std::vector<Triangle> quarters;
  quarters.reserve(4 * mesh.triangles.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    const std::int32_t ab = middles.Between(a, b), bc = middles.Between(b, c),
                       ca = middles.Between(c, a);
    quarters.insert(quarters.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
  }
  mesh.triangles = std::move(quarters);
}

}  // namespace

TriMesh RefineTo(TriMesh mesh, double mean_edge_mm) {
  constexpr std::size_t kMost = 250000;  // bounds memory and time for meshes of another unit
  while (MeanEdge_mm(mesh) > mean_edge_mm && mesh.triangles.size() <= kMost) {
    Quarter(mesh);
  }
  return mesh;
}

}  // namespace semblance::surfaces
