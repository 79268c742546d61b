// SPDX-License-Identifier: GPL-3.0-or-later
// A face prior over the (u,v) of a template: its faces as H-splines, and its modes as B-splines,
// which need no mesh and are small enough to travel with the program.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "fitting/problem/fit_target.h"
#include "problems/face/domain_grid.h"
#include "problems/face/face_prior.h"
#include "problems/face/template_face.h"
#include "surfaces/base/run_context.h"

namespace semblance::problems {

// ---------------------------------------------------------------------------------------------
// Faces of the prior as H-splines
// ---------------------------------------------------------------------------------------------

// The points of the mean that lie under a grid of samples of the template.
struct PriorOnTemplate {
  DomainGrid grid;
  std::vector<ModelPoint> under;  // one per sample of the grid: the closest point of the mean
  std::vector<Vec3> beside;       // from there to the sample, in the frame of the mean, mm
  Similarity mean_from_template;
  double rms_mm = kNaN;  // of `beside`
};

// The template is placed by the sites, then by iterated closest points. Throws InputError if it
// then lies more than 5 mm (RMS) from the mean, because it was made from another face.
PriorOnTemplate LayOnTemplate(const FacePrior& prior, const TemplateFace& face,
                              const RunContext& context);

// The H-spline of an estimated shape. Each sample keeps its offset from the model's mesh.
HSplineSurface MakeFaceSurface(const ShapeEstimate& estimate, const FacePrior& prior,
                               const PriorOnTemplate& on_template, const HSplineShape& shape);

// Moves a face by the difference between a drawn face (estimate.drawn[draw]) and the most likely
// one.
HSplineSurface MovedAsDrawn(const HSplineSurface& face, const ShapeEstimate& estimate,
                            std::size_t draw, const FacePrior& prior,
                            const PriorOnTemplate& on_template);

// The estimate's sigma at (u,v), mm.
std::vector<double> SigmaAt(std::span<const Vec2> uv, const ShapeEstimate& estimate,
                            const FacePrior& prior, const PriorOnTemplate& on_template);

// The points of PriorShapeTerm: the surface of the estimate, with its sigma, at the middles of a
// regular grid of its domain.
std::vector<ShapePoint> SampleShape(const HSplineSurface& surface, const ShapeEstimate& estimate,
                                    const FacePrior& prior, const PriorOnTemplate& on_template);

// The features of the prior on the estimated face; the radius is the clearance.
std::vector<Sphere> FeaturesOn(const ShapeEstimate& estimate, const FacePrior& prior);

// outer * inner.
Similarity Composed(const Similarity& outer, const Similarity& inner);

// ---------------------------------------------------------------------------------------------
// Modes as B-splines
// ---------------------------------------------------------------------------------------------

// A point of the face and its clearance (ShapeFeature).
struct FeatureParameter {
  Vec2 uv = Vec2::Constant(kNaN);
  double clearance_mm = kNaN;
};

struct HSplineModes {
  HSplineShape shape;  // of the template; the modes are plain B-splines of `level`
  int level = -1;
  std::vector<ControlNet> modes;  // displacements at coefficient 1, in the template's frame, mm
  std::vector<FeatureParameter> features;
};

// The error of the modes as B-splines of one level, mm.
struct ModesMisfit {
  double rms_mm = kNaN;  // over all modes and samples
  double max_mm = kNaN;
};

// Each of the first `count` modes is the least-squares fit of its displacements at the samples of
// the template. misfit: may be null. Throws InputError for a level that the template does not have.
HSplineModes ModesOnTemplate(const FacePrior& prior, const PriorOnTemplate& on_template,
                             const TemplateFace& face, int level, int count, ModesMisfit* misfit);

// Writes the vertices in whole micrometres.
std::string HSplineModesToJson(const HSplineModes& modes);
// Throws InputError in one line that starts with `name`.
HSplineModes HSplineModesFromJson(std::string_view text, std::string_view name);

// The prior on a mesh of the template, with the first `count` modes. Throws InputError if the
// template is of another shape.
FacePrior MakePrior(const HSplineModes& modes, const TemplateFace& face, int count);

// Loads the prior of any source. face: the template. Throws as LoadPrior(ModesPrior), ReadFileBytes
// and the functions above do.
FacePrior LoadPrior(const PriorSource& source, const TemplateFace& face);

// The files that LoadPrior reads, for the manifest. Throws as ModesPriorFiles does.
std::vector<std::filesystem::path> PriorFiles(const PriorSource& source);

}  // namespace semblance::problems
