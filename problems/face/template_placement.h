// SPDX-License-Identifier: GPL-3.0-or-later
// Brings the generic head to another head by landmarks. The fit of a template starts there.
#pragma once

#include <string>
#include <vector>

#include "problems/face/skin_landmarks.h"
#include "problems/face/template_face.h"
#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

// The parts of a head from which a template is made.
struct OuterHead {
  TriMesh skin;                      // the triangles that are seen from outside, mm
  std::vector<SkinLandmark> points;  // on the skin
  std::vector<std::string> notes;    // lesser defects of the mesh, landmarks that were left out
};

// Throws InputError if left and right have changed places: of all landmarks (the mirror image of
// the generic head meets them better) or of one pair. The message does not name the head. The
// landmarks must be enough to place the generic head, as PrepareHead requires.
void CheckSides(const std::vector<SkinLandmark>& points);

// Drops the walls of cavities (outer_surface.h) and moves each landmark to the nearest skin. Throws
// InputError, which names the mesh, if it cannot be used:
//   - CheckHeadMesh refuses it;
//   - two pieces have the size of a head and lie side by side;
//   - fewer than 3 landmarks lie in the midline or there are fewer than 2 pairs (the message lists
//     the missing sites);
//   - CheckSides refuses the landmarks;
//   - the best similarity of the generic head to the landmarks has a scale outside 0.75 to 1.35,
//     which means another unit;
//   - a landmark lies more than 10 mm from the skin.
OuterHead PrepareHead(const TriMesh& head, const SkinLandmarks& landmarks, const std::string& name,
                      const RunContext& context);

// The generic head under the least-squares similarity to the landmarks, then under a stiff thin
// plate through them. Observers see facial landmarks, but place sites of bone only within some 3
// mm, so the latter weigh a tenth. The surface has levels up to `max_level` (3 to 6). Levels 0 to 3
// hold the formula's detail. The sites are the formula's; the features have vertices of all levels.
TemplateFace WarpedGenericHead(const OuterHead& head, int max_level);

}  // namespace semblance::problems
