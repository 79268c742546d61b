// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/on_surface/surface_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <utility>

#include "surfaces/base/parallel.h"

namespace semblance::interp {
namespace {

constexpr std::size_t kHeldTogether = 8;  // samples in memory at a time: 8 bytes per vertex each
constexpr double kFar = std::numeric_limits<double>::infinity();

// The distance at c of a wave that reached a and b from one source. The triangle is unfolded into a
// plane with the source on the other side of ab. Infinite if the straight path does not pass
// between a and b.
double ThroughEdge(const Vec3& a, double at_a, const Vec3& b, double at_b, const Vec3& c) {
  const double edge2 = (b - a).squaredNorm();
  if (edge2 == 0) {
    return kFar;
  }
  const double edge = std::sqrt(edge2);
  const double x = (c - a).dot(b - a) / edge;
  const double y = std::sqrt(std::max((c - a).squaredNorm() - x * x, 0.0));
  const double source_x = (at_a * at_a - at_b * at_b + edge2) / (2 * edge);
  const double source_y2 = at_a * at_a - source_x * source_x;
  if (source_y2 < 0) {
    return kFar;
  }
  const double source_y = std::sqrt(source_y2);
  const double height = source_y + y;
  const double crossing = height > 0 ? source_x + (x - source_x) * source_y / height : -1;
  return crossing >= 0 && crossing <= edge ? std::hypot(x - source_x, height) : kFar;
}

class FastMarching {
 public:
  explicit FastMarching(const TriMesh& mesh)
      : mesh_(mesh), distance_(mesh.points.size(), kFar), passed_(mesh.points.size(), false) {}

  void Offer(int vertex, double distance) {
    if (distance < distance_[vertex]) {
      distance_[vertex] = distance;
      open_.emplace(distance, vertex);
    }
  }

  // Returns the next vertex in order of distance, or -1 at the end.
  int Pass() {
    while (!open_.empty()) {
      const int vertex = open_.top().second;
      open_.pop();
      if (!passed_[vertex]) {
        passed_[vertex] = true;
        return vertex;
      }
    }
    return -1;
  }

  // Updates the other vertices of a triangle from `vertex`, which was just passed.
  void Spread(int vertex, const Triangle& t) {
    for (const int to : t) {
      if (passed_[to]) {
        continue;
      }
      const Vec3 &a = mesh_.points[vertex], &c = mesh_.points[to];
      Offer(to, distance_[vertex] + (c - a).norm());
      const int third = t[0] + t[1] + t[2] - vertex - to;
      if (third != vertex && third != to && passed_[third]) {
        const double through =
            ThroughEdge(a, distance_[vertex], mesh_.points[third], distance_[third], c);
        Offer(to, std::max(through, distance_[vertex]));
      }
    }
  }

  std::vector<double> Take() { return std::move(distance_); }

 private:
  using Entry = std::pair<double, int>;
  const TriMesh& mesh_;
  std::vector<double> distance_;
  std::vector<bool> passed_;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open_;
};

}  // namespace

SurfaceDistance::SurfaceDistance(const TriMesh& mesh)
    : mesh_(mesh), query_(mesh), triangles_at_(mesh) {}

std::vector<double> SurfaceDistance::From(const Vec3& p) const {
  const MeshPoint source = query_.Closest(p);
  FastMarching march(mesh_);
  for (const int v : mesh_.triangles[source.triangle]) {
    march.Offer(v, (mesh_.points[v] - source.position).norm());
  }
  for (int v = march.Pass(); v >= 0; v = march.Pass()) {
    for (const int t : triangles_at_.At(v)) {
      march.Spread(v, mesh_.triangles[t]);
    }
  }
  return march.Take();
}

void ForEachGeodesic(std::string_view scheme, const TriMesh& skull,
                     const std::vector<DepthSample>& samples, const RunContext& run,
                     const std::function<void(std::size_t, const std::vector<double>&)>& use) {
  run.ThrowIfStopped();
  CheckSurface(scheme, skull);
  const SurfaceDistance surface(skull);
  for (std::size_t first = 0; first < samples.size(); first += kHeldTogether) {
    const std::size_t count = std::min(kHeldTogether, samples.size() - first);
    std::vector<std::vector<double>> distances(count);
    ParallelFor(count, run.threads, 1, [&](std::size_t k) {
      run.ThrowIfStopped();
      distances[k] = surface.From(samples[first + k].base);
    });
    for (std::size_t k = 0; k < count; ++k) {
      use(first + k, distances[k]);
    }
  }
}

}  // namespace semblance::interp
