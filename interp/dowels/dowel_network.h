// SPDX-License-Identifier: GPL-3.0-or-later
// The dowel network (thesis def. 2.3): triples of dowels that form areas, the insertion of
// further dowels, and the removal of dowels.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "interp/dowels/dowel.h"
#include "surfaces/base/fields.h"

namespace semblance::interp {

// A network given by site names, as published or as in a file. It is valid for every subject.
struct NetworkPlan {
  std::string title;
  std::optional<int> area_count;                  // as the file states it
  std::vector<std::array<std::string, 3>> areas;  // sites, e.g. {"sg", "g", "mso_l"}
};
template <class Visitor>
void Fields(Visitor& visit, NetworkPlan& plan) {
  visit(FieldInfo{.name = "title", .doc = "what the network is and where it comes from"},
        plan.title);
  visit(FieldInfo{.name = "area_count",
                  .min = 1,
                  .doc = "the number of areas; a file that was cut short has fewer and is refused"},
        plan.area_count);
  visit(FieldInfo{.name = "areas",
                  .min = 1,
                  .doc = "the three sites of each area, counter-clockwise seen from outside"},
        plan.areas);
}

// The network of one subject, with areas as indices into the subject's dowels.
struct DowelNetwork {
  std::vector<std::array<int, 3>> areas;
  std::vector<std::string> dropped;             // one line per area with a site that has no dowel
  std::vector<std::string> missing_sites = {};  // these sites, sorted, without repeats
};

// Builds the areas in the plan's order. Areas with a site that has no dowel are dropped and listed
// in `dropped`. Throws InputError if two dowels share a site, or an area names a site twice.
DowelNetwork BuildNetwork(const NetworkPlan& plan, std::span<const Dowel> dowels);

enum class Insertion {
  kInside,   // the area around the dowel was split into three, or each area at its edge into two
  kOutside,  // one area was added at the nearest border edge with the dowel on its outer side
  kNone      // not inserted: it is on another dowel's base, or no border edge gives a sound area
};

// Inserts a dowel that the network's plan does not name (thesis 4.2). dowels: all dowels, with
// bases and directions; depths are not used. index: the new dowel, which must not be in an area.
// The depths at the bases of all other dowels stay the same. Throws InputError as DowelAreas does
// for areas that are not sound.
Insertion InsertIntoNetwork(std::span<const Dowel> dowels, int index, DowelNetwork& network);

// Indices of dowels that are left out together.
using Folds = std::vector<std::vector<std::size_t>>;

// Some of the dowels, with their network.
struct ShownDowels {
  std::vector<Dowel> dowels;
  DowelNetwork network;

  // The distance from a point to the nearest dowel.
  double NearestTo_mm(const Vec3& p) const;
};

// Removes the fold's dowels from the network. If a removed dowel was inside the network, its
// neighbours are joined by new areas across the gap, as if it had never been placed. The chosen fan
// from one neighbour is the one with the largest minimum angle. At the border, or if no fan is
// sound, the dowel's areas are removed without replacement.
ShownDowels LeaveOutDowels(std::span<const Dowel> dowels, const DowelNetwork& network,
                           const std::vector<std::size_t>& fold);

}  // namespace semblance::interp
