// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/network_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "problems/config/config.h"

namespace semblance {

NetworkPlan ReadNetworkPlan(const std::filesystem::path& path) {
  NetworkPlan plan = ReadConfig<NetworkPlan>(path);
  if (plan.areas.empty()) {
    throw InputError(fmt::format("{}: areas: the network has none; list the three sites of each",
                                 path.string()));
  }
  std::set<std::array<std::string, 3>> known;
  for (const auto& area : plan.areas) {
    auto sorted = area;
    std::sort(sorted.begin(), sorted.end());
    if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) {
      throw InputError(fmt::format(
          "{}: area [{}, {}, {}] names a site twice; an area needs three different sites",
          path.string(), area[0], area[1], area[2]));
    }
    if (!known.insert(sorted).second) {
      throw InputError(fmt::format("{}: area [{}, {}, {}] appears twice; keep one", path.string(),
                                   area[0], area[1], area[2]));
    }
  }
  return plan;
}

}  // namespace semblance
