// SPDX-License-Identifier: GPL-3.0-or-later
// A dowel network without some of its sites: the areas close over them.
#pragma once

#include <map>
#include <set>
#include <string>

#include "interp/dowels/dowel_network.h"
#include "surfaces/base/geometry.h"

namespace semblance {

// Each site of `gone` moves into a neighbour, and the areas between the two vanish (an edge
// collapse; Hoppe 1996): fewer and larger areas. Without a site inside, the network covers what it
// covered; without one of its border, the border runs straight between that site's neighbours.
// Of the neighbours that keep it sound (no area turns over, none appears twice, no edge gets a
// third area, the border stays a border) that one which leaves the best-shaped areas. A site
// without such a neighbour stays in the plan, and its areas fall away where the network is built.
//
// points: of the sites, in any unit. Areas of sites that are not among them are left as they are.
NetworkPlan WithoutSites(NetworkPlan plan, const std::set<std::string>& gone,
                         const std::map<std::string, Vec3>& points);

}  // namespace semblance
