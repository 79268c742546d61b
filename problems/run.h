// SPDX-License-Identifier: GPL-3.0-or-later
// The main job: from an experiment to a face, as values.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "problems/bust/pose_bust.h"
#include "problems/metrics/face_details.h"
#include "problems/metrics/feature_distortion.h"
#include "problems/pipeline/case.h"
#include "problems/pipeline/depth_comparison.h"
#include "problems/pipeline/skull_stage.h"
#include "problems/pipeline/uncertainty.h"
#include "problems/prior/prior_surface.h"
#include "surfaces/hspline_query/tessellate.h"

namespace semblance {

// Of the mesh on which a face is measured, along each side of a patch of its finest level.
inline constexpr int kFaceQuadsPerPatch = 4;

// Against the true skin, where it is known.
struct TruthComparison {
  ScoredSkin skin;
  FaceMetrics face;
  FaceDetails details;  // of the face
  FaceMetrics implicit;
  DepthComparison depth;  // of the shell's vertices
  SigmaCoverage sigma;    // of a fit outside the features' regions; empty without an uncertainty
};

struct RunResult {
  Case subject;
  TriMesh shell;  // the outer shell of the skull, temples and gaps bridged: what emits
  std::vector<BoneOrigin> origin;  // of the shell's triangles
  DepthField depth;                // of the shell's vertices
  ImplicitFace implicit;
  Similarity face_from_template;
  TemplateFace placed;  // the generic face brought to the dowels; the prior's most likely face
                        // where it was asked for
  std::optional<ShapeEstimate> prior;  // where it was asked for
  std::vector<AppliedRule> rules;      // that took part in it
  SeedResult seeding;                  // of the last round
  FitTarget target;                    // of the last round: dowel tips at their (u,v), then seeds
  FitResult fit;                       // of the last round
  std::optional<HSplineSurface> before_edits;  // fit.surface, before experiment.edits
  Tessellation face;                           // of fit.surface
  std::optional<FaceUncertainty> uncertainty;  // where it was asked for
  std::optional<TruthComparison> truth;
  std::vector<FeatureDistortion> features;
  std::shared_ptr<const BustModel> bust_model;  // null: no bust was asked for
  std::optional<Bust> bust;                     // of bust_model
  std::vector<StepTime> times;                  // not part of the result proper

  // What people should know, a line each: of the subject and its face, then of the implicit face.
  std::vector<std::string> Notes() const;
  // Why the face cannot be used; empty if it can.
  std::vector<std::string> Faults() const;
  bool usable() const { return Faults().empty(); }
};

// Loads the case, fills the skull, interpolates depth, lays the implicit face, places the generic
// face, makes the subject's face of it as experiment.face says, measures. Throws as LoadSubject
// does, OutOfMemory, Cancelled, and InputError if the face is not finite. What experiments have in
// common (the subject, its shell, the implicit face, the generic face) is taken from `cache`, where
// one is given; the result does not depend on it.
RunResult Run(const Experiment& experiment, const RunContext& context, StageCache* cache = nullptr);

}  // namespace semblance
