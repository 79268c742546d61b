// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/natural_neighbour.h"

#include <algorithm>
#include <cmath>

#include "interp/dowel_samples.h"
#include "interp/power_cell.h"

namespace semblance {
namespace {

constexpr double kAtBase_mm = 1e-6;  // so near, a dowel stands alone
constexpr double kReach = 4;         // times the furthest dowel's distance
using Sites = boost::container::small_vector<PowerSite, 48>;

const DepthSample& NearestSample(const std::vector<DepthSample>& samples, const Vec3& p) {
  return *std::ranges::min_element(
      samples, {}, [&](const DepthSample& sample) { return (sample.base - p).squaredNorm(); });
}

// In the tangent plane at p. The first axis points to the nearest dowel, so that the reach turns
// with the skull.
Sites SitesAround(const std::vector<DepthSample>& samples, const Vec3& p, const Vec3& normal,
                  const Vec3& nearest) {
  Vec3 first = nearest - normal.dot(nearest) * normal;
  first = first.norm() > kAtBase_mm ? first.normalized() : normal.unitOrthogonal();
  const Vec3 second = normal.cross(first);
  Sites sites;
  sites.reserve(samples.size());
  for (const DepthSample& sample : samples) {
    const Vec3 x = sample.base - p;
    sites.push_back({{x.dot(first), x.dot(second)}, x.squaredNorm()});
  }
  return sites;
}

double Reach(const Sites& sites) {
  double furthest2 = 0;
  for (const PowerSite& site : sites) {
    furthest2 = std::max(furthest2, site.distance2);
  }
  return kReach * std::sqrt(furthest2);
}

// use(site, weight) for each that has one.
template <class Use>
void ForEachWeight(NeighbourWeights kind, const Sites& sites, const CellPolygon& cell,
                   const Use& use) {
  if (kind == NeighbourWeights::kSibson) {
    SiteAreas areas;
    FindParts({sites.data(), sites.size()}, cell, areas);
    for (std::size_t k = 0; k < areas.size(); ++k) {
      if (areas[k] > 0) {
        use(k, areas[k]);
      }
    }
    return;
  }
  for (std::size_t i = 0; i < cell.size(); ++i) {
    const Vec2& next = cell[i + 1 < cell.size() ? i + 1 : 0].at;
    const auto site = static_cast<std::size_t>(cell[i].edge);
    use(site, (next - cell[i].at).norm() / sites[site].place.norm());
  }
}

DepthValue DepthAt(const std::vector<DepthSample>& samples, NeighbourWeights kind, const Vec3& p,
                   const Vec3& normal) {
  const DepthSample& nearest = NearestSample(samples, p);
  if ((nearest.base - p).norm() <= kAtBase_mm) {
    return {nearest.depth_mm, nearest.sd_mm};
  }
  if (normal.squaredNorm() == 0) {
    return {};  // no tangent plane
  }
  const Sites sites = SitesAround(samples, p, normal, nearest.base - p);
  CellPolygon cell;
  FindCell({sites.data(), sites.size()}, Reach(sites), cell);
  if (cell.empty() || std::ranges::count(cell, kOpenEdge, &CellCorner::edge) > 0) {
    return {};
  }
  double sum = 0, depth = 0, sd = 0;
  ForEachWeight(kind, sites, cell, [&](std::size_t site, double weight) {
    sum += weight;
    depth += weight * samples[site].depth_mm;
    sd += weight * samples[site].sd_mm;
  });
  return sum > 0 ? DepthValue{depth / sum, sd / sum} : DepthValue{};
}

}  // namespace

DepthField InterpolateDepth(const NaturalNeighbour& options, const DepthInput& input,
                            const RunContext& run) {
  CheckDepthInput(input);
  const std::vector<DepthSample> samples = DepthSamples(input.dowels);
  const DepthLimits limits(samples, true);
  return AssignWhereFacing(input, samples, options.max_angle_deg, run, [&](std::size_t i) {
    const DepthValue value =
        DepthAt(samples, options.weights, input.skull.points[i], input.normals[i]);
    return DepthValue{limits(value.mm), value.sd_mm};  // against rounding
  });
}

}  // namespace semblance
