// SPDX-License-Identifier: GPL-3.0-or-later
// Dowel networks as files (configs/networks): a title and the areas by their three sites.
#pragma once

#include <filesystem>

#include "interp/dowels/dowel_network.h"
#include "surfaces/base/fields.h"

namespace semblance {

template <class Visitor>
void Fields(Visitor& visit, NetworkPlan& plan) {
  visit(FieldInfo{.name = "title", .doc = "what the network is and where it comes from"},
        plan.title);
  visit(FieldInfo{.name = "areas",
                  .min = 1,
                  .doc = "the three sites of each area, counter-clockwise seen from outside"},
        plan.areas);
}

// Any sites may stand in it, also ones that are not standard. Throws IoError if the file cannot be
// read, ConfigError if it is not such a file, InputError if it has no area, an area names a site
// twice, or an area appears twice.
NetworkPlan ReadNetworkPlan(const std::filesystem::path& path);

}  // namespace semblance
