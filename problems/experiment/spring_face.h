// SPDX-License-Identifier: GPL-3.0-or-later
// The face of `face: springs`.
#pragma once

#include "problems/experiment/make_face.h"
#include "problems/face/face_source.h"

namespace semblance::problems {

// Relaxes a net over the domain of the template (RelaxSprings). It starts from the placed template
// under the thin plate that meets the tips of all dowels. The springs have the lengths of the
// placed template. Vertices are
//   - locked at the tips: those nearest in (u,v) to the sites of the dowels;
//   - locked at the edges of nose, mouth and eyes, and free inside them: the regions of the
//     template's features;
//   - held to the implicit face everywhere else.
// No vertex crosses the shell of the skull. The face is the start, moved by the B-spline of the
// net's level through the moves of the vertices. fit.levels has one summary, with the costs of
// springs, depth and bone. Throws InputError if the template lacks the level; Cancelled.
MadeFace MakeSpringFace(const SpringFace& options, PlacedTemplate placed, const FaceInput& in,
                        const RunContext& context);

}  // namespace semblance::problems
