// SPDX-License-Identifier: GPL-3.0-or-later
// Finds mistakes that people make with a skull and its landmarks before anything runs, and proposes
// the likely remedy. Nothing is corrected here.
#pragma once

#include "problems/subject/dowel_placement.h"
#include "problems/subject/input_mistakes.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {

// The distance below which two landmarks count as one point: 0.5 mm, or 0.2 % of the diagonal of
// `extent`, the box of all landmarks, if that is less. The latter is for files in metres, where all
// points lie within a millimetre.
double SamePoint_mm(const Box3& extent);

// Searches for the mistakes below in this order. A mistake that explains the later ones ends the
// search.
//   same point      Sites lie within SamePoint_mm of each other.
//   another frame   More than half of the sites are farther than max_distance_mm from the bone, or
//                   their size is not that of a skull. Tries whether a forgotten conversion
//                   (input_mistakes.h) would lay them on the bone (median distance at most
//                   max_distance_mm).
//   sides swapped   The mirrored average skull fits and the average skull does not (median residual
//                   at most 12 mm, and at most 0.6 times the other). Either _l and _r are exchanged
//                   or the volume is mirrored; the two look alike.
//   size            The skull is not 0.7 to 1.4 times as large as the average skull.
//   pose            The skull is turned by more than 60 degrees from LPS. Tries whether it is RAS.
//   mandible open   The mandible is open by more than max_opening_deg (mandible.h).
//   far off         A site is farther than max_misfit_mm from where the others predict it.
//   mandible        All sites of the mandible are in the air. Only a note if none is given, none is
//                   listed as absent and no bone is near.
//   in the air      A site is farther than max_distance_mm from the bone.
//   reversed        A note: two sites lie the other way round than on the average skull, as if
//                   their names were exchanged.
//   asymmetry       A note: a pair is far from symmetric, or a site of the middle lies beside it.
//   depth order     A note: the depths are not thick and thin where those of people are.
//   uneven depths   A note: the depths of left and right differ far more than those of people.
//   depth level     A note: the depths are far smaller or larger than those of people.
//   proportions     A note: the skull is stretched along one axis.
//   offset          A note: half of the sites lie more than 1 mm off the bone.
// With fewer than six standard sites only `same point` and `in the air` are checked.
InputMistakes FindLandmarkMistakes(const LandmarkFile& file, const TriMesh& skull,
                                   const MeshQuery& query, const PlaceOptions& options);

}  // namespace semblance::problems
