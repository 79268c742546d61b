// SPDX-License-Identifier: GPL-3.0-or-later
// A generic neutral adult face by formula: a lofted head with sculpted features, no one's data.
#pragma once

#include "surfaces/base/geometry.h"

namespace semblance {

// A point of the generic face, mm, LPS: the face looks to -y, its soft-tissue nasion is near the
// origin. u in [0,1] runs from just behind the subject's right ear (-110 deg of azimuth round the
// vertical axis through the head) over the midline (u = 0.5) to just behind the left ear; v in
// [0,1] from the throat below the chin, round menton, up the face to the front of the crown. So
// du x dv points outward. Mirror symmetric to the bit: (u,v) -> (1-u,v) is x -> -x wherever 1-u is
// exact. Smooth (C2) everywhere; ears, hair and eye openings are left out, the lids are closed.
Vec3 HeadPoint(double u, double v);

}  // namespace semblance
