// SPDX-License-Identifier: GPL-3.0-or-later
// What can be said of landmarks while they are placed.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "problems/subject/dowel_placement.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance {

// Of one landmark, mm; NaN where it cannot be said.
struct SiteCheck {
  double from_bone_mm = kNaN;       // how far the point is from the bone
  double from_predicted_mm = kNaN;  // from where the others and an average skull predict it
  double from_mirror_mm = kNaN;     // from the mirror image of its partner, or from the mid-plane
};

struct LandmarkChecks {
  std::map<std::string, SiteCheck> sites;  // of those that are placed
  std::map<std::string, Vec3> predicted;   // of the standard sites that are not placed, on the bone
  std::vector<std::string> errors, notes;  // as FindLandmarkMistakes
};

// From three sites on the others are predicted, and from one pair and a third site the mid-plane is
// known. predicted points further than 15 mm from any bone are left out.
LandmarkChecks CheckLandmarks(const LandmarkFile& file, const TriMesh& skull, const MeshQuery& bone,
                              const PlaceOptions& options);

// The predicted points as landmarks that a person has to look at.
LandmarkFile PredictedLandmarks(const LandmarkChecks& checks);

}  // namespace semblance
