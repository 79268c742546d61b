// SPDX-License-Identifier: GPL-3.0-or-later
// From a generic face, depths and the implicit face to the subject's face: the ways of
// face_source.h.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "fitting/fit.h"
#include "fitting/problem/seeding.h"
#include "problems/pipeline/case.h"
#include "problems/pipeline/experiment.h"
#include "problems/pipeline/stage_cache.h"
#include "problems/pipeline/uncertainty.h"
#include "problems/prior/prior_surface.h"
#include "surfaces/mesh/cut_planes.h"

namespace semblance {

// The generic face in the subject's frame.
struct PlacedTemplate {
  FitTarget dowels;
  Similarity face_from_template;
  TemplateFace face;
};

struct FaceFit {
  SeedResult seeding;
  FitTarget target;
  FitResult fit;
};

// A prior, laid on the template of its mean.
struct LoadedPrior {
  FacePrior face;
  PriorOnTemplate on_template;
};

// What faces are made of. All of it must outlive the call.
struct FaceInput {
  const Experiment& experiment;
  const TemplateFace& generic;
  const LoadedPrior* prior;  // null without one
  const Case& subject;
  const TriMesh&
      implicit;  // what of it may be seeded; without triangles: `prior` takes the tips alone
  const TriMesh& shell;
  bool tells_sigma = true;  // of a prior's face; a quick look does without
};

struct MadeFace {
  PlacedTemplate placed;
  FaceFit fitted;
  std::optional<ShapeEstimate> prior;        // where a prior was asked
  std::vector<AppliedRule> rules = {};       // that took part in it
  std::vector<HSplineSurface> samples = {};  // drawn beside it: uncertainty.samples
};

// The prior of the experiment, laid on its template; null where no face asks it. Throws as
// LoadPrior and LayOnTemplate.
std::shared_ptr<const LoadedPrior> GivenPrior(const Experiment& experiment,
                                              const TemplateFace& generic, StageCache& cache,
                                              const RunContext& context);

// What of the implicit face may be seeded. cuts: the planes where the scan ends; near one its
// surface is the rim and the lid of the shell, not a face. Notes each such plane with the subject.
TriMesh SeedableFace(const Experiment& experiment, std::span<const CutPlane> cuts,
                     const TriMesh& implicit, Case& subject);

// Brings the generic face to the dowels and makes the subject's face of it, as experiment.face
// says. Throws InputError as Fit and EstimateShape do; Cancelled.
MadeFace MakeFace(const FaceInput& in, const RunContext& context);

// Residuals and their RMS, weighted as those of a fit, of a surface that was changed after it.
void MeasureResiduals(FaceFit& fitted);

// The posterior's sigma, which knows the discrepancy of the model, in place of the fit's; and its
// samples. made: with a prior.
FaceUncertainty PriorUncertainty(const UncertaintyOptions& options, const LoadedPrior& prior,
                                 const MadeFace& made, const Tessellation& face);

}  // namespace semblance
