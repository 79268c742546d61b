// SPDX-License-Identifier: GPL-3.0-or-later
// Mistakes that people make with a skull and its landmarks, found before anything runs, with the
// likely remedy. Nothing is mended here.
#pragma once

#include <string>
#include <vector>

#include "problems/subject/landmarks.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance {

struct LandmarkMistakes {
  std::vector<std::string> errors;  // one line each; a subject with one cannot be used
  std::vector<std::string> notes;   // what may be meant so
};

// So near to each other two landmarks have the same point: 0.5 mm, or 0.2 % of the extent of all if
// that is less, for files in metres have all points within a millimetre.
double SamePoint_mm(const Box3& of_all);

// In this order; what explains the rest ends the search.
//   same point      sites within SamePoint_mm of each other
//   another frame   more than half of the sites further than max_distance_mm from the bone, or of
//                   another size than a skull: whether negated axes or another unit would lay them
//                   on the bone (median at most that far)
//   sides swapped   the mirrored average skull fits, the average skull does not (median residual at
//                   most 12 mm, and at most 0.6 times the other): _l and _r exchanged, or a
//                   mirrored volume, which look alike
//   size            0.7 to 1.4 times the average skull is a skull
//   pose            turned by more than 60 degrees from LPS: whether it is RAS
//   mandible open   by more than max_opening_deg (jaw_pose.h)
//   far off         a site further than max_misfit_mm from where the others predict it
//   mandible        all its sites in the air; a note where none is given, none is called absent and
//                   no bone is near
//   in the air      a site further than max_distance_mm from the bone
// From six sites on; fewer are looked at for same points and for air alone.
LandmarkMistakes FindLandmarkMistakes(const LandmarkFile& file, const TriMesh& skull,
                                      const MeshQuery& query, const PlaceOptions& options);

}  // namespace semblance
