// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/metrics/face_details.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "problems/experiment/metrics/face_metrics.h"
#include "problems/subject/sites.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

constexpr double kBehind_mm = 30, kFurthest_mm = 60;  // as the header states

// The distance from the base along the direction to the first triangle that the ray leaves; NaN if
// there is none.
double ExitAlong(const TriMesh& mesh, const MeshQuery& query, const Dowel& d, double behind_mm) {
  const Vec3 start = d.base - behind_mm * d.direction;
  for (const MeshPoint& hit : query.AllHits(start, d.direction, behind_mm + kFurthest_mm)) {
    if (TriangleAreaVector(mesh, mesh.triangles[hit.triangle]).dot(d.direction) > 0) {
      return hit.distance_mm - behind_mm;
    }
  }
  return kNaN;
}

std::optional<Vec3> NoseTip(const TriMesh& mesh, const SkullSites& sites) {
  constexpr double kAside_mm = 20, kHighest_mm = -5, kLowest_mm = -60;  // the box of the header
  constexpr double kRim_mm = 3;  // within this of the box's ends, brow or lips may come first
  std::optional<Vec3> tip;
  double foremost = std::numeric_limits<double>::infinity(), height_mm = kNaN;
  for (const Triangle& t : mesh.triangles) {
    for (const auto v : t) {
      const Vec3 p = sites.InAverage(mesh.points[v]);
      const bool in_box =
          std::abs(p.x()) <= kAside_mm && p.z() <= kHighest_mm && p.z() >= kLowest_mm;
      if (in_box && p.y() < foremost) {
        foremost = p.y();
        height_mm = p.z();
        tip = mesh.points[v];
      }
    }
  }
  const bool on_rim = height_mm > kHighest_mm - kRim_mm || height_mm < kLowest_mm + kRim_mm;
  return on_rim ? std::nullopt : tip;
}

}  // namespace

std::vector<SiteError> MeasureSites(const TriMesh& outer_skin, const TriMesh& face,
                                    std::span<const Dowel> landmarks) {
  const MeshQuery skin_query(outer_skin), face_query(face);
  std::vector<SiteError> errors;
  for (const Dowel& landmark : landmarks) {
    if (landmark.direction.allFinite()) {
      errors.push_back({landmark.site, ExitAlong(outer_skin, skin_query, landmark, 0),
                        ExitAlong(face, face_query, landmark, kBehind_mm)});
    }
  }
  return errors;
}

std::vector<FeatureError> MeasureFeaturePoints(const TriMesh& outer_skin, const TriMesh& face,
                                               const SkullSites& sites) {
  const std::optional<Vec3> on_truth = NoseTip(outer_skin, sites), on_face = NoseTip(face, sites);
  if (!on_truth || !on_face) {
    return {};
  }
  return {{"nose_tip", *on_truth, *on_face}};
}

std::vector<FeatureDistortion> MeasureFeatures(const TemplateFace& placed,
                                               const HSplineSurface& fitted) {
  std::vector<FeatureDistortion> parts;
  for (const TemplateFeature& feature : placed.features) {
    if (feature.region) {
      const auto inside = [&](const Vec3& p) { return feature.region->Contains(p); };
      parts.push_back({feature.name, MeasureDistortion(fitted, placed.surface, inside)});
    }
  }
  const auto inside = [&](const Vec3& p) {
    return std::any_of(placed.features.begin(), placed.features.end(),
                       [&](const auto& f) { return f.region && f.region->Contains(p); });
  };
  const auto outside = [&](const Vec3& p) { return !inside(p); };
  parts.push_back({"features", MeasureDistortion(fitted, placed.surface, inside)});
  parts.push_back({"elsewhere", MeasureDistortion(fitted, placed.surface, outside)});
  return parts;
}

nlohmann::ordered_json FeaturesToJson(const std::vector<FeatureDistortion>& features) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const FeatureDistortion& f : features) {
    json[f.part] = {{"rms_strain", f.distortion.rms_strain},
                    {"max_strain", f.distortion.max_strain},
                    {"rms_area", f.distortion.rms_area},
                    {"area_cm2", f.distortion.area_cm2}};
  }
  return json;
}

namespace {

using Json = nlohmann::ordered_json;

Vec3 ToFront(const ScoreBasis& basis) {
  const Vec3 front(0, -1, 0);
  return basis.sites ? Vec3(basis.sites->skull_from_average.rotation * front) : front;
}

Json ProtocolsJson(const FaceMetrics& metrics, const FaceDetails& score) {
  Json json;
  json["ct_frame"] = SummaryToJson(metrics.truth_to_face);
  json["best_fit"] = SummaryToJson(score.best_fit.truth_to_face);
  json["best_fit"].update(Json{{"turned_deg", score.best_fit.turned_deg},
                               {"moved_mm", score.best_fit.moved_mm},
                               {"steps", score.best_fit.steps},
                               {"converged", score.best_fit.converged}});
  json["view_ray"] = SummaryToJson(score.view_ray.along_ray);
  json["view_ray"]["missed_cm2"] = score.view_ray.missed_cm2;
  return json;
}

// The means are over the sites at which the rays met both skins.
Json SitesJson(const std::vector<SiteError>& sites) {
  Json json = {{"mean_abs_mm", nullptr}, {"rms_mm", nullptr}, {"sites", Json::object()}};
  double absolute = 0, squares = 0;
  int known = 0;
  for (const SiteError& site : sites) {
    const double error = site.Error_mm();
    json["sites"][site.site] = {
        {"true_mm", site.true_mm}, {"face_mm", site.face_mm}, {"error_mm", error}};
    if (std::isfinite(error)) {
      absolute += std::abs(error);
      squares += error * error;
      ++known;
    }
  }
  if (known > 0) {
    json["mean_abs_mm"] = absolute / known;
    json["rms_mm"] = std::sqrt(squares / known);
  }
  return json;
}

Json FeaturesJson(const std::vector<FeatureError>& features) {
  Json json = Json::object();
  for (const FeatureError& f : features) {
    const Vec3 off = f.on_face - f.on_truth;
    json[f.name] = {{"error_mm", f.Error_mm()}, {"off_mm", {off.x(), off.y(), off.z()}}};
  }
  return json;
}

double AreaWithStatus(const ScoredSkin& skin, SkinStatus status) {
  return skin.area_cm2[static_cast<int>(status)];
}

Json SkinJson(const ScoredSkin& skin) {
  Json json;
  const auto names = EnumNames(SkinStatus{});
  for (std::size_t k = 0; k < names.size(); ++k) {
    json[fmt::format("{}_cm2", names[k])] = skin.area_cm2[k];
  }
  json["ends"] = Json::array();
  for (const CutPlane& end : skin.ends) {
    json["ends"].push_back(ToPhrase(end));
  }
  return json;
}

}  // namespace

ScoreBasis MakeScoreBasis(std::vector<Dowel> landmarks) {
  constexpr std::size_t kFewestSites = 3;  // a pose needs as many
  ScoreBasis basis{std::nullopt, std::move(landmarks)};
  std::vector<SitePoint> points;
  for (const Dowel& landmark : basis.landmarks) {
    if (IsStandardSite(landmark.site)) {
      points.push_back({landmark.site, landmark.base});
    }
  }
  if (points.size() >= kFewestSites) {
    basis.sites = CompleteSites(points);
  }
  return basis;
}

FaceDetails MeasureDetails(const TriMesh& truth, const ScoredSkin& skin, const ScoreBasis& basis,
                           const TriMesh& face, const RunContext& context) {
  const TriMesh outer = OuterSurface(truth, skin.region);
  FaceDetails details;
  details.best_fit = ScoreBestFit(truth, skin.region, face, context);
  details.view_ray = ScoreAlongView(truth, skin.region, face, ToFront(basis), context);
  details.sites = MeasureSites(outer, face, basis.landmarks);
  if (basis.sites) {
    details.features = MeasureFeaturePoints(outer, face, *basis.sites);
  }
  return details;
}

Json ScoreToJson(const FaceMetrics& metrics, const FaceDetails& details, const ScoredSkin& skin) {
  Json json = MetricsToJson(metrics);
  json["protocols"] = ProtocolsJson(metrics, details);
  json["landmarks"] = SitesJson(details.sites);
  json["features"] = FeaturesJson(details.features);
  json["scored_skin"] = SkinJson(skin);
  return json;
}

std::string ToPhrase(const ScoredSkin& skin) {
  std::string left_out;
  const auto names = EnumNames(SkinStatus{});
  for (const SkinStatus status : {SkinStatus::kMasked, SkinStatus::kInner, SkinStatus::kEnd}) {
    left_out += fmt::format("{}{:.1f} cm² {}", left_out.empty() ? "" : ", ",
                            AreaWithStatus(skin, status), names[static_cast<int>(status)]);
  }
  return fmt::format("{:.1f} cm² of outer skin scored; left out of the face: {}",
                     AreaWithStatus(skin, SkinStatus::kScored), left_out);
}

}  // namespace semblance::problems
