// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/metrics/face_details.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "problems/metrics/face_metrics_json.h"
#include "problems/subject/sites.h"

namespace semblance {
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

// Means over the sites at which both skins were met.
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

double AreaAt(const ScoredSkin& skin, SkinStatus status) {
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
    json["ends"].push_back(InWords(end));
  }
  return json;
}

}  // namespace

ScoreBasis BasisOf(std::vector<Dowel> landmarks) {
  constexpr std::size_t kFewest = 3;
  ScoreBasis basis{std::nullopt, std::move(landmarks)};
  std::vector<SitePoint> points;
  for (const Dowel& landmark : basis.landmarks) {
    if (IsStandardSite(landmark.site)) {
      points.push_back({landmark.site, landmark.base});
    }
  }
  if (points.size() >= kFewest) {
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

std::string InWords(const ScoredSkin& skin) {
  std::string left_out;
  const auto names = EnumNames(SkinStatus{});
  for (const SkinStatus status : {SkinStatus::kMasked, SkinStatus::kInner, SkinStatus::kEnd}) {
    left_out += fmt::format("{}{:.1f} cm² {}", left_out.empty() ? "" : ", ", AreaAt(skin, status),
                            names[static_cast<int>(status)]);
  }
  return fmt::format("{:.1f} cm² of outer skin scored; left out of the face: {}",
                     AreaAt(skin, SkinStatus::kScored), left_out);
}

}  // namespace semblance
