// SPDX-License-Identifier: GPL-3.0-or-later
// The first half of the main job: from a subject to its implicit face. It knows nothing of the
// generic face, so experiments that differ in the fit alone share it.
#pragma once

#include <memory>

#include "problems/case.h"
#include "problems/stage_cache.h"
#include "problems/step_clock.h"

namespace semblance {

struct SkullStage {
  Case subject;
  TriMesh shell;     // the outer shell of the skull, temples and gaps bridged: what emits
  DepthField depth;  // of the shell's vertices
  ImplicitFace implicit;
};

// Loads the case, fills the skull, interpolates depth, lays the implicit face: each taken from
// `cache` if it was made from the same options before. Throws as LoadSubject, and Cancelled.
std::shared_ptr<const SkullStage> MakeSkullStage(const Experiment& experiment, StageCache& cache,
                                                 StepClock& step, const RunContext& context);

}  // namespace semblance
