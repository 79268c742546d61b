// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/natural_neighbour.h"

#include <algorithm>
#include <boost/container/small_vector.hpp>
#include <cmath>
#include <limits>

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
// Small ones live on the stack: a field asks for hundreds of thousands.
constexpr std::size_t kUsualSites = 48, kUsualCorners = 24;
using Polygon = boost::container::small_vector<Corner, kUsualCorners>;

// What of the polygon has value(x) >= 0, for a linear value. Most have it everywhere.
template <class Value>
void Clip(Polygon& polygon, const Value& value, int edge, Polygon& spare) {
  double least = 0;
  for (const Corner& corner : polygon) {
    least = std::min(least, value(corner.at));
  }
  if (least >= 0) {
    return;
  }
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

double FurthestCorner2(const Polygon& polygon) {
  double furthest2 = 0;
  for (const Corner& corner : polygon) {
    furthest2 = std::max(furthest2, corner.at.squaredNorm());
  }
  return furthest2;
}

// What one vertex needs.
struct Workspace {
  boost::container::small_vector<Site, kUsualSites> sites;
  boost::container::small_vector<double, kUsualSites> least;
  boost::container::small_vector<int, kUsualSites> owners;
  Polygon cell, part, spare;
};

// The cell that the vertex would have. A site so far that its plane passes the furthest corner is
// not looked at corner by corner.
void FindCell(double reach, Workspace& work) {
  work.cell = {{{-reach, -reach}}, {{reach, -reach}}, {{reach, reach}}, {{-reach, reach}}};
  double furthest2 = FurthestCorner2(work.cell);
  for (std::size_t k = 0; k < work.sites.size(); ++k) {
    const Site& site = work.sites[k];
    if (site.distance2 * site.distance2 >= 4 * site.place.squaredNorm() * furthest2) {
      continue;
    }
    Clip(
        work.cell, [&](const Vec2& x) { return site.At(x); }, static_cast<int>(k), work.spare);
    furthest2 = FurthestCorner2(work.cell);
  }
}

// Those that may keep a part of the cell now, also such as the vertex would swallow whole: the
// lowest of the linear functions is nowhere in the cell above the least of their largest values.
void FindOwners(Workspace& work) {
  const std::size_t count = work.sites.size();
  work.least.assign(count, std::numeric_limits<double>::infinity());
  double bound = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < count; ++k) {
    double most = 0;
    for (const Corner& corner : work.cell) {
      const double value = work.sites[k].At(corner.at);
      work.least[k] = std::min(work.least[k], value);
      most = std::max(most, value);
    }
    bound = std::min(bound, most);
  }
  work.owners.clear();
  for (std::size_t k = 0; k < count; ++k) {
    if (work.least[k] <= bound) {
      work.owners.push_back(static_cast<int>(k));
    }
  }
}

// use(site, weight) for each.
template <class Use>
void SibsonWeights(Workspace& work, const Use& use) {
  FindOwners(work);
  for (const int own : work.owners) {
    work.part = work.cell;
    for (const int other : work.owners) {
      if (other != own && !work.part.empty()) {
        const Site &a = work.sites[own], &b = work.sites[other];
        Clip(
            work.part, [&](const Vec2& x) { return b.At(x) - a.At(x); }, other, work.spare);
      }
    }
    const double area = AreaOf(work.part);
    if (area > 0) {
      use(own, area);
    }
  }
}

template <class Use>
void LaplaceWeights(const Workspace& work, const Use& use) {
  const Polygon& cell = work.cell;
  for (std::size_t i = 0; i < cell.size(); ++i) {
    const Vec2& next = cell[i + 1 < cell.size() ? i + 1 : 0].at;
    use(cell[i].edge, (next - cell[i].at).norm() / work.sites[cell[i].edge].place.norm());
  }
}

const DepthSample& Nearest(const std::vector<DepthSample>& samples, const Vec3& p) {
  return *std::ranges::min_element(
      samples, {}, [&](const DepthSample& sample) { return (sample.base - p).squaredNorm(); });
}

// Gives the distance of the furthest. The first axis points to the nearest dowel, so that the reach
// turns with the skull.
double FindSites(const std::vector<DepthSample>& samples, const Vec3& p, const Vec3& normal,
                 const Vec3& nearest, Workspace& work) {
  Vec3 first = nearest - normal.dot(nearest) * normal;
  first = first.norm() > kAtBase_mm ? first.normalized() : normal.unitOrthogonal();
  const Vec3 second = normal.cross(first);
  double furthest2 = 0;
  work.sites.reserve(samples.size());
  for (const DepthSample& sample : samples) {
    const Vec3 x = sample.base - p;
    work.sites.push_back({{x.dot(first), x.dot(second)}, x.squaredNorm()});
    furthest2 = std::max(furthest2, x.squaredNorm());
  }
  return std::sqrt(furthest2);
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
  Workspace work;
  FindCell(kReach * FindSites(samples, p, normal, nearest.base - p, work), work);
  if (work.cell.empty() || std::ranges::count(work.cell, kOpen, &Corner::edge) > 0) {
    return {};
  }
  double sum = 0, depth = 0, sd = 0;
  const auto add = [&](int site, double weight) {
    sum += weight;
    depth += weight * samples[site].depth_mm;
    sd += weight * samples[site].sd_mm;
  };
  if (kind == NeighbourWeights::kSibson) {
    SibsonWeights(work, add);
  } else {
    LaplaceWeights(work, add);
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
