// SPDX-License-Identifier: GPL-3.0-or-later
// The pictures of a run, and the colour maps that they share with its meshes.
#pragma once

#include <vector>

#include "problems/io/output_folder.h"
#include "problems/report/pictures/colour_map.h"
#include "problems/report/pictures/render.h"
#include "problems/run.h"
#include "problems/subject/mirror.h"

namespace semblance::problems {

ColourMap DepthColours();  // 0 to 25 mm
ColourMap ErrorColours();  // -8 to 8 mm
ColourMap SigmaColours();  // 0 to 6 mm
Colour OriginColour(BoneOrigin origin);

// The signed distance of each vertex to the true skin in mm, positive outside the skin. NaN where
// the nearest skin is not scored. Requires result.truth.
std::vector<double> SignedErrors(const TriMesh& mesh, const RunResult& result,
                                 const RunContext& context);

// The head with open eyes, or the face if the run made no head.
Scene HeadScene(const RunResult& result);

// Writes pictures/overview.png and, from front, three quarters and side, skull_dowels,
// implicit, face and face_over_skull. Writes fit and sigma if the run has them, and truth, scored
// and error (on the true skin) if the true skin is known. Depth, the origin of the bone and the
// head are layers of the 3-D view (scene_json.h). Captions and legends are in the report
// (run_report.h), not in the pictures.
void WritePictures(const RunResult& result, OutputFolder& folder, const RunContext& context);

}  // namespace semblance::problems
