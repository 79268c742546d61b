// SPDX-License-Identifier: GPL-3.0-or-later
// Applies the bounds of tissue depth that an expert knows (tissue.bounds) to one person.
#pragma once

#include "interp/dowels/depth_input.h"
#include "problems/experiment/case.h"

namespace semblance::problems {

// Limits the dowels on bone: a depth of a table beyond a bound becomes the nearest allowed one, and
// its deviation at most half the width of the range. Notes and subject.bounds name these dowels.
// Throws InputError, one line per dowel, for a known depth beyond a bound (measured, set by hand,
// or given of this person), and if fewer than three landmarks are at standard sites, so that the
// bone of a site is not known.
void LimitDowels(const Experiment& experiment, const LandmarkFile& landmarks, Case& subject);

// Limits the depths of the shell's vertices and their deviations in the same way, also those of the
// outside rule. A bound counts from the bone: over a gap that the shell bridges it allows the depth
// less the distance of the shell from the bone, but at least 1 mm. Vertices without a depth stay
// without. Sets the areas, shares and moves of subject.bounds, and adds a note per bound that moved
// some.
void LimitDepths(const Experiment& experiment, const TriMesh& shell, Case& subject,
                 DepthField& field);

}  // namespace semblance::problems
