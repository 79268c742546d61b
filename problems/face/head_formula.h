// SPDX-License-Identifier: GPL-3.0-or-later
// A generic neutral adult face by formula: a lofted head with sculpted features, no one's data. And
// the points of it at which the standard dowels and facial landmarks lie (thesis 4.2: one
// association, fixed once, for all skulls).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance::problems {

// A point of the generic face in mm (LPS). The face looks to -y, and its soft-tissue nasion is near
// the origin. u in [0,1] runs from just behind the subject's right ear (azimuth -110 deg about the
// vertical axis of the head) over the midline (u = 0.5) to just behind the left ear. v in [0,1]
// runs from the throat round menton and up the face to the front of the crown. So du x dv points
// outward. The face is mirror symmetric to the bit: (u,v) -> (1-u,v) is x -> -x wherever 1-u is
// exact. It is smooth (C2) everywhere. It has no ears, hair or eye openings; the lids are closed.
Vec3 HeadPoint(double u, double v);

// The (u,v) on HeadPoint of each of StandardSites(): the point of the face that is closest to the
// site's soft-tissue point on an average adult face. Midline sites have u = 0.5 exactly. The right
// site of a pair is the mirror image of the left one, (1-u, v).
std::map<std::string, Vec2> TemplateSites();

// The (u,v) on HeadPoint of facial landmarks that no bone carries. They serve heads whose skin is
// known. They are pronasale prn, subnasale sn, subalare sbal_l, sbal_r (the foot of the wing of the
// nose), endocanthion en_l, en_r and exocanthion ex_l, ex_r (the corners of the eye), cheilion
// ch_l, ch_r (the corner of the mouth), labiale superius ls, stomion sto, labiale inferius li
// (Farkas 1994).
std::map<std::string, Vec2> FacialLandmarks();
std::vector<std::string> FacialLandmarkCodes();

// The (u,v) of a standard site or of a facial landmark. Throws InputError for another code.
Vec2 UvOnGenericHead(const std::string& code);

}  // namespace semblance::problems
