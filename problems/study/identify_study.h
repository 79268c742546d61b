// SPDX-License-Identifier: GPL-3.0-or-later
// Whether the face made of a skull is recognised among others (`job: identify`).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "problems/metrics/identification.h"
#include "problems/pipeline/stage_cache.h"
#include "problems/run.h"
#include "problems/study/study_plan.h"

namespace semblance {

// How close a probe is to its person and to the others, by one measure.
struct Match {
  double rank = kNaN;  // RankOf
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
  ProbeMatch approximation = {};  // the face that was made
  ProbeMatch ceiling = {};        // the true face, seen again (SeenAgain)
  ProbeMatch floor = {};          // the generic face, the same for everyone
};

// Throws InputError if the person has no true skin or no landmarks with directions.
KnownFace MakeKnownFace(const GalleryEntry& entry, const RunContext& context);

// Runs the experiment, which is that of gallery[own], and compares its face, the ceiling's and the
// floor's with everyone's. What all trials need of a person is taken from `cache`. Throws as Run,
// MakeKnownFace and DistanceOf.
IdentifyResult Identify(const Experiment& experiment, const std::vector<GalleryEntry>& gallery,
                        std::size_t own, const IdentifyOptions& options, const RunContext& context,
                        StageCache& cache);

// ResultJson of the run with identify{gallery, chance_rank, surface{rank, own_mm, best_other_mm},
// landmarks{}, ceiling{surface{}, landmarks{}}, floor{}}.
nlohmann::ordered_json IdentifyResultJson(const Experiment& experiment,
                                          const IdentifyResult& result);

}  // namespace semblance
