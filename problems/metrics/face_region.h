// SPDX-License-Identifier: GPL-3.0-or-later
// Options of the scored region, and what lies in front of a dowel network. Which of the true skin
// is scored: scored_skin.h.
#pragma once

#include <array>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "interp/dowels/dowel_network.h"
#include "problems/subject/average_skull.h"
#include "surfaces/base/fields.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// What is closer than radius_mm to `site` is not scored (a fracture, a moustache, an artefact).
struct ExcludedZone {
  std::string site;       // at its centre
  double radius_mm = 20;  // around it
};
template <class Visitor>
void Fields(Visitor& visit, ExcludedZone& o) {
  visit(
      FieldInfo{.name = "site",
                .doc =
                    "landmark code at the zone's centre, e.g. zy_r; where the subject has no such "
                    "landmark, where an average skull has it"},
      o.site);
  visit(FieldInfo{.name = "radius_mm",
                  .unit = "mm",
                  .min = 0.1,
                  .max = 200,
                  .doc = "radius around the site on bone"},
        o.radius_mm);
}

// What of the skin is the face.
enum class RegionExtent {
  kFace,    // by planes of the head, whatever landmarks there are
  kNetwork  // in front of the dowels' network
};
constexpr auto EnumNames(RegionExtent) {
  return std::to_array<std::string_view>({"face", "network"});
}

struct FaceRegionOptions {
  RegionExtent extent = RegionExtent::kFace;  // the face, or before the dowel network
  double probe_mm = 6;                        // of the ball that feels the outer skin
  double margin_mm = 0;                       // beyond the network's border
  double reach_mm = 60;                       // from the network
  std::vector<ExcludedZone> exclude;          // not scored
};
template <class Visitor>
void Fields(Visitor& visit, FaceRegionOptions& o) {
  visit(FieldInfo{.name = "extent",
                  .doc = "face: skin below the hairline, in front of the ears and above the lower "
                         "border of the jaw, the same whatever landmarks there are; network: skin "
                         "in front of the dowel network"},
        o.extent);
  visit(FieldInfo{.name = "probe_mm",
                  .unit = "mm",
                  .min = 1,
                  .max = 30,
                  .doc = "only skin that a ball of this radius can touch from outside is scored: "
                         "less enters nostrils, more skips folds"},
        o.probe_mm);
  visit(FieldInfo{.name = "margin_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 50,
                  .doc = "of the network: skin whose nearest network point lies on the network's "
                         "border is still "
                         "scored up to this far from it, measured across the border"},
        o.margin_mm);
  visit(FieldInfo{.name = "reach_mm",
                  .unit = "mm",
                  .min = 5,
                  .max = 200,
                  .doc = "of the network: skin further than this from it is not scored"},
        o.reach_mm);
  visit(FieldInfo{.name = "exclude", .doc = "zones that are not scored, declared before the run"},
        o.exclude);
}

// Names of the parts of the face, and the part to which the skin nearest to a site belongs.
inline constexpr std::array<const char*, 8> kFaceParts = {"forehead", "orbits", "nose", "cheeks",
                                                          "mouth",    "chin",   "jaw",  "temples"};
int FacePartOfSite(
    const std::string& site);  // index into kFaceParts; throws InputError for an unknown site

// One entry per vertex of a mesh.
struct FaceRegion {
  std::vector<bool> scored;
  std::vector<int> part;  // index into kFaceParts of the nearest site; -1 where not scored
  // Whether a distance may be taken to it; only what faces outside air of a skin. Empty: to all.
  std::vector<bool> outer = {};
};

// The part of the nearest of the sites. points: by site; not empty.
int NearestPart(const Vec3& p, const std::map<std::string, Vec3>& points);

// Around the sites; a site is looked for in `points`. Throws InputError for a site that is not
// there.
std::vector<Sphere> ExcludedSpheres(const std::map<std::string, Vec3>& points,
                                    const std::vector<ExcludedZone>& zones);

// A vertex is scored if its nearest point on the triangles of the dowels' bases lies inside the
// network (or within margin_mm across its border), is no further than reach_mm, and is in no
// excluded zone. points: the skull's sites, for zones at sites without a dowel. Throws InputError
// if the network has no area or an excluded site is in neither.
FaceRegion InFrontOfNetwork(const TriMesh& mesh, std::span<const Dowel> dowels,
                            const DowelNetwork& network, const std::map<std::string, Vec3>& points,
                            const FaceRegionOptions& options);

}  // namespace semblance
