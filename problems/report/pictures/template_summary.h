// SPDX-License-Identifier: GPL-3.0-or-later
// Reports on a template that was made from a head: numbers and a picture.
#pragma once

#include <string>

#include "problems/face/template_fit.h"
#include "problems/report/pictures/image.h"

namespace semblance::problems {

// {"tolerance_mm", "met", "folds", "face_to_skin": {rms_mm, p95_mm, max_mm, covered, area_mm2},
// "skin_to_face": {...}, "levels": [...], "sites": {code: {u, v, from_landmark, drift_mm,
// error_mm}}, "notes": [...]}; null for NaN.
std::string TemplateJson(const TemplateFit& fit, const OuterHead& head,
                         const TemplateFitOptions& options);

// The same in a few lines for people.
std::string TemplateText(const TemplateFit& fit, const TemplateFitOptions& options);

// Shows the head's skin and the face from the front and from the side, and the distance by which
// the face lies outside (+) or inside (-) the skin. The sites are dots on the face.
Image TemplatePicture(const TemplateFit& fit, const OuterHead& head, int threads);

}  // namespace semblance::problems
