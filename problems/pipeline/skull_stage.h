// SPDX-License-Identifier: GPL-3.0-or-later
// The first half of the main job: from a subject to its depth, and on to its implicit face. It
// knows nothing of the generic face, so experiments that differ in the fit alone share it.
#pragma once

#include <memory>
#include <vector>

#include "problems/pipeline/case.h"
#include "problems/pipeline/stage_cache.h"
#include "problems/pipeline/step_clock.h"
#include "problems/preparation/mirror.h"
#include "surfaces/mesh/cut_planes.h"

namespace semblance {

struct DepthStage {
  Case subject;
  TriMesh shell;              // the outer shell of the skull, temples and gaps bridged: what emits
  std::vector<Vec3> normals;  // of the shell's vertices
  std::vector<Dowel> dowels_on_shell;    // the same dowels as they stand on the shell
  std::vector<Dowel> expected_on_shell;  // likewise
  std::vector<Dowel> scored_on_shell;    // likewise
  DepthField depth;                      // of the shell's vertices, after the outside rule

  DepthInput Input() const {
    return {shell, normals, dowels_on_shell, subject.network, expected_on_shell};
  }
};

// Loads the case, fills the skull, interpolates depth: each taken from `cache` if it was made from
// the same options before. Throws as LoadSubject, and Cancelled.
std::shared_ptr<const DepthStage> MakeDepthStage(const Experiment& experiment, StageCache& cache,
                                                 StepClock& step, const RunContext& context);

struct SkullStage {
  std::shared_ptr<const DepthStage> depth_stage;
  std::vector<BoneOrigin> origin;  // of the shell's triangles
  std::vector<CutPlane> cuts;      // where the subject's skull is cut off
  ImplicitFace implicit;
};

// The same with the implicit face.
std::shared_ptr<const SkullStage> MakeSkullStage(const Experiment& experiment, StageCache& cache,
                                                 StepClock& step, const RunContext& context);

}  // namespace semblance
