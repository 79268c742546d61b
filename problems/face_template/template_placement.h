// SPDX-License-Identifier: GPL-3.0-or-later
// The generic head, brought to another head by landmarks: the start of its fit.
#pragma once

#include <string>
#include <vector>

#include "problems/face_template/skin_landmarks.h"
#include "problems/face_template/template_face.h"
#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// What of a head a template is made from.
struct OuterHead {
  TriMesh skin;                      // the triangles that are seen from outside, mm
  std::vector<SkinLandmark> points;  // on the skin
  std::vector<std::string> notes;    // lesser defects of the mesh, landmarks that were left out
};

// Throws InputError, without a name of the head, where left and right have changed places: of all
// landmarks (the generic head's mirror image meets them better) or of one pair. It takes landmarks
// that place the generic head, see PrepareHead.
void CheckSides(const std::vector<SkinLandmark>& points);

// Drops the walls of cavities (outer_surface.h), and brings each landmark to the nearest skin.
// Throws InputError, naming the mesh, where no head can be made of it: what CheckHeadMesh refuses;
// two pieces of head's size side by side; fewer than 3 landmarks in the midline or 2 pairs, naming
// the sites that are missing; what CheckSides refuses; landmarks whose best similarity with the
// generic head has a scale outside 0.75 to 1.35 (another unit); a landmark more than 10 mm from the
// skin.
OuterHead PrepareHead(const TriMesh& head, const SkinLandmarks& landmarks, const std::string& name,
                      const RunContext& context);

// The generic head under the similarity of least squares over the landmarks, then under a stiff
// thin plate through them: sites of bone, which observers place within some 3 mm, count a tenth of
// facial landmarks, which they see. Its surface has levels up to `max_level` (3 to 6), of which 0
// to 3 hold the formula's detail; its sites are the formula's, its features those of all levels.
TemplateFace WarpedGenericHead(const OuterHead& head, int max_level);

}  // namespace semblance
