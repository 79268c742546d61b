// SPDX-License-Identifier: GPL-3.0-or-later
// Where the standard dowels meet the generic face: the (u,v) of the soft-tissue point over each
// bone landmark (thesis 4.2: one association, fixed once, for all skulls).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance {

// The (u,v) on HeadPoint of each of StandardSites(): the point of the face closest to where the
// site's soft-tissue point lies on an average adult face. Midline sites have u = 0.5 exactly; the
// right of a pair is the mirror image of the left, (1-u, v).
std::map<std::string, Vec2> TemplateSites();

// The (u,v) on HeadPoint of landmarks of the face that no bone carries, for heads whose skin is
// known: pronasale prn, subnasale sn, subalare sbal_l, sbal_r (the foot of the wing of the nose),
// endocanthion en_l, en_r and exocanthion ex_l, ex_r (the corners of the eye), cheilion ch_l, ch_r
// (the corner of the mouth), labiale superius ls, stomion sto, labiale inferius li (Farkas 1994).
std::map<std::string, Vec2> FacialLandmarks();
std::vector<std::string> FacialLandmarkCodes();

// The (u,v) of a standard site or of a facial landmark. Throws InputError for another code.
Vec2 UvOnGenericHead(const std::string& code);

}  // namespace semblance
