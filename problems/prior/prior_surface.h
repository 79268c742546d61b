// SPDX-License-Identifier: GPL-3.0-or-later
// A face of the prior as an H-spline: the template, in whose (u,v) it is, follows the model's mesh.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "fitting/problem/fit_target.h"
#include "problems/face_template/domain_grid.h"
#include "problems/face_template/template_face.h"
#include "problems/prior/face_prior.h"
#include "surfaces/base/run_context.h"

namespace semblance {

// Which point of the mean lies under each sample of the template.
struct PriorOnTemplate {
  DomainGrid grid;
  std::vector<ModelPoint> under;  // one per sample of the grid: the closest point of the mean
  std::vector<Vec3> beside;       // from there to the sample, in the frame of the mean, mm
  Similarity mean_from_template;
  double rms_mm = kNaN;  // of `beside`
};

// The similarity is that of the sites, then of closest points. Throws InputError if the template is
// more than 5 mm (RMS) from the mean: it is not the mean's.
PriorOnTemplate LayOnTemplate(const FacePrior& prior, const TemplateFace& face,
                              const RunContext& context);

// The H-spline of an estimated shape: each sample keeps its place beside the model's mesh.
HSplineSurface SurfaceOf(const ShapeEstimate& estimate, const FacePrior& prior,
                         const PriorOnTemplate& on_template, const HSplineShape& shape);

// A face that the estimate led to, moved by what the draw (one of estimate.drawn) differs from the
// most likely face.
HSplineSurface MovedAsDrawn(const HSplineSurface& face, const ShapeEstimate& estimate,
                            std::size_t draw, const FacePrior& prior,
                            const PriorOnTemplate& on_template);

// The estimate's sigma at (u,v), mm.
std::vector<double> SigmaAt(std::span<const Vec2> uv, const ShapeEstimate& estimate,
                            const FacePrior& prior, const PriorOnTemplate& on_template);

// What PriorShapeTerm looks at: the surface of the estimate, with its sigma, at the middles of a
// regular grid of its domain.
std::vector<ShapePoint> ShapePointsOf(const HSplineSurface& surface, const ShapeEstimate& estimate,
                                      const FacePrior& prior, const PriorOnTemplate& on_template);

// The features of the prior on the estimated face; the radius is the clearance.
std::vector<Sphere> FeaturesOn(const ShapeEstimate& estimate, const FacePrior& prior);

// outer * inner.
Similarity Composed(const Similarity& outer, const Similarity& inner);

}  // namespace semblance
