// SPDX-License-Identifier: GPL-3.0-or-later
// Makes a generic face from any head: lays the formula's parametrisation over the head's skin.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "problems/face/skin_distance.h"
#include "problems/face/template_face.h"
#include "problems/face/template_placement.h"
#include "surfaces/base/run_context.h"

namespace semblance::problems {

struct TemplateFitOptions {
  // Root mean square distance of the face from the skin at which the fit ends, at the first level
  // from 3 on. The skin of a CT scan is known to about a third of a voxel.
  double tolerance_mm = 0.3;
  // Finest level, 3 to 6. A patch of level 4 is 2 to 3 mm wide. Patches finer than the triangles of
  // the mesh follow its facets.
  int finest = 5;
};

struct TemplateLevel {
  int level = -1;
  int rounds = -1;
  double matched = kNaN;  // 0..1: part of the whole surface's samples that match the skin
  int vertices = -1;      // of the level that hold detail
  SkinDistance face_to_skin = {};
};

struct TemplateSite {
  Vec2 uv = Vec2::Constant(kNaN);  // on the fitted surface
  bool from_landmark = false;      // else the formula's (u,v)
  double drift_mm = kNaN;  // from the landmark to the formula's (u,v); NaN without a landmark
  double error_mm = kNaN;  // from the landmark to the surface at uv
};

struct TemplateFit {
  TemplateFace face;
  std::vector<TemplateLevel> levels;
  std::map<std::string, TemplateSite> sites;  // the 32 standard sites
  // The face is the convex hull of the 32 sites in (u,v), so without ears and neck.
  SkinDistance face_to_skin = {}, skin_to_face = {};
  int folds = -1;       // CountFolds
  bool usable = false;  // every step's solution was usable
  bool met = false;     // the tolerance is met in both directions
};

// Level by level from 0 on, points of the surface are matched with the skin (skin_distance.h) and
// the level is fitted to the matches (fit.h). Both are repeated several times, so that the surface
// can slide along the skin. The smoothness of the displacement from the warped generic head halves
// waves shorter than two patches. It also bridges what has no match: holes, ears and unscanned
// parts. A site with a landmark gets the (u,v) nearest to it. Throws InputError for options out of
// range, and Cancelled if asked to stop.
TemplateFit FitTemplate(const OuterHead& head, const TemplateFitOptions& options,
                        const RunContext& context);

}  // namespace semblance::problems
