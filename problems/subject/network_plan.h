// SPDX-License-Identifier: GPL-3.0-or-later
// The plan of a dowel network: its file (configs/networks), and the plan without some of its sites.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "interp/dowels/dowel_network.h"
#include "problems/subject/extra_sites.h"
#include "problems/subject/landmarks.h"
#include "surfaces/base/fields.h"
#include "surfaces/base/geometry.h"

namespace semblance::problems {

// Reads a plan: a title and the areas by their three sites, which need not be standard sites.
// Throws IoError if the file cannot be read, ConfigError if it is not such a file, and InputError
// if it has no area or another number of areas than it states, an area names a site twice or
// appears twice, an edge has more than two areas, or the two areas of an edge turn differently.
NetworkPlan ReadNetworkPlan(const std::filesystem::path& path);

// Compares the plan of `file` with the subject's sites. Throws InputError if an area names a site
// that is neither in sites.h nor in `further`, or if no area names a standard site that has a
// landmark: then the file may have been cut short. A plan that states its number of areas may leave
// out sites. Returns a note if nearly all areas have a mirror image in the plan and some lack it.
std::vector<std::string> CheckNetworkSites(const NetworkPlan& plan,
                                           const std::filesystem::path& file,
                                           std::span<const Landmark> landmarks,
                                           const ExtraSites& further);

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
