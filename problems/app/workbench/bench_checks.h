// SPDX-License-Identifier: GPL-3.0-or-later
// Checks of the landmarks, made after each action while a person places them.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "problems/subject/dowel_placement.h"
#include "problems/subject/propose/suggestion_check.h"

namespace semblance::problems {

// Distances of one landmark in mm; NaN if a distance cannot be computed.
struct SiteCheck {
  double from_bone_mm = kNaN;       // to the closest point of the bone
  double from_predicted_mm = kNaN;  // to the prediction from the others and an average skull
  double from_mirror_mm = kNaN;     // to the mirror image of its partner, or to the mid-plane
};

struct LandmarkChecks {
  std::map<std::string, SiteCheck> sites;  // the placed sites
  std::map<std::string, Vec3> predicted;   // standard sites not placed, on the bone
  std::vector<std::string> errors, notes;  // from FindLandmarkMistakes
};

// Three sites or more predict the others, one pair and a third site define the mid-plane. A
// prediction is the outermost bone in its site's direction (FindOuterPoint); one without such bone
// is left out. It only shows where to click: proposals follow the skull's shape.
LandmarkChecks CheckLandmarks(const LandmarkFile& file, const SuggestedBone& bone,
                              const PlaceOptions& options);

}  // namespace semblance::problems
