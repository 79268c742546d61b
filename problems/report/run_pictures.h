// SPDX-License-Identifier: GPL-3.0-or-later
// The pictures of a run, and the colour maps they share with its meshes.
#pragma once

#include <vector>

#include "problems/output/files.h"
#include "problems/pictures/colour_map.h"
#include "problems/pictures/render.h"
#include "problems/preparation/mirror.h"
#include "problems/run.h"

namespace semblance {

ColourMap DepthColours();  // 0 to 25 mm
ColourMap ErrorColours();  // -8 to 8 mm
ColourMap SigmaColours();  // 0 to 6 mm
Colour OriginColour(BoneOrigin origin);

// Signed distance of each vertex to the true skin, positive outside it; NaN where the nearest skin
// is not scored. result.truth must be there.
std::vector<double> SignedErrorOf(const TriMesh& mesh, const RunResult& result,
                                  const RunContext& context);

// The head with open eyes, where there is one; else the face.
Scene HeadScene(const RunResult& result);

// pictures/overview.png and, from front, three quarters and side: skull_dowels, depth, implicit,
// face, face_over_skull, where they are there bust and sigma, and, where the true skin is known,
// truth and error (on the true skin).
void WritePictures(const RunResult& result, OutputFolder& folder, const RunContext& context);

}  // namespace semblance
