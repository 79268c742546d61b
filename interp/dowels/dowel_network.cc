// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/dowels/dowel_network.h"

#include <fmt/format.h>

#include <map>
#include <set>

#include "surfaces/base/error.h"

namespace semblance {
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

}  // namespace semblance
