// SPDX-License-Identifier: GPL-3.0-or-later
// Dowels as points of a fit: their tips, and where they meet the generic face.
#pragma once

#include <span>
#include <vector>

#include "fitting/problem/fit_target.h"
#include "fitting/problem/placement.h"
#include "interp/dowels/dowel.h"
#include "problems/face_template/template_face.h"
#include "problems/subject/extra_sites.h"

namespace semblance {

// The tips of the dowels whose (u,v) is known before the face is placed: by hand (`sites`), else
// the generic face's. In the dowels' order.
FitTarget KnownDowels(std::span<const Dowel> dowels, const TemplateFace& face,
                      const ExtraSites& sites);

// What brings the generic face to them. Throws as PlaceTemplate.
Similarity PlaceOnDowels(const TemplateFace& generic, const FitTarget& known,
                         const PlacementOptions& options);

// Those, and the dowels that are not at a standard site: their (u,v) is where the ray of the dowel
// meets `placed`, the face in the subject's frame (thesis 4.2), or the surface's point nearest to
// the tip where the ray misses. In the dowels' order.
FitTarget AllDowels(std::span<const Dowel> dowels, const TemplateFace& placed,
                    const ExtraSites& sites);

}  // namespace semblance
