// SPDX-License-Identifier: GPL-3.0-or-later
// Pulls a surface by hand. The control vertices of a level that carry the held point move with it
// (direct manipulation, Forsey & Bartels 1988). The result is an edit script.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string_view>

#include "problems/face/edit_script.h"

namespace semblance::problems {

struct Pull {
  int level = 2;                      // level whose vertices move; a coarser one moves more
  Vec2 uv = Vec2::Constant(kNaN);     // the held point
  Vec3 by_mm = Vec3::Constant(kNaN);  // its displacement, in world axes
  double reach = 2;                   // vertices within this move, in patches of the level
  bool mirror = false;                // also pulls the other side, (1-u, v)
};

// Adds the pull to `script`. If the script changes some surface into `face`, the returned script
// changes that surface into the pulled face. Each vertex within `reach` moves by by_mm times
// (1 - (distance / reach)^2)^2, scaled so that the point at `uv` moves by by_mm. Finer detail
// follows. With `mirror` both sides move, mirrored at the plane that the face's own (u,v) defines.
// A point of the midline then stays in that plane. Throws InputError for a missing level, for
// numbers that are not finite, for a reach outside 1..8 patches, and as SetNet does.
EditScript Pulled(const Pull& pull, const HSplineSurface& face, const EditScript& script);

enum class BrushKind { kSmooth, kInflate, kFlatten };
constexpr auto EnumNames(BrushKind) {
  return std::to_array<std::string_view>({"smooth", "inflate", "flatten"});
}

// A brush at a point of the face. Each control vertex of the level within reach moves by
// share * strength, where share is (1 - (distance / reach)^2)^2:
//   smooth:  towards the mean of its neighbours; strength 0..1
//   inflate: along the surface's normal beside it; strength in mm, negative: inwards
//   flatten: by the distance of the surface beside it from the tangent plane at the point, towards
//            the plane; strength 0..1
struct Brush {
  BrushKind kind = BrushKind::kSmooth;
  int level = 2;
  Vec2 uv = Vec2::Constant(kNaN);
  double strength = kNaN;
  double reach = 2;     // in patches of the level, as in Pull
  bool mirror = false;  // also at (1-u, v); a vertex within both reaches follows the nearer point
};

// Adds the brush to `script`, as Pulled adds a pull. Throws InputError as Pulled, and for a
// strength out of range (inflate: at most 20 mm).
EditScript Brushed(const Brush& brush, const HSplineSurface& face, const EditScript& script);

// `script` with these offsets (null: removed) in place of its own edits of the same vertices.
EditScript WithOffsets(EditScript script, const std::map<VertexId, std::optional<Vec3>>& offsets);

// The unit direction from the subject's right to the left: the mean direction from (1-u, v) to (u,
// v). Throws InputError if the face has no such direction.
Vec3 FindLeft(const HSplineSurface& face);

}  // namespace semblance::problems
