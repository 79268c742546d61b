// SPDX-License-Identifier: GPL-3.0-or-later
// A whole head as one H-spline that goes round it, and its eyes.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "surfaces/base/run_context.h"
#include "surfaces/hspline/hspline_surface.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

// In mm, LPS. u goes round the head, from the back (0) over the face (0.5). v goes from the end of
// the neck (0) to the crown (1), where all u meet. Behind the lids and the lips the surface turns
// inwards.
struct WholeHead {
  HSplineSurface surface;
  std::vector<Sphere> eyeballs;  // the subject's right one first; none if the eyes are closed
};

struct WholeHeadFit {
  WholeHead head;
  double rms_mm = kNaN, max_mm = kNaN;  // distance of the mesh's samples from the surface
  bool usable = false;
};

// Fits the H-spline of a head to its mesh (head_domain.h). Patches that are more than 0.12 mm off
// are refined. Offsets and vertices are rounded to 1 um. A closed opening off the midline that is
// about as wide as an eye counts as an eye. Throws InputError as LayOutHead does, and Cancelled.
WholeHeadFit FitWholeHead(const TriMesh& mesh, const std::string& name, const RunContext& context);

// {"format": "semblance-head", "version": 1, "eyeballs": [[x, y, z, radius], ...], "surface": the
// H-spline as in hspline_json.h}. name: messages begin with it. WholeHeadFromJson throws IoError
// for anything else.
std::string WholeHeadToJson(const WholeHead& head);
WholeHead WholeHeadFromJson(std::string_view text, const std::string& name);

// The head as triangles, `columns` round and `rows` high, closed at the crown. Rings near the crown
// have fewer points. A fan replaces the last rings, whose points would crowd together.
TriMesh WholeHeadMesh(const WholeHead& head, int columns, int rows);

}  // namespace semblance::problems
