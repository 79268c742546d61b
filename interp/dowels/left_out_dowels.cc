// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/dowels/left_out_dowels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "interp/dowels/dowel_area.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

using Areas = std::vector<std::array<int, 3>>;

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
  const TriMesh no_skull;
  DowelAreas("left out", {no_skull, {}, dowels, {areas, {}}});
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

double ShownDowels::NearestTo_mm(const Vec3& p) const {
  double nearest = kNaN;
  for (const Dowel& dowel : dowels) {
    nearest = std::fmin(nearest, (dowel.base - p).norm());
  }
  return nearest;
}

ShownDowels LeaveOutDowels(const DepthInput& input, const std::vector<std::size_t>& fold) {
  ShownDowels shown;
  std::vector<int> index(input.dowels.size(), -1);
  for (std::size_t i = 0; i < input.dowels.size(); ++i) {
    if (std::ranges::find(fold, i) == fold.end()) {
      index[i] = static_cast<int>(shown.dowels.size());
      shown.dowels.push_back(input.dowels[i]);
    }
  }
  Areas areas = input.network.areas;
  for (const std::size_t i : fold) {
    const auto dowel = static_cast<int>(i);
    const Areas closing = Closing(areas, input.dowels, dowel);
    std::erase_if(areas,
                  [&](const auto& area) { return std::ranges::find(area, dowel) != area.end(); });
    areas.insert(areas.end(), closing.begin(), closing.end());
  }
  for (const auto& [a, b, c] : areas) {
    shown.network.areas.push_back({index[a], index[b], index[c]});
  }
  return shown;
}

}  // namespace semblance
