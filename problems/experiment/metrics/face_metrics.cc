// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/metrics/face_metrics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <numbers>

#include "surfaces/base/parallel.h"
#include "surfaces/base/quantile.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

struct Corner {
  Vec3 point, move;
  double signed_mm;
};

double Swept_mm3(const Corner& a, const Corner& b, const Corner& c) {
  const Vec3 e1 = b.point - a.point, e2 = c.point - a.point;
  const Vec3 f1 = b.move - a.move, f2 = c.move - a.move;
  const Vec3 twice_area = e1.cross(e2) + (e1.cross(f2) + f1.cross(e2)) / 2 + f1.cross(f2) / 3;
  return ((a.move + b.move + c.move) / 3).dot(twice_area) / 2;
}

// The point between corners of opposite sign at which the distance is 0, so that the surfaces meet.
Corner Crossing(const Corner& a, const Corner& b) {
  const double s = a.signed_mm / (a.signed_mm - b.signed_mm);
  return {a.point + s * (b.point - a.point), a.move + s * (b.move - a.move), 0};
}

void Add(double swept_mm3, bool outside, EnclosedVolume& volume) {
  (outside ? volume.outside_cm3 : volume.inside_cm3) += (outside ? 1 : -1) * swept_mm3 / 1000;
}

EnclosedVolume SweptByTriangle(const std::array<Corner, 3>& t) {
  EnclosedVolume volume;
  const auto outside = [&](int k) { return t[k].signed_mm > 0; };
  int alone = 0;  // the corner with a sign of its own; 3 if all signs are equal
  while (alone < 3 && (outside(alone) == outside((alone + 1) % 3) ||
                       outside(alone) == outside((alone + 2) % 3))) {
    ++alone;
  }
  if (alone == 3) {
    Add(Swept_mm3(t[0], t[1], t[2]), outside(0), volume);
    return volume;
  }
  const Corner &a = t[alone], &b = t[(alone + 1) % 3], &c = t[(alone + 2) % 3];
  const Corner ab = Crossing(a, b), ac = Crossing(a, c);
  Add(Swept_mm3(a, ab, ac), outside(alone), volume);
  Add(Swept_mm3(ab, b, c) + Swept_mm3(ab, c, ac), !outside(alone), volume);
  return volume;
}

void Accumulate(const EnclosedVolume& more, double share, EnclosedVolume& sum) {
  sum.outside_cm3 += share * more.outside_cm3;
  sum.inside_cm3 += share * more.inside_cm3;
}

}  // namespace

VolumeByPart MeasureEnclosed(const TriMesh& mesh, std::span<const Vec3> move,
                             std::span<const double> signed_mm, std::span<const int> part) {
  VolumeByPart volume;
  for (const Triangle& t : mesh.triangles) {
    std::array<Corner, 3> corners;
    bool known = true;
    for (int k = 0; k < 3; ++k) {
      corners[k] = {mesh.points[t[k]], move[t[k]], signed_mm[t[k]]};
      known = known && std::isfinite(signed_mm[t[k]]);
    }
    if (known) {
      const EnclosedVolume swept = SweptByTriangle(corners);
      Accumulate(swept, 1, volume.all);
      for (const auto v : t) {
        if (part[v] >= 0) {
          Accumulate(swept, 1.0 / 3, volume.parts[part[v]]);
        }
      }
    }
  }
  return volume;
}

namespace {

struct Sample {
  double signed_mm;
  double area_mm2;
};

std::vector<WeightedValue> SortedAbsolutes(const std::vector<Sample>& samples) {
  std::vector<double> absolute_mm, areas_mm2;
  for (const Sample& s : samples) {
    absolute_mm.push_back(std::abs(s.signed_mm));
    areas_mm2.push_back(s.area_mm2);
  }
  return SortedValues(absolute_mm, areas_mm2);
}

double ShareWithin(const std::vector<Sample>& samples, double total_mm2, double limit_mm) {
  double within_mm2 = 0;
  for (const Sample& s : samples) {
    within_mm2 += std::abs(s.signed_mm) <= limit_mm ? s.area_mm2 : 0;
  }
  return within_mm2 / total_mm2;
}

DistanceSummary Summarize(const std::vector<Sample>& samples) {
  DistanceSummary summary;
  double area = 0, first = 0, absolute = 0, second = 0;
  for (const Sample& s : samples) {
    area += s.area_mm2;
    first += s.area_mm2 * s.signed_mm;
    absolute += s.area_mm2 * std::abs(s.signed_mm);
    second += s.area_mm2 * s.signed_mm * s.signed_mm;
  }
  if (!(area > 0)) {
    return summary;
  }
  const std::vector<WeightedValue> sorted = SortedAbsolutes(samples);
  summary.area_cm2 = area / 100;
  summary.mean_signed_mm = first / area;
  summary.mean_abs_mm = absolute / area;
  summary.sd_mm = std::sqrt(std::max(0.0, second / area - std::pow(first / area, 2)));
  summary.rms_mm = std::sqrt(second / area);
  summary.median_mm = Quantile(sorted, 0.5);
  summary.p95_mm = Quantile(sorted, 0.95);
  summary.max_mm = sorted.back().value;
  summary.within_2_5mm = ShareWithin(samples, area, 2.5);
  summary.within_5mm = ShareWithin(samples, area, 5);
  return summary;
}

std::vector<double> Quantiles(const std::vector<Sample>& samples) {
  constexpr int kSteps = 20;
  const std::vector<WeightedValue> sorted = SortedAbsolutes(samples);
  std::vector<double> quantiles;
  for (int k = 0; k <= kSteps && !sorted.empty(); ++k) {
    quantiles.push_back(Quantile(sorted, static_cast<double>(k) / kSteps));
  }
  return quantiles;
}

// The points of a mesh that are nearest to chosen vertices of another mesh.
struct Nearest {
  std::vector<MeshPoint> points;  // one per vertex; without a triangle if the vertex is not chosen
  // Positive if the mesh lies on the outer side of the vertex's normal; NaN if it is not chosen.
  std::vector<double> signed_mm;
};

Nearest FindNearest(const TriMesh& from, const std::vector<Vec3>& normals,
                    const std::vector<bool>& wanted, const MeshQuery& to,
                    const RunContext& context) {
  Nearest nearest{std::vector<MeshPoint>(from.points.size()),
                  std::vector<double>(from.points.size(), kNaN)};
  ParallelFor(from.points.size(), context.threads, 256, [&](std::size_t v) {
    if (wanted[v]) {
      const MeshPoint found = to.Closest(from.points[v]);
      const double side = (found.position - from.points[v]).dot(normals[v]);
      nearest.points[v] = found;
      nearest.signed_mm[v] = side < 0 ? -found.distance_mm : found.distance_mm;
    }
  });
  return nearest;
}

std::vector<Vec3> Displacements(const TriMesh& from, const Nearest& nearest) {
  std::vector<Vec3> moves;
  for (std::size_t v = 0; v < from.points.size(); ++v) {
    moves.push_back(nearest.points[v].position - from.points[v]);
  }
  return moves;
}

Vec3 NormalAt(const TriMesh& mesh, const std::vector<Vec3>& normals, const MeshPoint& point) {
  const Triangle& t = mesh.triangles[point.triangle];
  return point.weights[0] * normals[t[0]] + point.weights[1] * normals[t[1]] +
         point.weights[2] * normals[t[2]];
}

AngleSummary CompareNormals(const std::vector<Vec3>& normals, const std::vector<double>& areas_mm2,
                            const Nearest& nearest, const TriMesh& face) {
  const std::vector<Vec3> face_normals = VertexNormals(face);
  std::vector<double> angles_deg, weights;
  double sum = 0, area = 0;
  for (std::size_t v = 0; v < normals.size(); ++v) {
    if (nearest.points[v].triangle < 0) {
      continue;
    }
    const Vec3 other = NormalAt(face, face_normals, nearest.points[v]);
    if (normals[v].norm() > 0 && other.norm() > 0) {
      const double angle = std::atan2(normals[v].cross(other).norm(), normals[v].dot(other));
      angles_deg.push_back(angle * 180 / std::numbers::pi);
      weights.push_back(areas_mm2[v]);
      sum += areas_mm2[v] * angles_deg.back();
      area += areas_mm2[v];
    }
  }
  const std::vector<WeightedValue> sorted = SortedValues(angles_deg, weights);
  return {area > 0 ? sum / area : kNaN, Quantile(sorted, 0.5), Quantile(sorted, 0.95)};
}

std::vector<Sample> TakeSamples(const std::vector<double>& signed_mm,
                                const std::vector<double>& areas_mm2,
                                const std::function<bool(std::size_t)>& take) {
  std::vector<Sample> samples;
  for (std::size_t v = 0; v < signed_mm.size(); ++v) {
    if (std::isfinite(signed_mm[v]) && take(v)) {
      samples.push_back({signed_mm[v], areas_mm2[v]});
    }
  }
  return samples;
}

std::vector<bool> FaceOverScoredSkin(const TriMesh& outer, const FaceRegion& region,
                                     const MeshQuery& outer_query, const TriMesh& face,
                                     const RunContext& context) {
  const std::vector<bool> comparable = ComparableTriangles(outer, region);
  std::vector<char> over(face.points.size(), 0);
  ParallelFor(face.points.size(), context.threads, 256, [&](std::size_t v) {
    over[v] = comparable[outer_query.Closest(face.points[v]).triangle] ? 1 : 0;
  });
  return {over.begin(), over.end()};
}

// Joins both sets with half of the weight each. If one has no area, the other one has all weight.
std::vector<Sample> EvenlyWeighted(std::vector<Sample> a, const std::vector<Sample>& b) {
  const auto area = [](const std::vector<Sample>& samples) {
    double sum = 0;
    for (const Sample& s : samples) {
      sum += s.area_mm2;
    }
    return sum;
  };
  const double area_a = area(a), area_b = area(b);
  for (const Sample& s : b) {
    a.push_back({s.signed_mm, s.area_mm2 * (area_b > 0 ? area_a / area_b : 0)});
  }
  return a;
}

}  // namespace

void CheckScored(const FaceRegion& region) {
  if (std::find(region.scored.begin(), region.scored.end(), true) == region.scored.end()) {
    throw InputError(
        "face metrics: no vertex of the true skin is scored; check that skull and skin share a "
        "frame, and the part of the skin that `region` selects (extent, reach_mm, exclude)");
  }
}

TriMesh OuterSurface(const TriMesh& truth, const FaceRegion& region) {
  if (region.outer.empty()) {
    return truth;
  }
  TriMesh outer{truth.points, {}};
  std::ranges::copy_if(truth.triangles, std::back_inserter(outer.triangles),
                       [&](const Triangle& t) {
                         return region.outer[t[0]] && region.outer[t[1]] && region.outer[t[2]];
                       });
  return outer;
}

std::vector<bool> ComparableTriangles(const TriMesh& outer_surface, const FaceRegion& region) {
  std::vector<bool> usable = region.scored;
  for (const MeshEdge& edge : BorderEdges(outer_surface)) {
    usable[edge[0]] = usable[edge[1]] = false;
  }
  std::vector<bool> comparable;
  for (const Triangle& t : outer_surface.triangles) {
    comparable.push_back(usable[t[0]] && usable[t[1]] && usable[t[2]]);
  }
  return comparable;
}

DistanceSummary SummarizeDistances(const std::vector<double>& signed_mm,
                                   const std::vector<double>& areas_mm2,
                                   const std::function<bool(std::size_t)>& take) {
  return Summarize(TakeSamples(signed_mm, areas_mm2, take));
}

std::map<std::string, DistanceSummary> SummarizeParts(const std::vector<double>& signed_mm,
                                                      const std::vector<double>& areas_mm2,
                                                      const FaceRegion& region) {
  std::map<std::string, DistanceSummary> parts;
  for (int part = 0; part < static_cast<int>(kFaceParts.size()); ++part) {
    const auto samples =
        TakeSamples(signed_mm, areas_mm2, [&](std::size_t v) { return region.part[v] == part; });
    if (!samples.empty()) {
      parts[kFaceParts[part]] = Summarize(samples);
    }
  }
  return parts;
}

FaceMetrics CompareFaces(const TriMesh& truth, const FaceRegion& region, const TriMesh& face,
                         const RunContext& context) {
  CheckScored(region);
  const TriMesh outer = OuterSurface(truth, region);
  const MeshQuery face_query(face), outer_query(outer);
  const std::vector<double> truth_areas = VertexAreas(truth);
  const std::vector<Vec3> truth_normals = VertexNormals(truth);
  const auto any = [](std::size_t) { return true; };
  FaceMetrics metrics;
  const Nearest forth = FindNearest(truth, truth_normals, region.scored, face_query, context);
  const std::vector<Sample> there = TakeSamples(forth.signed_mm, truth_areas, any);
  metrics.truth_to_face = Summarize(there);
  metrics.quantiles_mm = Quantiles(there);
  metrics.regions = SummarizeParts(forth.signed_mm, truth_areas, region);
  metrics.normals = CompareNormals(truth_normals, truth_areas, forth, face);
  const VolumeByPart volume =
      MeasureEnclosed(truth, Displacements(truth, forth), forth.signed_mm, region.part);
  metrics.volume = volume.all;
  for (const auto& [part, enclosed] : volume.parts) {
    metrics.region_volumes[kFaceParts[part]] = enclosed;
  }
  const std::vector<bool> over = FaceOverScoredSkin(outer, region, outer_query, face, context);
  // These distances are seen from the face. The truth lies outside the face if the face lies inside
  // the truth, so the sign turns.
  std::vector<double> back =
      FindNearest(face, VertexNormals(face), over, outer_query, context).signed_mm;
  std::transform(back.begin(), back.end(), back.begin(), [](double d) { return -d; });
  const std::vector<Sample> here = TakeSamples(back, VertexAreas(face), any);
  metrics.face_to_truth = Summarize(here);
  metrics.symmetric = Summarize(EvenlyWeighted(there, here));
  metrics.hausdorff_mm = std::fmax(metrics.truth_to_face.max_mm, metrics.face_to_truth.max_mm);
  metrics.volume_between_cm3 =
      metrics.truth_to_face.mean_abs_mm * metrics.truth_to_face.area_cm2 / 10;
  metrics.signed_mm = forth.signed_mm;
  return metrics;
}

using Json = nlohmann::ordered_json;  // writes NaN as null

Json SummaryToJson(const DistanceSummary& s) {
  return {{"mean_abs_mm", s.mean_abs_mm},
          {"rms_mm", s.rms_mm},
          {"median_mm", s.median_mm},
          {"p95_mm", s.p95_mm},
          {"max_mm", s.max_mm},
          {"mean_signed_mm", s.mean_signed_mm},
          {"sd_mm", s.sd_mm},
          {"within_2_5mm", s.within_2_5mm},
          {"within_5mm", s.within_5mm},
          {"area_cm2", s.area_cm2}};
}

namespace {

void AddVolume(const EnclosedVolume& volume, Json& json) {
  json["enclosed_volume_cm3"] = volume.Enclosed();
  json["outside_volume_cm3"] = volume.outside_cm3;
  json["inside_volume_cm3"] = volume.inside_cm3;
}

Json RegionsToJson(const FaceMetrics& metrics) {
  Json json = Json::object();
  for (const auto& [name, summary] : metrics.regions) {
    json[name] = SummaryToJson(summary);
    const auto volume = metrics.region_volumes.find(name);
    AddVolume(volume == metrics.region_volumes.end() ? EnclosedVolume{} : volume->second,
              json[name]);
  }
  return json;
}

}  // namespace

Json MetricsToJson(const FaceMetrics& metrics) {
  Json json = SummaryToJson(metrics.truth_to_face);
  json["hausdorff_mm"] = metrics.hausdorff_mm;
  json["volume_between_cm3"] = metrics.volume_between_cm3;
  AddVolume(metrics.volume, json);
  json["normals"] = {{"mean_deg", metrics.normals.mean_deg},
                     {"median_deg", metrics.normals.median_deg},
                     {"p95_deg", metrics.normals.p95_deg}};
  json["quantiles_mm"] = metrics.quantiles_mm;
  json["reverse"] = SummaryToJson(metrics.face_to_truth);
  json["symmetric"] = SummaryToJson(metrics.symmetric);
  json["regions"] = RegionsToJson(metrics);
  return json;
}

}  // namespace semblance::problems
