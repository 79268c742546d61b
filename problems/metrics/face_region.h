// SPDX-License-Identifier: GPL-3.0-or-later
// Which part of the true skin is scored, decided from the skull's dowels alone and before any face
// exists: the skin in front of the dowel network, without what the experiment excludes by name.
#pragma once

#include <array>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "interp/dowels/dowel_network.h"
#include "surfaces/base/fields.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// Skin closer than radius_mm to the dowel of `site` is not scored (a fracture, a moustache, an
// artefact).
struct ExcludedZone {
  std::string site;
  double radius_mm = 20;
};
template <class Visitor>
void Fields(Visitor& visit, ExcludedZone& o) {
  visit(FieldInfo{.name = "site", .doc = "landmark code at the zone's centre, e.g. zy_r"}, o.site);
  visit(FieldInfo{.name = "radius_mm",
                  .unit = "mm",
                  .min = 0.1,
                  .max = 200,
                  .doc = "radius around the landmark on bone"},
        o.radius_mm);
}

struct FaceRegionOptions {
  double margin_mm = 0;               // beyond the network's border
  double reach_mm = 60;               // from the network
  std::vector<ExcludedZone> exclude;  // not scored
};
template <class Visitor>
void Fields(Visitor& visit, FaceRegionOptions& o) {
  visit(FieldInfo{.name = "margin_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 50,
                  .doc = "skin whose nearest network point lies on the network's border is still "
                         "scored up to this far from it, measured across the border"},
        o.margin_mm);
  visit(FieldInfo{.name = "reach_mm",
                  .unit = "mm",
                  .min = 5,
                  .max = 200,
                  .doc = "skin further than this from the dowel network is not scored"},
        o.reach_mm);
  visit(FieldInfo{.name = "exclude", .doc = "zones that are not scored, declared before the run"},
        o.exclude);
}

// Names of the parts of the face, and the part to which the skin nearest to a site belongs.
inline constexpr std::array<const char*, 8> kFaceParts = {"forehead", "orbits", "nose", "cheeks",
                                                          "mouth",    "chin",   "jaw",  "temples"};
int FacePartOfSite(
    const std::string& site);  // index into kFaceParts; throws InputError for an unknown site

// One entry per vertex of the skin.
struct FaceRegion {
  std::vector<bool> scored;
  std::vector<int> part;  // index into kFaceParts of the nearest dowel's site; -1 where not scored
};

// A vertex is scored if its nearest point on the triangles of the dowels' bases lies inside the
// network (or within margin_mm across its border), is no further than reach_mm, and is in no
// excluded zone. Throws InputError if the network has no area or an excluded site no dowel.
FaceRegion FindFaceRegion(const TriMesh& skin, std::span<const Dowel> dowels,
                          const DowelNetwork& network, const FaceRegionOptions& options);

}  // namespace semblance
