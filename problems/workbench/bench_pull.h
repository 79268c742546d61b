// SPDX-License-Identifier: GPL-3.0-or-later
// What a pull (problems/edits/pull.h) does to the face that the page shows, so that the page can
// draw it while the pointer moves.
#pragma once

#include <array>
#include <vector>

#include "problems/edits/pull.h"

namespace semblance {

// (u,v) of the face's point that is nearest to `at`, to a fraction of the triangles shown.
Vec2 HeldParameter(const HSplineSurface& face, const Vec3& at);

// For pulls of 1 mm along x, y and z: the way of each vertex of Tessellate(face, per_patch), in mm.
// A pull's way is their sum, for it is linear in by_mm but for the turning of finer detail.
// pull.by_mm counts not. Throws as Pulled.
std::array<std::vector<Vec3>, 3> PullMoves(const HSplineSurface& face, Pull pull, int per_patch);

}  // namespace semblance
