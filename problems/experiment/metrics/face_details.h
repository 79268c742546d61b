// SPDX-License-Identifier: GPL-3.0-or-later
// The measurements of a face beyond the distances of face_metrics.h: errors at named points, the
// scores of other papers, and the distortion of features by a fit. `run` and `evaluate` report the
// same values, from the same calls.
#pragma once

#include <nlohmann/json.hpp>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "fitting/terms/metric_distortion.h"
#include "interp/dowels/dowel.h"
#include "problems/experiment/metrics/face_metrics.h"
#include "problems/experiment/metrics/face_region.h"
#include "problems/experiment/metrics/protocols.h"
#include "problems/face/template_face.h"
#include "problems/subject/average_skull.h"
#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

// ---------------------------------------------------------------------------------------------
// Errors at named points
// ---------------------------------------------------------------------------------------------

// Distances from a landmark's base along its direction: to the first skin that the ray leaves
// within 60 mm, and to the first face that it leaves between 30 mm behind the base and 60 mm in
// front of it.
struct SiteError {
  std::string site;
  double true_mm = kNaN;  // NaN if nothing is hit
  double face_mm = kNaN;

  double Error_mm() const { return face_mm - true_mm; }  // > 0: the face lies outside
};
// outer_skin: the triangles that face outside air. Landmarks without a finite direction are left
// out.
std::vector<SiteError> MeasureSites(const TriMesh& outer_skin, const TriMesh& face,
                                    std::span<const Dowel> landmarks);

// A feature that was found on both surfaces by the same rule, as a vertex.
struct FeatureError {
  std::string name;
  Vec3 on_truth = Vec3::Constant(kNaN), on_face = Vec3::Constant(kNaN);

  double Error_mm() const { return (on_face - on_truth).norm(); }
};
// Finds nose_tip (pronasale): the most anterior vertex within 20 mm of the midline and 5 to 60 mm
// below nasion, in the frame and millimetres of an average skull. The result is empty if a mesh has
// no triangle in that box, or if it is foremost at the upper or lower end of the box and so has no
// nose.
std::vector<FeatureError> MeasureFeaturePoints(const TriMesh& outer_skin, const TriMesh& face,
                                               const SkullSites& sites);

// ---------------------------------------------------------------------------------------------
// Distortion of the generic face's eyes, nose and mouth by a fit
// ---------------------------------------------------------------------------------------------

struct FeatureDistortion {
  std::string part;  // a feature of the template; `features`: all of them; `elsewhere`: the rest
  MetricDistortion distortion;
};

// Measures each feature that has a region, all regions together, and the rest of the face. placed:
// the generic face before the fit, with regions in its frame. fitted: of the same shape.
std::vector<FeatureDistortion> MeasureFeatures(const TemplateFace& placed,
                                               const HSplineSurface& fitted);

// {part: {"rms_strain", "max_strain", "rms_area", "area_cm2"}}.
nlohmann::ordered_json FeaturesToJson(const std::vector<FeatureDistortion>& features);

// ---------------------------------------------------------------------------------------------
// All details together
// ---------------------------------------------------------------------------------------------

// The landmarks of a subject, which decide how its face is scored.
struct ScoreBasis {
  std::optional<SkullSites> sites;  // none: the place of the face is not known
  std::vector<Dowel> landmarks;     // as they were given: site, base, and direction if known
};
// The result has no sites if fewer than three landmarks are at standard sites (sites.h).
ScoreBasis MakeScoreBasis(std::vector<Dowel> landmarks);

struct FaceDetails {
  BestFitScore best_fit;
  ViewRayScore view_ray;  // from the front of the skull; along -y (LPS) if the pose is not known
  std::vector<SiteError> sites;
  std::vector<FeatureError> features;
};

// Throws InputError if nothing is scored; Cancelled.
FaceDetails MeasureDetails(const TriMesh& truth, const ScoredSkin& skin, const ScoreBasis& basis,
                           const TriMesh& face, const RunContext& context);

// MetricsToJson plus protocols{ct_frame, best_fit, view_ray}, landmarks{}, features{} and
// scored_skin{}.
nlohmann::ordered_json ScoreToJson(const FaceMetrics& metrics, const FaceDetails& details,
                                   const ScoredSkin& skin);

// "312 cm² of skin scored; left out: 20 cm² masked, 156 cm² inner, 14 cm² end".
std::string ToPhrase(const ScoredSkin& skin);

}  // namespace semblance::problems
