// SPDX-License-Identifier: GPL-3.0-or-later
// Makes the subject's face from a generic face, depths and the implicit face, in the ways of
// face_source.h.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "fitting/fit.h"
#include "fitting/problem/seeding.h"
#include "problems/experiment/case.h"
#include "problems/experiment/experiment.h"
#include "problems/experiment/stage_cache.h"
#include "problems/experiment/uncertainty.h"
#include "problems/face/hspline_prior.h"
#include "surfaces/mesh/cut_planes.h"

namespace semblance::problems {

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

// A prior that was laid on the template of its mean.
struct LoadedPrior {
  FacePrior face;
  PriorOnTemplate on_template;
};

// The input of MakeFace, which must outlive the call.
struct FaceInput {
  const Experiment& experiment;
  const TemplateFace& generic;
  const LoadedPrior* prior;  // null: none
  const Case& subject;
  const TriMesh& implicit;  // the seedable part; without triangles a prior uses the tips alone
  const TriMesh& shell;
  const ImplicitSurface* field = nullptr;  // the surface of `implicit`, to lay seeds on it
  bool tells_sigma = true;                 // false: a prior's face gets no sigma, which saves time
  bool draws_faces = true;                 // false: no random faces are drawn
};

// The standard deviation of a face along its normal, mm, at the points of a grid of its domain.
struct SigmaGrid {
  DomainGrid grid;
  std::vector<double> sigma_mm;
};

struct MadeFace {
  PlacedTemplate placed;
  FaceFit fitted;
  std::optional<ShapeEstimate> prior;        // only if the face uses the prior
  std::vector<AppliedRule> rules = {};       // the rules that took part in the estimate
  std::vector<HSplineSurface> samples = {};  // uncertainty.samples random faces
  std::optional<SigmaGrid> sigma = {};       // of `joint`; else sigma is the estimate's
};

// The prior of the experiment, laid on its template; null if its face does not use one. Throws as
// LoadPrior and LayOnTemplate do.
std::shared_ptr<const LoadedPrior> LoadExperimentPrior(const Experiment& experiment,
                                                       const TemplateFace& generic,
                                                       StageCache& cache,
                                                       const RunContext& context);

// The part of the implicit face that may be seeded. cuts: the planes at which the scan ends. Near
// them the implicit face follows the rim and the lid of the shell and is no face. Adds a note for
// each.
TriMesh SeedableFace(const Experiment& experiment, std::span<const CutPlane> cuts,
                     const TriMesh& implicit, Case& subject);

// Brings the generic face to the dowels and makes the subject's face in the way of experiment.face.
// Throws InputError as Fit and EstimateShape do, and Cancelled.
MadeFace MakeFace(const FaceInput& in, const RunContext& context);

// Replays experiment.edits on the face and on its samples, if there is an edit script. Updates the
// residuals, and adds the script to the subject's notes and inputs. Returns the face before the
// edits; none without a script. Throws as ReadEditScript and ApplyEdits do.
std::optional<HSplineSurface> EditByHand(const Experiment& experiment, MadeFace& made,
                                         Case& subject);

// Sigma and samples of a face that was made with a prior. Sigma is that of made.sigma, or else of
// the estimate's posterior.
FaceUncertainty PriorUncertainty(const UncertaintyOptions& options, const LoadedPrior& prior,
                                 const MadeFace& made, const Tessellation& face);

}  // namespace semblance::problems
