// SPDX-License-Identifier: GPL-3.0-or-later
// A subject's dowels and implicit face as observations of a face prior.
#pragma once

#include <map>
#include <span>
#include <string>

#include "interp/dowels/dowel.h"
#include "problems/prior/depth_spread.h"
#include "problems/prior/face_prior.h"

namespace semblance {

// dowels: with depths, in the subject's frame; those whose site neither the prior nor `more` has
// are left out. from_table: null for measured depths. The start is the similarity that brings the
// mean's own sites to the tips. implicit: outward, must outlive the result; may be null. Throws
// InputError if fewer than three dowels are at the prior's own sites.
ShapeTarget PriorTarget(const FacePrior& prior, std::span<const Dowel> dowels,
                        const TableDepthOptions* from_table, const TriMesh* implicit,
                        const std::map<std::string, ModelPoint>& more = {});

}  // namespace semblance
