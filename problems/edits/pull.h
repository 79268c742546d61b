// SPDX-License-Identifier: GPL-3.0-or-later
// A surface pulled by hand: the level's control vertices that carry a point of it go along (direct
// manipulation, Forsey & Bartels 1988), kept as an edit script.
#pragma once

#include <map>
#include <optional>

#include "problems/edits/edit_script.h"

namespace semblance {

struct Pull {
  int level = 2;                      // whose vertices move; coarser moves more of the face
  Vec2 uv = Vec2::Constant(kNaN);     // the point that is held
  Vec3 by_mm = Vec3::Constant(kNaN);  // how far it goes, in the axes of the world
  double reach = 2;                   // how far around it vertices move, in patches of the level
  bool mirror = false;                // the other side, (1-u, v), likewise
};

// `script` with the pull made: where the script has made `face` of some surface, the returned one
// makes the pulled face of that surface. Each vertex within `reach` moves by by_mm times
// (1 - (distance / reach)^2)^2, scaled so that the point at `uv` moves by by_mm; finer detail rides
// along. With `mirror` both sides move so, about the plane that the face's own (u,v) tells; a
// point of the midline then stays in that plane. Throws InputError for a level that is not there,
// numbers that are not finite, or a reach outside 1..8 patches; as SetNet does.
EditScript Pulled(const Pull& pull, const HSplineSurface& face, const EditScript& script);

// `script` with these vertices' offsets (null: taken away), in place of what it said of them.
EditScript WithOffsets(EditScript script, const std::map<VertexId, std::optional<Vec3>>& offsets);

// The direction from the subject's right to the left, unit: from (1-u, v) to (u, v), over the whole
// domain. Throws InputError where the face has no such direction.
Vec3 LeftOf(const HSplineSurface& face);

}  // namespace semblance
