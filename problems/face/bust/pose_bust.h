// SPDX-License-Identifier: GPL-3.0-or-later
// Gives a bust the subject's face and, over the brain case, the skull's shape.
#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "problems/face/bust/bust_model.h"
#include "surfaces/base/run_context.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance::problems {

struct BustInput {
  const BustModel& model;
  const HSplineSurface& face;                  // the subject's
  const std::map<std::string, Vec2>& site_uv;  // on it
  const TriMesh& over_skull;  // skull plus tissue, only of scanned bone; may be empty
};

// A piece of an eye with one colour.
struct EyePart {
  std::string name;                   // sclera, limbus, iris, pupil
  std::array<double, 3> colour = {};  // sRGB, 0..1; not the person's
  TriMesh mesh;
};

struct Bust {
  TriMesh skin;  // the model's triangles
  std::vector<EyePart> eyes;
  std::vector<Sphere> eyeballs;     // in the subject's frame, in the order of the model's
  Similarity subject_from_model;    // change of size, place and pose; the rest is deformation
  int on_face = -1, on_skull = -1;  // numbers of vertices that follow the face and the skull
  double face_rms_mm = kNaN;        // distance of the former from their targets
  double skull_rms_mm = kNaN;       // distance of the latter from theirs
  int turned_over = -1;             // number of triangles; 0 in a sound bust
  int released = -1;  // vertices that no longer follow, so that no triangle turns over
};

// Places the model by a similarity. A model without `rest` is also bent by a thin plate through the
// sites. Then, in two rounds, its skin follows the face and its scalp follows over_skull
// (soft_deformation.h). The influence of the face fades out at its border. The lids of a model with
// eyeballs keep much of their shape, and the eyeballs move with them. No byte depends on
// context.threads. Throws Cancelled, and InputError if the model has fewer than four sites of the
// face.
Bust PoseBust(const BustInput& in, const RunContext& context);

}  // namespace semblance::problems
