// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/dowels/network_insertion.h"

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "interp/dowels/dowel_area.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

using Corners = std::array<int, 3>;

std::vector<DowelArea> AreasOf(std::span<const Dowel> dowels, const DowelNetwork& network) {
  const TriMesh no_skull;
  return DowelAreas("inserted", {no_skull, {}, dowels, network});
}

Corners With(Corners area, int corner, int index) {
  area[corner] = index;
  return area;
}

// A dowel nearer to an edge than this part of the height over it lies on the edge: no sliver
// between them. At a corner, where it is near two edges, only what has no area at all is left out.
double OnEdge(const Vec3& weights) {
  constexpr double kOnEdge = 0.01, kNoArea = 1e-6;
  return (weights.array() > kOnEdge).count() >= 2 ? kOnEdge : kNoArea;
}

bool HasEdge(const Corners& area, int a, int b) {
  return std::ranges::count(area, a) + std::ranges::count(area, b) == 2;
}

int CornerOf(const Corners& area, int dowel) {
  return static_cast<int>(std::ranges::find(area, dowel) - area.begin());
}

// Every area at the edge becomes two.
void SplitEdge(int a, int b, int index, std::vector<Corners>& areas) {
  std::vector<Corners> split;
  for (const Corners& area : areas) {
    if (HasEdge(area, a, b)) {
      split.push_back(With(area, CornerOf(area, a), index));
      split.push_back(With(area, CornerOf(area, b), index));
    } else {
      split.push_back(area);
    }
  }
  areas = std::move(split);
}

Insertion InsertInside(std::size_t at, const Vec3& weights, int index,
                       std::vector<Corners>& areas) {
  const double on_edge = OnEdge(weights);
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

// An edge of one area alone, behind which the dowel lies; as it runs in that area.
struct BorderEdge {
  int from = -1, to = -1;
  double distance_mm = kNaN;  // of the dowel
};

double DistanceToEdge(const Vec3& p, const Vec3& a, const Vec3& b) {
  const double along = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (p - (a + along * (b - a))).norm();
}

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
        border.push_back({from, to, DistanceToEdge(p, dowels[from].base, dowels[to].base)});
      }
    }
  }
  std::ranges::stable_sort(border, {}, &BorderEdge::distance_mm);
  return border;
}

// Broad enough, and facing as its dowels do.
bool IsSound(const Corners& corners, std::span<const Dowel> dowels) try {
  constexpr double kLeastHeight = 0.05;  // of the edge
  const std::vector<DowelArea> area = AreasOf(dowels, {{corners}, {}});
  const auto& base = area[0].base;
  const Vec3 edge = base[1] - base[0];
  return edge.cross(base[2] - base[0]).norm() > kLeastHeight * edge.squaredNorm() &&
         area[0].unit_normal.dot(area[0].mean_direction) > 0;
} catch (const InputError&) {
  return false;
}

}  // namespace

Insertion InsertIntoNetwork(std::span<const Dowel> dowels, int index, DowelNetwork& network) {
  const std::vector<DowelArea> areas = AreasOf(dowels, network);
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

}  // namespace semblance
