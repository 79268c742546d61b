// SPDX-License-Identifier: GPL-3.0-or-later
// A bust gets the subject's face, and over the skull the skull's shape.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "problems/bust/bust_model.h"
#include "problems/bust/eyeball.h"
#include "surfaces/base/run_context.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

struct BustInput {
  const BustModel& model;
  const HSplineSurface& face;                  // the subject's
  const std::map<std::string, Vec2>& site_uv;  // on it
  const TriMesh& over_skull;  // skull plus tissue, where the skull was scanned; may be empty
};

struct Bust {
  TriMesh skin;  // the model's triangles
  std::vector<EyePart> eyes;
  Similarity subject_from_model;    // what of the change is size and place
  int on_face = -1, on_skull = -1;  // vertices that follow each
  double face_rms_mm = kNaN;        // of those that follow the face, from it
  double skull_rms_mm = kNaN;
  int turned_over = -1;  // triangles; 0 is as it should be
  int released = -1;     // vertices that were let go so that no triangle turns over
};

// Places the model by a similarity (a bust that does not rest on the face's template also by a
// thin plate through the sites), then lets its skin follow the face, and the scalp what is over the
// skull (soft_deformation.h), in two rounds. The face's border is left gradually; the lids of a
// model with eyeballs keep much of their shape, and the eyeballs go with them. No byte depends on
// context.threads. Throws Cancelled, and InputError where the model has fewer than four sites of
// the face.
Bust PoseBust(const BustInput& in, const RunContext& context);

}  // namespace semblance
