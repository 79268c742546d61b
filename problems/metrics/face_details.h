// SPDX-License-Identifier: GPL-3.0-or-later
// All that is told of a face against the true one: by `run` in result.json and by `evaluate`, from
// the same values by the same calls.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "problems/metrics/face_metrics.h"
#include "problems/metrics/protocols.h"
#include "problems/metrics/scored_skin.h"
#include "problems/metrics/site_errors.h"

namespace semblance {

// What of a subject decides how its face is scored.
struct ScoreBasis {
  std::optional<SkullSites> sites;  // none: nothing is known of where the face is
  std::vector<Dowel> landmarks;     // as they were given: site, base, direction where it is known
};
// Without sites if there are fewer than three landmarks at standard ones (sites.h).
ScoreBasis BasisOf(std::vector<Dowel> landmarks);

// Beyond the distances of face_metrics.h.
struct FaceDetails {
  BestFitScore best_fit;
  ViewRayScore view_ray;  // from the front of the skull; of LPS where no pose is known
  std::vector<SiteError> sites;
  std::vector<FeatureError> features;
};

// Throws InputError if nothing is scored; Cancelled.
FaceDetails MeasureDetails(const TriMesh& truth, const ScoredSkin& skin, const ScoreBasis& basis,
                           const TriMesh& face, const RunContext& context);

// MetricsToJson with protocols{ct_frame, best_fit, view_ray}, landmarks{}, features{} and
// scored_skin{}.
nlohmann::ordered_json ScoreToJson(const FaceMetrics& metrics, const FaceDetails& details,
                                   const ScoredSkin& skin);

// "312 cm² of skin scored; left out: 20 cm² masked, 156 cm² inner, 14 cm² end".
std::string InWords(const ScoredSkin& skin);

}  // namespace semblance
