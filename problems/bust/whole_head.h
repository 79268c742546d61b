// SPDX-License-Identifier: GPL-3.0-or-later
// A whole head as one H-spline that goes round it, and its eyes.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "surfaces/base/run_context.h"
#include "surfaces/hspline/hspline_surface.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// mm, LPS. The surface goes round in u, from the back over the face (0.5); at v = 1, the crown, all
// u meet; at v = 0 the neck ends. Behind the lids and the lips it turns inwards.
struct WholeHead {
  HSplineSurface surface;
  std::vector<Sphere> eyeballs;  // the subject's right one first; none where the eyes are closed
};

struct WholeHeadFit {
  WholeHead head;
  double rms_mm = kNaN, max_mm = kNaN;  // of the mesh's samples
  bool usable = false;
};

// The H-spline of a head's mesh (head_domain.h), finer where it is more than 0.12 mm off. Offsets
// and vertices are rounded to 1 um. An opening between the middle and the top of the face, about as
// wide as an eye, is one. Throws InputError as LayOutHead, Cancelled.
WholeHeadFit FitWholeHead(const TriMesh& mesh, const std::string& name, const RunContext& context);

// {"format": "semblance-head", "version": 1, "eyeballs": [[x, y, z, radius], ...], "surface": the
// H-spline as in hspline_json.h}. name: what errors call the text. WholeHeadFromJson throws
// IoError, which begins with it, for anything else.
std::string WholeHeadToJson(const WholeHead& head);
WholeHead WholeHeadFromJson(std::string_view text, const std::string& name);

// The head as triangles, `columns` round and `rows` high, closed at the crown. Near it rings have
// fewer points, and a fan takes the place of the last ones, whose points crowd together.
TriMesh WholeHeadMesh(const WholeHead& head, int columns, int rows);

}  // namespace semblance
