// SPDX-License-Identifier: GPL-3.0-or-later
// Tests whether the face made from a skull is recognised among others (`job: identify`).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "problems/experiment/metrics/identification.h"
#include "problems/experiment/stage_cache.h"
#include "problems/run.h"
#include "problems/study/study_plan.h"

namespace semblance::problems {

// The distance of a probe to its person and to the others, by one measure.
struct Match {
  double rank = kNaN;  // rank of the person by distance (FindRank)
  double own_mm = kNaN;
  double best_other_mm = kNaN;  // NaN in a gallery of one
};

// One face against the whole gallery.
struct ProbeMatch {
  Match surface = {}, landmarks = {};
};

struct IdentifyResult {
  RunResult run;
  int gallery = 0;
  ProbeMatch approximation = {};  // the recovered face
  ProbeMatch ceiling = {};        // the true face, resampled and noisy (SimulateRescan)
  ProbeMatch floor = {};          // the generic face, the same for everyone
};

// Loads the true face of a person. Throws InputError if the person has no true skin or no landmarks
// with directions.
KnownFace MakeKnownFace(const GalleryEntry& entry, const RunContext& context);

// Runs the experiment, which must be that of gallery[own]. Compares its face, the ceiling and the
// floor with every true face. `cache` shares the data of a person among trials. Throws as Run,
// MakeKnownFace and MeasureFaceDistance do.
IdentifyResult Identify(const Experiment& experiment, const std::vector<GalleryEntry>& gallery,
                        std::size_t own, const IdentifyOptions& options, const RunContext& context,
                        StageCache& cache);

// ResultJson of the run, with identify{gallery, chance_rank, surface{rank, own_mm, best_other_mm},
// landmarks{}, ceiling{surface{}, landmarks{}}, floor{}}.
nlohmann::ordered_json IdentifyResultJson(const Experiment& experiment,
                                          const IdentifyResult& result);

}  // namespace semblance::problems
