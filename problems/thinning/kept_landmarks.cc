// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/thinning/kept_landmarks.h"

#include <algorithm>
#include <numeric>

#include "surfaces/base/farthest_first.h"
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

// Beginning with the one that is farthest from the mean of all.
std::vector<std::size_t> SpreadFirst(std::span<const Vec3> points) {
  const Vec3 mean = std::accumulate(points.begin(), points.end(), Vec3(Vec3::Zero())) /
                    static_cast<double>(std::max<std::size_t>(1, points.size()));
  const auto first =
      std::ranges::max_element(points, {}, [&](const Vec3& p) { return (p - mean).norm(); });
  return FarthestFirst(points, static_cast<std::size_t>(first - points.begin()), points.size());
}

std::vector<bool> Kept(const KeepAll&, std::span<const std::string> sites, std::span<const Vec3>) {
  return std::vector<bool>(sites.size(), true);
}

std::vector<bool> Kept(const KeepSpread& o, std::span<const std::string>,
                       std::span<const Vec3> points) {
  return FirstOf(SpreadFirst(points), o.n);
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
