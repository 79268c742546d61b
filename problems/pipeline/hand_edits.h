// SPDX-License-Identifier: GPL-3.0-or-later
// What an experiment's edit script does to the face that comes out.
#pragma once

#include <optional>

#include "problems/pipeline/case.h"
#include "problems/pipeline/make_face.h"

namespace semblance {

// Replays experiment.edits on the face and on those drawn beside it, where there is a script, and
// says so in the subject's notes and inputs; the residuals are then those of the edited face.
// Returns the face as it was before; none where there is no script. Throws as ReadEditScript and
// ApplyEdits.
std::optional<HSplineSurface> EditByHand(const Experiment& experiment, MadeFace& made,
                                         Case& subject);

}  // namespace semblance
