// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/metrics/face_region.h"

#include <fmt/format.h>

#include <algorithm>

#include "interp/dowels/dowel.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance {
namespace {

TriMesh NetworkMesh(std::span<const Dowel> dowels, const DowelNetwork& network) {
  TriMesh mesh;
  for (const Dowel& dowel : dowels) {
    mesh.points.push_back(dowel.base);
  }
  for (const std::array<int, 3>& area : network.areas) {
    mesh.triangles.push_back({area[0], area[1], area[2]});
  }
  return mesh;
}

double DistanceToSegment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const double s = std::clamp((p - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0);
  return (p - (a + s * ab)).norm();
}

// How far p lies outside across a border edge of the triangle it is nearest to: its distance in
// that triangle's plane from the nearest point, 0 if the nearest point is not on the border.
class BorderRule {
 public:
  explicit BorderRule(const TriMesh& network) : network_(network), border_(BorderEdges(network)) {}

  double Overhang(const Vec3& p, const MeshPoint& nearest) const {
    const Triangle& t = network_.triangles[nearest.triangle];
    if (!OnBorder(t, nearest.position)) {
      return 0;
    }
    const Vec3 normal = TriangleAreaVector(network_, t).normalized();
    const Vec3 offset = p - nearest.position;
    return (offset - offset.dot(normal) * normal).norm();
  }

 private:
  bool OnBorder(const Triangle& t, const Vec3& q) const {
    constexpr double kOnEdge_mm = 1e-6;
    for (const auto& [a, b] : border_) {
      const bool touches =
          std::count(t.begin(), t.end(), a) + std::count(t.begin(), t.end(), b) > 0;
      if (touches && DistanceToSegment(q, network_.points[a], network_.points[b]) < kOnEdge_mm) {
        return true;
      }
    }
    return false;
  }

  const TriMesh& network_;
  std::vector<MeshEdge> border_;
};

std::map<std::string, Vec3> WithDowels(std::map<std::string, Vec3> points,
                                       std::span<const Dowel> dowels) {
  for (const Dowel& dowel : dowels) {
    points[dowel.site] = dowel.base;
  }
  return points;
}

}  // namespace

int FacePartOfSite(const std::string& site) {
  static const std::map<std::string, int> kPartOf = {
      {"sg", 0}, {"g", 0},  {"fe", 0}, {"mso", 1}, {"mio", 1}, {"n", 2},   {"rhi", 2},
      {"im", 3}, {"lo", 3}, {"zy", 3}, {"sM2", 3}, {"mp", 4},  {"pr", 4},  {"id", 4},
      {"sm", 5}, {"pg", 5}, {"me", 5}, {"go", 6},  {"mr", 6},  {"iM2", 6}, {"sgl", 7}};
  const auto found = kPartOf.find(WithoutSide(site));
  if (found == kPartOf.end()) {
    throw InputError(fmt::format(
        "face region: site '{}' belongs to no part of the face; known are the 21 standard sites",
        site));
  }
  return found->second;
}

int NearestPart(const Vec3& p, const std::map<std::string, Vec3>& points) {
  const auto nearest = std::ranges::min_element(
      points, {}, [&](const auto& site) { return (site.second - p).squaredNorm(); });
  return FacePartOfSite(nearest->first);
}

std::vector<Sphere> ExcludedSpheres(const std::map<std::string, Vec3>& points,
                                    const std::vector<ExcludedZone>& zones) {
  std::vector<Sphere> spheres;
  for (const ExcludedZone& zone : zones) {
    const auto point = points.find(zone.site);
    if (point == points.end()) {
      throw InputError(
          fmt::format("face region: excluded zone: {}", ComplaintAboutSite(zone.site)));
    }
    spheres.push_back({point->second, zone.radius_mm});
  }
  return spheres;
}

FaceRegion InFrontOfNetwork(const TriMesh& mesh, std::span<const Dowel> dowels,
                            const DowelNetwork& network, const std::map<std::string, Vec3>& points,
                            const FaceRegionOptions& options) {
  if (network.areas.empty()) {
    throw InputError(
        "face region: the dowel network has no area; at least three dowels that share an area are "
        "needed");
  }
  const TriMesh network_mesh = NetworkMesh(dowels, network);
  const MeshQuery query(network_mesh);
  const BorderRule border(network_mesh);
  const std::vector<Sphere> excluded = ExcludedSpheres(WithDowels(points, dowels), options.exclude);
  std::map<std::string, Vec3> bases = WithDowels({}, dowels);
  std::erase_if(bases, [](const auto& base) { return !IsStandardSite(base.first); });
  FaceRegion region{std::vector<bool>(mesh.points.size(), false),
                    std::vector<int>(mesh.points.size(), -1)};
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    const Vec3& p = mesh.points[v];
    const MeshPoint nearest = query.Closest(p);
    const bool inside = nearest.distance_mm <= options.reach_mm &&
                        border.Overhang(p, nearest) <= options.margin_mm + 1e-9;
    const bool barred = std::any_of(excluded.begin(), excluded.end(),
                                    [&](const Sphere& s) { return s.Contains(p); });
    if (inside && !barred) {
      region.scored[v] = true;
      region.part[v] = bases.empty() ? -1 : NearestPart(p, bases);
    }
  }
  return region;
}

}  // namespace semblance
