// SPDX-License-Identifier: GPL-3.0-or-later
// The dowel network (thesis def. 2.3): which three dowels share an area.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "interp/dowels/dowel.h"

namespace semblance {

// A network by site names, as published or as written in a file; valid for every subject.
struct NetworkPlan {
  std::string title;
  std::vector<std::array<std::string, 3>> areas;  // sites, e.g. {"sg", "g", "mso_l"}
};

// The network of one subject: areas as indices into its dowels.
struct DowelNetwork {
  std::vector<std::array<int, 3>> areas;
  std::vector<std::string> dropped;  // one line for each area that needs a site which has no dowel
  std::vector<std::string> missing_sites = {};  // those sites, each once, sorted
};

// Areas in the plan's order; those that name a site without a dowel are dropped, and said so.
// Throws InputError if two dowels share a site or if an area names a site twice.
DowelNetwork BuildNetwork(const NetworkPlan& plan, std::span<const Dowel> dowels);

}  // namespace semblance
