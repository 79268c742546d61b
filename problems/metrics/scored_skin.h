// SPDX-License-Identifier: GPL-3.0-or-later
// Which of the true skin is scored, decided from the skull's landmarks alone and before any face
// exists: the outer skin of the face, without what the experiment excludes by name.
#pragma once

#include <array>
#include <span>
#include <string_view>
#include <vector>

#include "problems/metrics/face_region.h"
#include "problems/metrics/outer_skin.h"
#include "surfaces/mesh/cut_planes.h"

namespace semblance {

// Why a vertex of the skin is scored or not; the first that holds, from the last to the first.
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

// Of the face: in the frame of an average skull (average_skull.h; mm of it)
//   hairline  z <= 55: below hair, which scans do not show as skin (nasion to hairline is 67 mm in
//             an adult man: Farkas 1994);
//   ears      y <= 75: 6 mm in front of supraglenoid, in front of the ears' roots;
//   chin      above the plane through menton and both gonia, the lower border of the jaw.
// The planes need the pose of the skull alone, so that a landmark more or less hardly moves them.
// The part of the face is that of the nearest of all 32 sites. extent `network`: in front of the
// dowels' network instead. Throws InputError as InFrontOfNetwork and FindOuterSkin.
ScoredSkin FindScoredSkin(const TriMesh& skin, const SkullSites& sites,
                          std::span<const Dowel> dowels, const DowelNetwork& network,
                          const FaceRegionOptions& options);
// felt: FindOuterSkin(skin, options.probe_mm), which takes longer than all the rest.
ScoredSkin FindScoredSkin(const TriMesh& skin, const OuterSkin& felt, const SkullSites& sites,
                          std::span<const Dowel> dowels, const DowelNetwork& network,
                          const FaceRegionOptions& options);

// All of it, without parts: for meshes of which nothing is known.
ScoredSkin AllScored(const TriMesh& skin);

}  // namespace semblance
