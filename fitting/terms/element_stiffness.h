// SPDX-License-Identifier: GPL-3.0-or-later
// The energies of the smoothness and membrane terms on one patch.
#pragma once

#include "fitting/least_squares/patch_energy.h"
#include "fitting/terms/term.h"

namespace semblance {

// What the term costs on one patch of a level of patches_u x patches_v, mm^2: x^T form x for each
// coordinate x of the patch's sixteen f. lengths_mm: what [0,1] stands for along u and v.
ElementStiffness StiffnessOf(const SmoothnessTerm& term, const Vec2& lengths_mm, int patches_u,
                             int patches_v);
ElementStiffness StiffnessOf(const MembraneTerm& term, const Vec2& lengths_mm, int patches_u,
                             int patches_v);

}  // namespace semblance
