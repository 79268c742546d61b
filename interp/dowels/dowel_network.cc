// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/dowels/dowel_network.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "interp/dowels/dowel_area.h"
#include "surfaces/base/error.h"

namespace semblance::interp {
namespace {

std::map<std::string, int> IndexBySite(std::span<const Dowel> dowels) {
  std::map<std::string, int> index;
  for (const Dowel& dowel : dowels) {
    if (!index.emplace(dowel.site, static_cast<int>(index.size())).second) {
      throw InputError(fmt::format("dowels: site '{}' appears twice; keep one", dowel.site));
    }
  }
  return index;
}

void CheckDistinct(const std::array<std::string, 3>& area) {
  if (area[0] == area[1] || area[1] == area[2] || area[2] == area[0]) {
    throw InputError(
        fmt::format("dowel network: area {} {} {} names a site twice; an area needs three sites",
                    area[0], area[1], area[2]));
  }
}

using Corners = std::array<int, 3>;

std::vector<DowelArea> BuildAreas(std::span<const Dowel> dowels, const DowelNetwork& network) {
  const TriMesh no_skull;
  return DowelAreas("inserted", {no_skull, {}, dowels, network});
}

Corners With(Corners area, int corner, int index) {
  area[corner] = index;
  return area;
}

// The barycentric coordinate below which the dowel counts as on an edge, which avoids a sliver
// between dowel and edge. Near a corner it is near two edges; there only triangles without area are
// avoided.
double EdgeTolerance(const Vec3& weights) {
  constexpr double kOnEdge = 0.01, kNoArea = 1e-6;
  return (weights.array() > kOnEdge).count() >= 2 ? kOnEdge : kNoArea;
}

bool HasEdge(const Corners& area, int a, int b) {
  return std::ranges::count(area, a) + std::ranges::count(area, b) == 2;
}

int CornerIndex(const Corners& area, int dowel) {
  return static_cast<int>(std::ranges::find(area, dowel) - area.begin());
}

// Splits every area at the edge into two.
void SplitEdge(int a, int b, int index, std::vector<Corners>& areas) {
  std::vector<Corners> split;
  for (const Corners& area : areas) {
    if (HasEdge(area, a, b)) {
      split.push_back(With(area, CornerIndex(area, a), index));
      split.push_back(With(area, CornerIndex(area, b), index));
    } else {
      split.push_back(area);
    }
  }
  areas = std::move(split);
}

Insertion InsertInside(std::size_t at, const Vec3& weights, int index,
                       std::vector<Corners>& areas) {
  const double on_edge = EdgeTolerance(weights);
  const auto corners_off = (weights.array() > on_edge).count();
  const Corners area = areas[at];
  if (corners_off < 2) {
    return Insertion::kNone;
  }
  if (corners_off == 2) {
    int apart = 0;
    weights.minCoeff(&apart);
    SplitEdge(area[(apart + 1) % 3], area[(apart + 2) % 3], index, areas);
    return Insertion::kInside;
  }
  areas[at] = With(area, 0, index);
  areas.insert(areas.begin() + static_cast<std::ptrdiff_t>(at) + 1,
               {With(area, 1, index), With(area, 2, index)});
  return Insertion::kInside;
}

// A border edge (an edge of only one area) with the dowel on its outer side, in the direction in
// which it runs in its area.
struct BorderEdge {
  int from = -1, to = -1;
  double distance_mm = kNaN;  // from the dowel
};

std::vector<BorderEdge> BorderBefore(const Vec3& p, std::span<const Dowel> dowels,
                                     const std::vector<DowelArea>& areas) {
  std::map<std::pair<int, int>, int> uses;
  for (const DowelArea& area : areas) {
    for (int k = 0; k < 3; ++k) {
      ++uses[std::minmax(area.dowels[(k + 1) % 3], area.dowels[(k + 2) % 3])];
    }
  }
  std::vector<BorderEdge> border;
  for (const DowelArea& area : areas) {
    for (int k = 0; k < 3; ++k) {
      const int from = area.dowels[(k + 1) % 3], to = area.dowels[(k + 2) % 3];
      if (uses.at(std::minmax(from, to)) == 1 && area.inside.row(k).dot(p) + area.offset[k] < 0) {
        border.push_back({from, to, DistanceToSegment(p, dowels[from].base, dowels[to].base)});
      }
    }
  }
  std::ranges::stable_sort(border, {}, &BorderEdge::distance_mm);
  return border;
}

// Returns true if the area is not a sliver and faces the same way as its dowels.
bool IsSound(const Corners& corners, std::span<const Dowel> dowels) try {
  constexpr double kMinHeightShare = 0.05;  // height over the edge's length
  const std::vector<DowelArea> area = BuildAreas(dowels, {{corners}, {}});
  const auto& base = area[0].base;
  const Vec3 edge = base[1] - base[0];
  return edge.cross(base[2] - base[0]).norm() > kMinHeightShare * edge.squaredNorm() &&
         area[0].unit_normal.dot(area[0].mean_direction) > 0;
} catch (const InputError&) {
  return false;
}

using Areas = std::vector<Corners>;

// The ring of dowels around a dowel, without repeating the first at the end. Empty at the border,
// or if the areas are not oriented consistently.
std::vector<int> RingAround(const Areas& areas, int dowel) {
  std::map<int, int> next;
  for (std::array<int, 3> area : areas) {
    const auto at = std::ranges::find(area, dowel);
    if (at != area.end()) {
      std::rotate(area.begin(), at, area.end());
      if (!next.emplace(area[1], area[2]).second) {
        return {};
      }
    }
  }
  std::vector<int> ring;
  for (int at = next.empty() ? -1 : next.begin()->first; ring.size() < next.size();) {
    ring.push_back(at);
    const auto it = next.find(at);
    if (it == next.end()) {
      return {};
    }
    at = it->second;
  }
  return !ring.empty() && next.at(ring.back()) == ring.front() ? ring : std::vector<int>{};
}

// The smallest angle of a triangle projected along `up`; negative if the triangle is turned over.
double LeastAngle(const std::array<Vec3, 3>& corner, const Vec3& up) {
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const Vec3 a = corner[(k + 1) % 3] - corner[k], b = corner[(k + 2) % 3] - corner[k];
    const Vec3 flat_a = a - a.dot(up) * up, flat_b = b - b.dot(up) * up;
    least = std::min(least, std::atan2(up.dot(flat_a.cross(flat_b)), flat_a.dot(flat_b)));
  }
  return least;
}

// The fan of areas from the ring's dowel number `apex`.
Areas Fan(const std::vector<int>& ring, std::size_t apex) {
  Areas areas;
  for (std::size_t k = 1; k + 1 < ring.size(); ++k) {
    areas.push_back(
        {ring[apex], ring[(apex + k) % ring.size()], ring[(apex + k + 1) % ring.size()]});
  }
  return areas;
}

// Returns true if each area has a triangle and cutting planes.
bool AreSound(const Areas& areas, std::span<const Dowel> dowels) try {
  BuildAreas(dowels, {areas, {}});
  return true;
} catch (const InputError&) {
  return false;
}

// New areas across the gap that the dowel leaves; none if no fan is sound.
Areas Closing(const Areas& areas, std::span<const Dowel> dowels, int dowel) {
  constexpr double kMinAngle_rad = 0.03;  // flatter fans (below 1.7 degrees) are slivers
  const std::vector<int> ring = RingAround(areas, dowel);
  if (ring.size() < 3) {
    return {};
  }
  Vec3 up = dowels[dowel].direction;
  if (LeastAngle({dowels[dowel].base, dowels[ring[0]].base, dowels[ring[1]].base}, up) < 0) {
    up = -up;  // the network's areas are oriented the other way
  }
  Areas best;
  double best_angle = kMinAngle_rad;
  for (std::size_t apex = 0; apex < ring.size(); ++apex) {
    const Areas fan = Fan(ring, apex);
    double least = std::numeric_limits<double>::infinity();
    for (const auto& [a, b, c] : fan) {
      least = std::min(least, LeastAngle({dowels[a].base, dowels[b].base, dowels[c].base}, up));
    }
    if (least > best_angle && AreSound(fan, dowels)) {
      best_angle = least;
      best = fan;
    }
  }
  return best;
}

}  // namespace

DowelNetwork BuildNetwork(const NetworkPlan& plan, std::span<const Dowel> dowels) {
  const std::map<std::string, int> index = IndexBySite(dowels);
  DowelNetwork network;
  std::set<std::string> missing_sites;
  for (const auto& area : plan.areas) {
    CheckDistinct(area);
    std::string missing;
    std::array<int, 3> found{};
    for (int c = 0; c < 3; ++c) {
      const auto it = index.find(area[c]);
      found[c] = it == index.end() ? -1 : it->second;
      if (it == index.end()) {
        missing += fmt::format(" {}", area[c]);
        missing_sites.insert(area[c]);
      }
    }
    if (missing.empty()) {
      network.areas.push_back(found);
    } else {
      network.dropped.push_back(
          fmt::format("area {} {} {}: no dowel at{}", area[0], area[1], area[2], missing));
    }
  }
  network.missing_sites.assign(missing_sites.begin(), missing_sites.end());
  return network;
}

Insertion InsertIntoNetwork(std::span<const Dowel> dowels, int index, DowelNetwork& network) {
  const std::vector<DowelArea> areas = BuildAreas(dowels, network);
  const Vec3& p = dowels[index].base;
  if (const AreaPoint in = FindArea(areas, AreaDistance::kTriangle, p); in.area != nullptr) {
    return InsertInside(static_cast<std::size_t>(in.area - areas.data()), in.weights, index,
                        network.areas);
  }
  for (const BorderEdge& edge : BorderBefore(p, dowels, areas)) {
    if (IsSound({edge.to, edge.from, index}, dowels)) {
      network.areas.push_back({edge.to, edge.from, index});
      return Insertion::kOutside;
    }
  }
  return Insertion::kNone;
}

double ShownDowels::NearestTo_mm(const Vec3& p) const {
  double nearest = kNaN;
  for (const Dowel& dowel : dowels) {
    nearest = std::fmin(nearest, (dowel.base - p).norm());
  }
  return nearest;
}

ShownDowels LeaveOutDowels(std::span<const Dowel> dowels, const DowelNetwork& network,
                           const std::vector<std::size_t>& fold) {
  ShownDowels shown;
  std::vector<int> index(dowels.size(), -1);
  for (std::size_t i = 0; i < dowels.size(); ++i) {
    if (std::ranges::find(fold, i) == fold.end()) {
      index[i] = static_cast<int>(shown.dowels.size());
      shown.dowels.push_back(dowels[i]);
    }
  }
  Areas areas = network.areas;
  for (const std::size_t i : fold) {
    const auto dowel = static_cast<int>(i);
    const Areas closing = Closing(areas, dowels, dowel);
    std::erase_if(areas,
                  [&](const auto& area) { return std::ranges::find(area, dowel) != area.end(); });
    areas.insert(areas.end(), closing.begin(), closing.end());
  }
  for (const auto& [a, b, c] : areas) {
    shown.network.areas.push_back({index[a], index[b], index[c]});
  }
  return shown;
}

}  // namespace semblance::interp
