// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/on_surface/coarse_surface.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <queue>
#include <utility>

#include "surfaces/mesh/mesh_query.h"

namespace semblance::interp {
namespace {

constexpr double kSameWay_mm = 1e-6;  // round-off: of two equally long paths the first counts
constexpr double kUnreached = std::numeric_limits<double>::infinity();

// Divides the skull into cells. In index order, each vertex that is in no cell yet becomes the
// center of a new one.
class Cover {
 public:
  Cover(const TriMesh& skull, double edge_mm, const RunContext& run)
      : skull_(skull),
        around_(skull),
        way_mm_(skull.points.size(), kUnreached),
        cell(skull.points.size(), -1) {
    for (int v = 0; v < static_cast<int>(cell.size()); ++v) {
      if (cell[v] < 0) {
        run.ThrowIfStopped();
        Grow(v, edge_mm);
      }
    }
  }

 private:
  // Makes the cell of v: the vertices within edge_mm of v that are nearer to v than to earlier
  // centers.
  void Grow(int v, double edge_mm) {
    const auto index = static_cast<int>(centers.size());
    centers.push_back(v);
    Offer(v, 0, index);
    while (!open_.empty()) {
      const auto [way_mm, at] = open_.top();
      open_.pop();
      if (way_mm > way_mm_[at]) {
        continue;
      }
      for (const int t : around_.At(at)) {
        for (const int to : skull_.triangles[t]) {
          const double on_mm = way_mm + (skull_.points[to] - skull_.points[at]).norm();
          if (on_mm <= edge_mm) {
            Offer(to, on_mm, index);
          }
        }
      }
    }
  }

  void Offer(int vertex, double way_mm, int index) {
    if (way_mm < way_mm_[vertex] - kSameWay_mm) {
      way_mm_[vertex] = way_mm;
      cell[vertex] = index;
      open_.emplace(way_mm, vertex);
    }
  }

  using Entry = std::pair<double, int>;
  const TriMesh& skull_;
  VertexTriangles around_;
  std::vector<double> way_mm_;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open_;

 public:
  std::vector<int> cell;     // per vertex
  std::vector<int> centers;  // per cell
};

// Makes one triangle for each three cells that meet.
std::vector<Triangle> DualTriangles(const TriMesh& skull, const std::vector<int>& cell) {
  std::vector<std::pair<Triangle, Triangle>> found;  // sorted corners, and oriented corners
  for (const Triangle& t : skull.triangles) {
    const Triangle dual = {cell[t[0]], cell[t[1]], cell[t[2]]};
    if (dual[0] != dual[1] && dual[1] != dual[2] && dual[2] != dual[0]) {
      Triangle sorted = dual;
      std::ranges::sort(sorted);
      found.emplace_back(sorted, dual);
    }
  }
  std::ranges::stable_sort(found, {}, &std::pair<Triangle, Triangle>::first);
  std::vector<Triangle> triangles;
  for (std::size_t k = 0; k < found.size(); ++k) {
    if (k == 0 || found[k].first != found[k - 1].first) {
      triangles.push_back(found[k].second);
    }
  }
  return triangles;
}

}  // namespace

VertexTriangles::VertexTriangles(const TriMesh& mesh)
    : first_(mesh.points.size() + 1, 0), triangles_(3 * mesh.triangles.size()) {
  for (const Triangle& t : mesh.triangles) {
    for (const int v : t) {
      ++first_[v + 1];
    }
  }
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  std::vector<int> next = first_;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const int v : mesh.triangles[t]) {
      triangles_[next[v]++] = static_cast<int>(t);
    }
  }
}

int NearestCorner(const TriMesh& mesh, const MeshPoint& on) {
  return *std::ranges::min_element(mesh.triangles[on.triangle], {}, [&](int i) {
    return std::pair((mesh.points[i] - on.position).squaredNorm(), i);
  });
}

CoarseSurface::CoarseSurface(const TriMesh& skull, double edge_mm, const RunContext& run) {
  Cover cover(skull, edge_mm, run);
  for (const int center : cover.centers) {
    mesh_.points.push_back(skull.points[center]);
  }
  mesh_.triangles = DualTriangles(skull, cover.cell);
  cell_ = std::move(cover.cell);
  triangles_at_ = VertexTriangles(mesh_);
}

CornerWeights CoarseSurface::Locate(const Vec3& p, int skull_vertex) const {
  const int center = cell_[skull_vertex];
  CornerWeights best{{center, center, center}, {1, 0, 0}};
  double least = kUnreached;
  for (const int t : triangles_at_.At(center)) {
    const Triangle& corners = mesh_.triangles[t];
    const TrianglePoint on = ClosestPointOnTriangle(
        p, mesh_.points[corners[0]], mesh_.points[corners[1]], mesh_.points[corners[2]]);
    const double distance = (on.position - p).norm();
    if (distance < least) {
      least = distance;
      best = {{corners[0], corners[1], corners[2]}, on.weights};
    }
  }
  return best;
}

}  // namespace semblance::interp
