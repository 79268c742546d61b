// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/metrics/face_region.h"

#include <fmt/format.h>

#include <algorithm>

#include "interp/dowels/dowel.h"
#include "problems/experiment/metrics/outer_skin.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
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

// Measures how far a point lies outside, across a border edge of the nearest triangle: the distance
// from its nearest point in that triangle's plane. 0 if the nearest point is not on the border.
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
    constexpr double kOnEdge_mm = 1e-6;  // round-off
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

FaceRegion WholeSurface(const TriMesh& truth) {
  return {std::vector<bool>(truth.points.size(), true), std::vector<int>(truth.points.size(), -1)};
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
      throw InputError(fmt::format("face region: excluded zone: {}", StandardSiteFault(zone.site)));
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

namespace {

// The three planes that bound the face, see the header.
class FacePlanes {
 public:
  explicit FacePlanes(const SkullSites& sites) : sites_(sites) {
    const Vec3 menton = AverageSite("me"), gonion = AverageSite("go_l");
    jaw_rise_ = (gonion.z() - menton.z()) / (gonion.y() - menton.y());
    jaw_at_0_ = menton.z() - jaw_rise_ * menton.y();
  }
  bool Contain(const Vec3& point) const {
    constexpr double kHairline_mm = 55, kEars_mm = 75;
    const Vec3 p = sites_.InAverage(point);
    return p.z() <= kHairline_mm && p.y() <= kEars_mm && p.z() >= jaw_at_0_ + jaw_rise_ * p.y();
  }

 private:
  const SkullSites& sites_;
  double jaw_rise_ = 0, jaw_at_0_ = 0;
};

// The region of the face, including inner and excluded skin.
FaceRegion WithinFace(const TriMesh& skin, const SkullSites& sites) {
  FaceRegion region{std::vector<bool>(skin.points.size(), false),
                    std::vector<int>(skin.points.size(), -1)};
  const FacePlanes planes(sites);
  for (std::size_t v = 0; v < skin.points.size(); ++v) {
    if (planes.Contain(skin.points[v])) {
      region.scored[v] = true;
      region.part[v] = NearestPart(skin.points[v], sites.points);
    }
  }
  return region;
}

FaceRegion FindExtent(const TriMesh& skin, const SkullSites& sites, std::span<const Dowel> dowels,
                      const DowelNetwork& network, FaceRegionOptions options) {
  options.exclude.clear();  // FindScoredSkin gives excluded skin a status of its own
  return options.extent == RegionExtent::kFace
             ? WithinFace(skin, sites)
             : InFrontOfNetwork(skin, dowels, network, sites.points, options);
}

bool OnLid(const Vec3& p, const Vec3& normal, const std::vector<CutPlane>& ends) {
  // A lid lies within 1 mm of the end of the scan and faces it within 26 degrees.
  constexpr double kNear_mm = 1, kLeastCosine = 0.9;
  return std::ranges::any_of(ends, [&](const CutPlane& end) {
    return end.Beyond_mm(p) >= -kNear_mm && end.sign * normal[end.axis] >= kLeastCosine;
  });
}

void MeasureAreas(const TriMesh& skin, ScoredSkin& scored) {
  const std::vector<double> areas = VertexAreas(skin);
  for (std::size_t v = 0; v < areas.size(); ++v) {
    scored.area_cm2[static_cast<int>(scored.status[v])] += areas[v] / 100;
  }
}

}  // namespace

ScoredSkin FindScoredSkin(const TriMesh& skin, const SkullSites& sites,
                          std::span<const Dowel> dowels, const DowelNetwork& network,
                          const FaceRegionOptions& options) {
  return FindScoredSkin(skin, FindOuterSkin(skin, options.probe_mm), sites, dowels, network,
                        options);
}

ScoredSkin FindScoredSkin(const TriMesh& skin, const OuterSkin& outer, const SkullSites& sites,
                          std::span<const Dowel> dowels, const DowelNetwork& network,
                          const FaceRegionOptions& options) {
  const std::vector<Sphere> excluded = ExcludedSpheres(sites.points, options.exclude);
  const std::vector<Vec3> normals = VertexNormals(skin);
  ScoredSkin scored{.region = FindExtent(skin, sites, dowels, network, options),
                    .status = std::vector<SkinStatus>(skin.points.size(), SkinStatus::kScored),
                    .ends = outer.ends};
  for (std::size_t v = 0; v < skin.points.size(); ++v) {
    const Vec3& p = skin.points[v];
    const auto holds_p = [&](const Sphere& zone) { return zone.Contains(p); };
    scored.status[v] = !scored.region.scored[v]                 ? SkinStatus::kBeyond
                       : OnLid(p, normals[v], outer.ends)       ? SkinStatus::kEnd
                       : !outer.outer[v]                        ? SkinStatus::kInner
                       : std::ranges::any_of(excluded, holds_p) ? SkinStatus::kMasked
                                                                : SkinStatus::kScored;
    scored.region.scored[v] = scored.status[v] == SkinStatus::kScored;
    scored.region.part[v] = scored.region.scored[v] ? scored.region.part[v] : -1;
  }
  scored.region.outer = outer.outer;
  MeasureAreas(skin, scored);
  return scored;
}

ScoredSkin AllScored(const TriMesh& skin) {
  ScoredSkin scored{.region = WholeSurface(skin),
                    .status = std::vector<SkinStatus>(skin.points.size(), SkinStatus::kScored)};
  MeasureAreas(skin, scored);
  return scored;
}

}  // namespace semblance::problems
