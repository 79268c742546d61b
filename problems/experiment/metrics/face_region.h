// SPDX-License-Identifier: GPL-3.0-or-later
// The part of the true skin that is scored. It is decided from the skull's landmarks alone, before
// any face exists.
#pragma once

#include <array>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "interp/dowels/dowel_network.h"
#include "problems/experiment/metrics/outer_skin.h"
#include "problems/subject/average_skull.h"
#include "problems/subject/sites.h"
#include "surfaces/base/fields.h"
#include "surfaces/mesh/cut_planes.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

// ---------------------------------------------------------------------------------------------
// Options
// ---------------------------------------------------------------------------------------------

// A ball that is not scored, because of a fracture, a moustache or an artefact.
struct ExcludedZone {
  std::string site;
  double radius_mm = 20;
};
template <class Visitor>
void Fields(Visitor& visit, ExcludedZone& o) {
  visit(
      FieldInfo{
          .name = "site",
          .doc = "code of the landmark at the zone's centre, e.g. zy_r; if the subject lacks it, "
                 "the place of an average skull is taken"},
      o.site);
  visit(FieldInfo{.name = "radius_mm",
                  .unit = "mm",
                  .min = 0.1,
                  .max = 200,
                  .doc = "radius around the site on bone"},
        o.radius_mm);
}

// The part of the skin that counts as the face.
enum class RegionExtent {
  kFace,    // by planes of the head, whatever landmarks there are
  kNetwork  // in front of the dowels' network
};
constexpr auto EnumNames(RegionExtent) {
  return std::to_array<std::string_view>({"face", "network"});
}

struct FaceRegionOptions {
  RegionExtent extent = RegionExtent::kFace;
  double probe_mm = 6;
  double margin_mm = 0;
  double reach_mm = 60;
  std::vector<ExcludedZone> exclude;
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
                  .doc = "only skin that a ball of this radius can touch from outside is scored; a "
                         "smaller ball enters nostrils, a larger one skips folds"},
        o.probe_mm);
  visit(FieldInfo{.name = "margin_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 50,
                  .doc = "for extent network: skin whose nearest network point lies on the "
                         "network's border is still scored up to this distance across the border"},
        o.margin_mm);
  visit(FieldInfo{.name = "reach_mm",
                  .unit = "mm",
                  .min = 5,
                  .max = 200,
                  .doc = "for extent network: skin farther than this from the network is not "
                         "scored"},
        o.reach_mm);
  visit(FieldInfo{.name = "exclude", .doc = "zones that are not scored, declared before the run"},
        o.exclude);
}

// ---------------------------------------------------------------------------------------------
// Regions
// ---------------------------------------------------------------------------------------------

// One entry per vertex of a mesh.
struct FaceRegion {
  std::vector<bool> scored;
  std::vector<int> part;  // index of kFaceParts, of the nearest site; -1 if not scored
  // True if the vertex faces outside air, so that distances may be measured to it. Empty: all do.
  std::vector<bool> outer = {};
};

// All of `truth` as one region without parts.
FaceRegion WholeSurface(const TriMesh& truth);

// The part of the nearest site. points: by site; not empty.
int NearestPart(const Vec3& p, const std::map<std::string, Vec3>& points);

// The balls of the zones. points: by site. Throws InputError for a zone at another site.
std::vector<Sphere> ExcludedSpheres(const std::map<std::string, Vec3>& points,
                                    const std::vector<ExcludedZone>& zones);

// Scores a vertex if its nearest point on the triangles of the dowels' bases lies inside the
// network (or within margin_mm across its border) and within reach_mm, and if it lies in no
// excluded zone. points: the skull's sites, for zones at sites without a dowel. Throws InputError
// if the network has no area, or if a zone's site is neither among the dowels nor among the points.
FaceRegion InFrontOfNetwork(const TriMesh& mesh, std::span<const Dowel> dowels,
                            const DowelNetwork& network, const std::map<std::string, Vec3>& points,
                            const FaceRegionOptions& options);

// ---------------------------------------------------------------------------------------------
// The scored skin
// ---------------------------------------------------------------------------------------------

// The reason why a vertex of the skin is scored or not. If several hold, the last of the list
// counts.
enum class SkinStatus {
  kScored,
  kMasked,  // in an excluded zone
  kInner,   // a wall of an airway or a sinus, a fold too narrow for the probe
  kEnd,     // a lid where the scan ended
  kBeyond   // not the face: hair, ears, neck, back of the head
};
constexpr auto EnumNames(SkinStatus) {
  return std::to_array<std::string_view>({"scored", "masked", "inner", "end", "beyond"});
}

struct ScoredSkin {
  FaceRegion region;
  std::vector<SkinStatus> status;    // one per vertex
  std::array<double, 5> area_cm2{};  // by SkinStatus
  std::vector<CutPlane> ends = {};   // of the scan
};

// The outer skin of the face without the excluded zones. In the frame and millimetres of an average
// skull (average_skull.h), the face is bounded by three planes:
//   hairline  z <= 55: below hair, which scans do not show as skin (nasion to hairline is 67 mm in
//             an adult man: Farkas 1994);
//   ears      y <= 75: 6 mm in front of supraglenoid, in front of the ears' roots;
//   chin      above the plane through menton and both gonia, the lower border of the jaw.
// The planes need only the pose of the skull, so that one landmark more or less hardly moves them.
// The part of a vertex is that of the nearest of all 32 sites. With extent `network` the skin in
// front of the dowels' network takes the place of the face. Throws InputError as InFrontOfNetwork
// and FindOuterSkin do.
ScoredSkin FindScoredSkin(const TriMesh& skin, const SkullSites& sites,
                          std::span<const Dowel> dowels, const DowelNetwork& network,
                          const FaceRegionOptions& options);
// outer: FindOuterSkin(skin, options.probe_mm), which takes longer than all the rest.
ScoredSkin FindScoredSkin(const TriMesh& skin, const OuterSkin& outer, const SkullSites& sites,
                          std::span<const Dowel> dowels, const DowelNetwork& network,
                          const FaceRegionOptions& options);

// Scores the whole mesh, without parts: for meshes without landmarks.
ScoredSkin AllScored(const TriMesh& skin);

}  // namespace semblance::problems
