// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/schemes/natural_neighbour.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "interp/dowels/dowel_samples.h"
#include "interp/schemes/power_cell.h"

namespace semblance::interp {
namespace {

constexpr double kOpenCellRatio =
    4;  // times the furthest dowel's distance; larger cells count as open

// For each dowel, all dowels with their distances: the nearest hundred sorted, then the rest.
class Neighbourhoods {
 public:
  struct Other {
    int sample;
    double distance_mm;
  };

  explicit Neighbourhoods(const std::vector<DepthSample>& samples) : others_(samples.size()) {
    constexpr std::size_t kInOrder = 100;  // few points have neighbours beyond these
    for (std::size_t k = 0; k < samples.size(); ++k) {
      for (std::size_t other = 0; other < samples.size(); ++other) {
        others_[k].push_back(
            {static_cast<int>(other), (samples[other].base - samples[k].base).norm()});
      }
      const auto middle = others_[k].begin() + std::min(kInOrder, samples.size());
      std::ranges::partial_sort(others_[k], middle, {}, &Other::distance_mm);
    }
  }
  const std::vector<Other>& Around(int sample) const { return others_[sample]; }

 private:
  std::vector<std::vector<Other>> others_;
};

// The nearest dowel of a point, and the distances of the nearest and the furthest dowel.
struct Range {
  int nearest = -1;
  double nearest_mm = kNaN, furthest_mm = kNaN;
};

Range FindRange(const std::vector<DepthSample>& samples, const Vec3& p) {
  double least2 = std::numeric_limits<double>::infinity(), most2 = 0;
  Range range;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const double distance2 = (samples[k].base - p).squaredNorm();
    most2 = std::max(most2, distance2);
    if (distance2 < least2) {
      least2 = distance2;
      range.nearest = static_cast<int>(k);
    }
  }
  range.nearest_mm = std::sqrt(least2);
  range.furthest_mm = std::sqrt(most2);
  return range;
}

// The tangent plane at p. The first axis points to the nearest dowel, so that the result does not
// depend on the skull's orientation.
struct TangentPlane {
  Vec3 at, first, second;

  TangentPlane(const Vec3& p, const Vec3& normal, const Vec3& nearest) : at(p) {
    const Vec3 towards = nearest - p;
    first = towards - normal.dot(towards) * normal;
    first = first.norm() > kSamePoint_mm ? first.normalized() : normal.unitOrthogonal();
    second = normal.cross(first);
  }
  PowerSite MakeSite(const Vec3& base) const {
    const Vec3 x = base - at;
    return {{x.dot(first), x.dot(second)}, x.squaredNorm()};
  }
};

// A point's cell, and the dowels that may lose a part to it.
struct NeighbourCell {
  explicit NeighbourCell(double reach) : shape(reach) {}

  PowerCell shape;
  boost::container::small_vector<PowerSite, 48> sites;
  boost::container::small_vector<int, 48> samples;  // sample of each site
};

// Cuts the cell by the dowels. A dowel is irrelevant if its distance from the nearest dowel is more
// than twice the distance of any point of the cell from the nearest dowel, because then the nearest
// dowel is closer to the whole cell. The latter distance is at most the cell's furthest corner from
// p plus p's distance from the nearest dowel.
void CutCell(const std::vector<DepthSample>& samples, const Neighbourhoods& neighbourhoods,
             const Range& range, const TangentPlane& plane, NeighbourCell& cell) {
  constexpr double kSlack = 1 + 1e-9;
  for (const Neighbourhoods::Other& other : neighbourhoods.Around(range.nearest)) {
    const double corner_mm = std::sqrt(cell.shape.FurthestCorner2());
    if (other.distance_mm <= 2 * kSlack * (corner_mm + range.nearest_mm)) {
      const PowerSite site = plane.MakeSite(samples[other.sample].base);
      cell.shape.Cut(site, static_cast<int>(cell.sites.size()));
      cell.sites.push_back(site);
      cell.samples.push_back(other.sample);
    }
  }
}

// Calls use(site, weight) for each site with a weight.
template <class Use>
void ForEachWeight(NeighbourWeights kind, const NeighbourCell& cell, const Use& use) {
  const CellPolygon& corners = cell.shape.polygon();
  if (kind == NeighbourWeights::kSibson) {
    SiteAreas areas;
    SibsonAreas({cell.sites.data(), cell.sites.size()}, corners, areas);
    for (std::size_t k = 0; k < areas.size(); ++k) {
      if (areas[k] > 0) {
        use(k, areas[k]);
      }
    }
    return;
  }
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec2& next = corners[i + 1 < corners.size() ? i + 1 : 0].at;
    const auto site = static_cast<std::size_t>(corners[i].edge);
    use(site, (next - corners[i].at).norm() / cell.sites[site].position.norm());
  }
}

DepthValue DepthAt(const std::vector<DepthSample>& samples, const Neighbourhoods& neighbourhoods,
                   NeighbourWeights kind, const Vec3& p, const Vec3& normal) {
  const Range range = FindRange(samples, p);
  const DepthSample& nearest = samples[range.nearest];
  if (range.nearest_mm <= kSamePoint_mm) {
    return {nearest.depth_mm, nearest.sd_mm};
  }
  if (normal.squaredNorm() == 0) {
    return {};  // no normal, hence no tangent plane
  }
  NeighbourCell cell(kOpenCellRatio * range.furthest_mm);
  CutCell(samples, neighbourhoods, range, TangentPlane(p, normal, nearest.base), cell);
  const CellPolygon& corners = cell.shape.polygon();
  if (corners.empty() || std::ranges::count(corners, kOpenEdge, &CellCorner::edge) > 0) {
    return {};
  }
  double sum = 0, depth = 0, sd = 0;
  ForEachWeight(kind, cell, [&](std::size_t site, double weight) {
    const DepthSample& sample = samples[cell.samples[site]];
    sum += weight;
    depth += weight * sample.depth_mm;
    sd += weight * sample.sd_mm;
  });
  return sum > 0 ? DepthValue{depth / sum, sd / sum} : DepthValue{};
}

}  // namespace

DepthField InterpolateDepth(const NaturalNeighbour& options, const DepthInput& input,
                            const RunContext& run) {
  CheckDepthInput(input);
  const std::vector<DepthSample> samples = DepthSamples(input.dowels);
  const DepthLimits limits(samples, true);
  const Neighbourhoods neighbourhoods(samples);
  return AssignWhereFacing(input, samples, options.max_angle_deg, run, [&](std::size_t i) {
    const DepthValue value =
        DepthAt(samples, neighbourhoods, options.weights, input.skull.points[i], input.normals[i]);
    return DepthValue{limits(value.mm), value.sd_mm};  // against round-off
  });
}

}  // namespace semblance::interp
