// SPDX-License-Identifier: GPL-3.0-or-later
// Depths of a subject's own skin, for `tissue: {depths: skin}`: a head with a known face needs no
// list of depths then.
#pragma once

#include <string>
#include <vector>

#include "problems/experiment/case.h"

namespace semblance::problems {

// Replaces the depths of all landmarks by those along the directions of their dowels, to the skin
// that is seen from outside. A landmark where none can be measured, as before a hole, has no depth
// afterwards: the closest skin lies beside it. Returns a note on each of those, with the reason.
// Throws InputError if the subject has no skin; throws Cancelled.
std::vector<std::string> MeasureOnSkin(const Experiment& experiment, const MeshQuery& skull,
                                       const RunContext& context, SubjectData& subject);

}  // namespace semblance::problems
