// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/thinning/kept_landmarks.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "surfaces/base/random.h"

namespace semblance {
namespace {

std::vector<bool> FirstOf(const std::vector<std::size_t>& order, int n) {
  std::vector<bool> kept(order.size(), false);
  const std::size_t count = std::min(order.size(), static_cast<std::size_t>(n));
  for (std::size_t k = 0; k < count; ++k) {
    kept[order[k]] = true;
  }
  return kept;
}

// The points, each the farthest from those before it.
std::vector<std::size_t> FarthestFirst(std::span<const Vec3> points) {
  const Vec3 mean = std::accumulate(points.begin(), points.end(), Vec3(Vec3::Zero())) /
                    static_cast<double>(std::max<std::size_t>(1, points.size()));
  std::vector<double> distance;
  for (const Vec3& p : points) {
    distance.push_back((p - mean).norm());
  }
  std::vector<std::size_t> order;
  while (order.size() < points.size()) {
    const auto next =
        static_cast<std::size_t>(std::ranges::max_element(distance) - distance.begin());
    const bool is_first = order.empty();
    order.push_back(next);
    for (std::size_t k = 0; k < points.size(); ++k) {
      const double to_next = (points[k] - points[next]).norm();
      distance[k] = is_first ? to_next : std::min(distance[k], to_next);
    }
    for (const std::size_t taken : order) {
      distance[taken] = -1;  // also where another lies on the same point
    }
  }
  return order;
}

std::vector<bool> Kept(const KeepAll&, std::span<const std::string> sites, std::span<const Vec3>) {
  return std::vector<bool>(sites.size(), true);
}

std::vector<bool> Kept(const KeepSpread& o, std::span<const std::string>,
                       std::span<const Vec3> points) {
  return FirstOf(FarthestFirst(points), o.n);
}

std::vector<bool> Kept(const KeepNames& o, std::span<const std::string> sites,
                       std::span<const Vec3>) {
  std::vector<bool> kept;
  for (const std::string& site : sites) {
    kept.push_back(std::ranges::find(o.sites, site) != o.sites.end());
  }
  return kept;
}

std::vector<bool> Kept(const KeepRandom& o, std::span<const std::string> sites,
                       std::span<const Vec3>) {
  std::vector<std::size_t> order(sites.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  Random(o.random_seed).Shuffle(order);
  return FirstOf(order, o.n);
}

}  // namespace

std::vector<bool> KeptSites(const LandmarksKept& kept, std::span<const std::string> sites,
                            std::span<const Vec3> points) {
  return std::visit([&](const auto& o) { return Kept(o, sites, points); }, kept);
}

}  // namespace semblance
