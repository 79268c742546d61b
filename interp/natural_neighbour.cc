// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/natural_neighbour.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "interp/dowel_samples.h"

namespace semblance {
namespace {

constexpr double kAtBase_mm = 1e-6;  // so near, a dowel stands alone
constexpr double kReach = 4;         // times the furthest dowel's distance
constexpr int kOpen = -1;            // the border of the reach

// In the tangent plane, with the vertex as origin. A dowel's power at x less that of the vertex is
// distance2 - 2 place . x: a linear function, negative where the dowel would keep x.
struct Site {
  Vec2 place;
  double distance2 = 0;  // to the vertex, in space

  double At(const Vec2& x) const { return distance2 - 2 * place.dot(x); }
};

// A convex polygon; `edge` is the site behind the edge from this corner to the next.
struct Corner {
  Vec2 at;
  int edge = kOpen;
};
using Polygon = std::vector<Corner>;

// What of the polygon has value(x) >= 0, for a linear value.
template <class Value>
void Clip(Polygon& polygon, const Value& value, int edge, Polygon& spare) {
  spare.clear();
  bool cut = false;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Corner& a = polygon[i];
    const Corner& b = polygon[i + 1 < polygon.size() ? i + 1 : 0];
    const double at_a = value(a.at), at_b = value(b.at);
    if (at_a >= 0) {
      spare.push_back(a);
    }
    if ((at_a >= 0) != (at_b >= 0)) {
      cut = true;
      const Vec2 between = a.at + at_a / (at_a - at_b) * (b.at - a.at);
      spare.push_back({between, at_a >= 0 ? edge : a.edge});
    }
  }
  if (cut || spare.empty()) {
    polygon.swap(spare);
  }
}

double AreaOf(const Polygon& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2& a = polygon[i].at;
    const Vec2& b = polygon[i + 1 < polygon.size() ? i + 1 : 0].at;
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return twice / 2;
}

// The cell that the vertex would have.
Polygon CellOf(const std::vector<Site>& sites, double reach) {
  Polygon cell = {{{-reach, -reach}}, {{reach, -reach}}, {{reach, reach}}, {{-reach, reach}}};
  Polygon spare;
  for (std::size_t k = 0; k < sites.size(); ++k) {
    Clip(
        cell, [&](const Vec2& x) { return sites[k].At(x); }, static_cast<int>(k), spare);
  }
  return cell;
}

// Those that may keep a part of the cell now, also such as the vertex would swallow whole: the
// lowest of the linear functions is nowhere in the cell above the least of their largest values.
std::vector<int> Owners(const std::vector<Site>& sites, const Polygon& cell) {
  std::vector<double> least(sites.size(), std::numeric_limits<double>::infinity());
  double bound = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < sites.size(); ++k) {
    double most = 0;
    for (const Corner& corner : cell) {
      const double value = sites[k].At(corner.at);
      least[k] = std::min(least[k], value);
      most = std::max(most, value);
    }
    bound = std::min(bound, most);
  }
  std::vector<int> owners;
  for (std::size_t k = 0; k < sites.size(); ++k) {
    if (least[k] <= bound) {
      owners.push_back(static_cast<int>(k));
    }
  }
  return owners;
}

struct Weight {
  int site = 0;
  double weight = 0;
};

std::vector<Weight> SibsonWeights(const std::vector<Site>& sites, const Polygon& cell) {
  const std::vector<int> owners = Owners(sites, cell);
  std::vector<Weight> weights;
  Polygon part, spare;
  for (const int own : owners) {
    part = cell;
    for (const int other : owners) {
      if (other != own && !part.empty()) {
        Clip(
            part, [&](const Vec2& x) { return sites[other].At(x) - sites[own].At(x); }, other,
            spare);
      }
    }
    const double area = AreaOf(part);
    if (area > 0) {
      weights.push_back({own, area});
    }
  }
  return weights;
}

std::vector<Weight> LaplaceWeights(const std::vector<Site>& sites, const Polygon& cell) {
  std::vector<Weight> weights;
  for (std::size_t i = 0; i < cell.size(); ++i) {
    const Vec2& next = cell[i + 1 < cell.size() ? i + 1 : 0].at;
    weights.push_back(
        {cell[i].edge, (next - cell[i].at).norm() / sites[cell[i].edge].place.norm()});
  }
  return weights;
}

const DepthSample& Nearest(const std::vector<DepthSample>& samples, const Vec3& p) {
  return *std::ranges::min_element(
      samples, {}, [&](const DepthSample& sample) { return (sample.base - p).squaredNorm(); });
}

// The first axis points to the nearest dowel, so that the reach turns with the skull.
std::vector<Site> SitesAround(const std::vector<DepthSample>& samples, const Vec3& p,
                              const Vec3& normal, const Vec3& nearest) {
  Vec3 first = nearest - normal.dot(nearest) * normal;
  first = first.norm() > kAtBase_mm ? first.normalized() : normal.unitOrthogonal();
  const Vec3 second = normal.cross(first);
  std::vector<Site> sites;
  sites.reserve(samples.size());
  for (const DepthSample& sample : samples) {
    const Vec3 x = sample.base - p;
    sites.push_back({{x.dot(first), x.dot(second)}, x.squaredNorm()});
  }
  return sites;
}

DepthValue DepthAt(const std::vector<DepthSample>& samples, NeighbourWeights kind, const Vec3& p,
                   const Vec3& normal) {
  const DepthSample& nearest = Nearest(samples, p);
  if ((nearest.base - p).norm() <= kAtBase_mm) {
    return {nearest.depth_mm, nearest.sd_mm};
  }
  if (normal.squaredNorm() == 0) {
    return {};  // no tangent plane
  }
  const std::vector<Site> sites = SitesAround(samples, p, normal, nearest.base - p);
  const double furthest = std::sqrt(std::ranges::max(sites, {}, &Site::distance2).distance2);
  const Polygon cell = CellOf(sites, kReach * furthest);
  if (cell.empty() || std::ranges::count(cell, kOpen, &Corner::edge) > 0) {
    return {};
  }
  double sum = 0, depth = 0, sd = 0;
  for (const Weight& of : kind == NeighbourWeights::kSibson ? SibsonWeights(sites, cell)
                                                            : LaplaceWeights(sites, cell)) {
    sum += of.weight;
    depth += of.weight * samples[of.site].depth_mm;
    sd += of.weight * samples[of.site].sd_mm;
  }
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
