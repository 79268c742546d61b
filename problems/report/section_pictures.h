// SPDX-License-Identifier: GPL-3.0-or-later
// Cross-sections of a run as pictures: a head in the planes of head_planes.h.
#pragma once

#include <string>
#include <vector>

#include "problems/io/output_folder.h"
#include "problems/report/report_kit.h"
#include "problems/run.h"
#include "problems/subject/head_planes.h"

namespace semblance::problems {

// One surface of a picture. Surfaces without a section in the plane are left out of its legend.
struct SectionLayer {
  std::string label;   // for the legend
  const char* colour;  // of the outline, #rrggbb
  const TriMesh* mesh;
};

// An SVG picture of the plane: outlines of the layers in their order, sides, a scale of 20 mm and
// a legend. It shows `region` (mm, of the head's meshes) with a margin, and the grey values of the
// slice behind the outlines unless `slice` is null. Lines are rounded to 0.05 mm.
std::string SectionSvg(const HeadPlane& plane, const std::vector<SectionLayer>& layers,
                       const Box3& region, const GreySlice* slice);

// Writes pictures/section_NAME.svg for each of HeadPlanes: skull, first face, recovered face and,
// if it is known, the true skin; behind them the CT, if the run read one. Writes nothing for a
// subject without planes.
void WriteSections(const RunResult& result, OutputFolder& folder);

// The pictures that WriteSections has written into the folder. Empty for folders without any.
std::vector<ReportImage> SectionImages(const OutputFolder& folder);

}  // namespace semblance::problems
