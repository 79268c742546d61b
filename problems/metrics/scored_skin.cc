// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/metrics/scored_skin.h"

#include <algorithm>

#include "problems/metrics/face_metrics.h"
#include "problems/metrics/outer_skin.h"

namespace semblance {
namespace {

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

// Of the face, outer or not, excluded or not.
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

FaceRegion Extent(const TriMesh& skin, const SkullSites& sites, std::span<const Dowel> dowels,
                  const DowelNetwork& network, FaceRegionOptions options) {
  options.exclude.clear();  // told apart later
  return options.extent == RegionExtent::kFace
             ? WithinFace(skin, sites)
             : InFrontOfNetwork(skin, dowels, network, sites.points, options);
}

bool OnLid(const Vec3& p, const Vec3& normal, const std::vector<CutPlane>& ends) {
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

ScoredSkin FindScoredSkin(const TriMesh& skin, const OuterSkin& felt, const SkullSites& sites,
                          std::span<const Dowel> dowels, const DowelNetwork& network,
                          const FaceRegionOptions& options) {
  const std::vector<Sphere> excluded = ExcludedSpheres(sites.points, options.exclude);
  const std::vector<Vec3> normals = VertexNormals(skin);
  ScoredSkin scored{.region = Extent(skin, sites, dowels, network, options),
                    .status = std::vector<SkinStatus>(skin.points.size(), SkinStatus::kScored),
                    .ends = felt.ends};
  for (std::size_t v = 0; v < skin.points.size(); ++v) {
    const Vec3& p = skin.points[v];
    const auto holds_p = [&](const Sphere& zone) { return zone.Contains(p); };
    scored.status[v] = !scored.region.scored[v]                 ? SkinStatus::kBeyond
                       : OnLid(p, normals[v], felt.ends)        ? SkinStatus::kEnd
                       : !felt.outer[v]                         ? SkinStatus::kInner
                       : std::ranges::any_of(excluded, holds_p) ? SkinStatus::kMasked
                                                                : SkinStatus::kScored;
    scored.region.scored[v] = scored.status[v] == SkinStatus::kScored;
    scored.region.part[v] = scored.region.scored[v] ? scored.region.part[v] : -1;
  }
  scored.region.outer = felt.outer;
  MeasureAreas(skin, scored);
  return scored;
}

ScoredSkin AllScored(const TriMesh& skin) {
  ScoredSkin scored{.region = WholeSurface(skin),
                    .status = std::vector<SkinStatus>(skin.points.size(), SkinStatus::kScored)};
  MeasureAreas(skin, scored);
  return scored;
}

}  // namespace semblance
