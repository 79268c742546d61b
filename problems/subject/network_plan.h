// SPDX-License-Identifier: GPL-3.0-or-later
// The plan of a dowel network: its file (configs/networks), and the plan without some of its sites.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>

#include "interp/dowels/dowel_network.h"
#include "surfaces/base/fields.h"
#include "surfaces/base/geometry.h"

namespace semblance::problems {

// Reads a plan: a title and the areas by their three sites, which need not be standard sites.
// Throws IoError if the file cannot be read, ConfigError if it is not such a file, and InputError
// if it has no area, an area names a site twice, or an area appears twice.
NetworkPlan ReadNetworkPlan(const std::filesystem::path& path);

// Removes the sites `gone` from the plan, so that fewer and larger areas cover the same skull. Each
// site moves into a neighbour, and the areas between the two vanish (an edge collapse; Hoppe 1996).
// A neighbour is admissible if the network stays sound: no area turns over, no area appears twice,
// no edge gets a third area, and the border stays a border. Among the admissible neighbours the one
// is chosen that leaves the best-shaped areas. A site without an admissible neighbour stays in the
// plan, and BuildNetwork later drops its areas.
//
// Removing an inner site leaves the covered region unchanged. Without a site of the border, the
// border runs straight between that site's neighbours. `points` has the points of the sites in any
// unit; areas with a site that has no point stay unchanged.
NetworkPlan WithoutSites(NetworkPlan plan, const std::set<std::string>& gone,
                         const std::map<std::string, Vec3>& points);

}  // namespace semblance::problems
