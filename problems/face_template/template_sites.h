// SPDX-License-Identifier: GPL-3.0-or-later
// Where the standard dowels meet the generic face: the (u,v) of the soft-tissue point over each
// bone landmark (thesis 4.2: one association, fixed once, for all skulls).
#pragma once

#include <map>
#include <string>

#include "surfaces/base/geometry.h"

namespace semblance {

// The (u,v) on HeadPoint of each of StandardSites(): the point of the face closest to where the
// site's soft-tissue point lies on an average adult face. Midline sites have u = 0.5 exactly; the
// right of a pair is the mirror image of the left, (1-u, v).
std::map<std::string, Vec2> TemplateSites();

}  // namespace semblance
