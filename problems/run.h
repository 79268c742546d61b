// SPDX-License-Identifier: GPL-3.0-or-later
// The main job: from an experiment to a face, as values.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "problems/experiment/case.h"
#include "problems/experiment/depth_comparison.h"
#include "problems/experiment/metrics/face_details.h"
#include "problems/experiment/plausibility.h"
#include "problems/experiment/skull_stage.h"
#include "problems/experiment/uncertainty.h"
#include "problems/face/bust/pose_bust.h"
#include "problems/face/hspline_prior.h"
#include "surfaces/hspline_query/tessellate.h"

namespace semblance::problems {

// The mesh on which a face is measured has so many quads along each side of a patch of its finest
// level.
inline constexpr int kFaceQuadsPerPatch = 4;

// The comparison with the true skin.
struct TruthComparison {
  ScoredSkin skin;
  FaceMetrics face;
  FaceDetails details;  // of the face
  FaceMetrics implicit;
  DepthComparison depth;  // of the shell's vertices
  SigmaCoverage sigma;    // empty without uncertainty; for a fit, outside the features' regions
};

struct RunResult {
  Case subject;
  TriMesh shell;  // the outer shell of the skull with bridged temples and gaps; it emits
  std::vector<BoneOrigin> origin;  // of the shell's triangles
  DepthField depth;                // of the shell's vertices
  ImplicitFace implicit;
  Similarity face_from_template;
  TemplateFace placed;  // the generic face, brought to the dowels; or the prior's most likely face
  std::optional<ShapeEstimate> prior;  // if the face uses the prior
  std::vector<AppliedRule> rules;      // the rules that took part in the estimate
  SeedResult seeding;                  // of the last round
  FitTarget target;                    // of the last round: dowel tips at their (u,v), then seeds
  FitResult fit;                       // of the last round
  std::optional<HSplineSurface>
      before_edits;   // fit.surface before experiment.edits, if there are any
  Tessellation face;  // of fit.surface
  std::optional<FaceUncertainty> uncertainty;
  std::optional<TruthComparison> truth;  // if the true skin is known
  std::vector<FeatureDistortion> features;
  Plausibility plausibility;
  std::shared_ptr<const BustModel> bust_model;  // null: no bust
  std::optional<Bust> bust;                     // of bust_model
  std::vector<StepTime> times;  // not reproducible, so kept apart from other results

  // Notes for readers, one line each: on the subject and its face, then on the implicit face.
  std::vector<std::string> Notes() const;
  // The reasons why the face cannot be used, those of `plausibility` included. Empty if it can.
  std::vector<std::string> Faults() const;
  bool usable() const { return Faults().empty(); }
};

// Loads the case, fills the skull, interpolates depth, builds the implicit face, places the generic
// face, makes the subject's face from it in the way of experiment.face, and measures it. Stages
// that experiments share (the subject, its shell, the implicit face, the generic face) are taken
// from `cache` if one is given. The result does not depend on it. Throws as LoadSubject does,
// OutOfMemory, Cancelled, and InputError if the face is not finite.
RunResult Run(const Experiment& experiment, const RunContext& context, StageCache* cache = nullptr);

}  // namespace semblance::problems
