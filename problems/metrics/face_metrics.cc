// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/metrics/face_metrics.h"

#include <algorithm>
#include <cmath>

#include "problems/metrics/quantile.h"
#include "surfaces/base/parallel.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance {
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

// Distance of each wanted point to the mesh, positive where the mesh lies on the outer side of the
// point's normal.
std::vector<double> SignedDistances(const TriMesh& from, const std::vector<bool>& wanted,
                                    const MeshQuery& to, const RunContext& context) {
  const std::vector<Vec3> normals = VertexNormals(from);
  std::vector<double> distances(from.points.size(), kNaN);
  ParallelFor(from.points.size(), context.threads, 256, [&](std::size_t v) {
    if (wanted[v]) {
      const MeshPoint nearest = to.Closest(from.points[v]);
      const double side = (nearest.position - from.points[v]).dot(normals[v]);
      distances[v] = side < 0 ? -nearest.distance_mm : nearest.distance_mm;
    }
  });
  return distances;
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

std::vector<bool> FaceOverScoredSkin(const TriMesh& truth, const FaceRegion& region,
                                     const MeshQuery& truth_query, const TriMesh& face,
                                     const RunContext& context) {
  const std::vector<bool> comparable = ComparableTriangles(truth, region);
  std::vector<char> over(face.points.size(), 0);
  ParallelFor(face.points.size(), context.threads, 256, [&](std::size_t v) {
    over[v] = comparable[truth_query.Closest(face.points[v]).triangle];
  });
  return {over.begin(), over.end()};
}

void RequireScored(const FaceRegion& region) {
  if (std::find(region.scored.begin(), region.scored.end(), true) == region.scored.end()) {
    throw InputError(
        "face metrics: no vertex of the true skin is scored; check that skull and skin share a "
        "frame, and the excluded zones");
  }
}

}  // namespace

std::vector<bool> ComparableTriangles(const TriMesh& truth, const FaceRegion& region) {
  std::vector<bool> usable = region.scored;
  for (const MeshEdge& edge : BorderEdges(truth)) {
    usable[edge[0]] = usable[edge[1]] = false;
  }
  std::vector<bool> comparable;
  for (const Triangle& t : truth.triangles) {
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

FaceRegion WholeSurface(const TriMesh& truth) {
  return {std::vector<bool>(truth.points.size(), true), std::vector<int>(truth.points.size(), -1)};
}

FaceMetrics CompareFaces(const TriMesh& truth, const FaceRegion& region, const TriMesh& face,
                         const RunContext& context) {
  RequireScored(region);
  const MeshQuery face_query(face), truth_query(truth);
  const std::vector<double> truth_areas = VertexAreas(truth);
  FaceMetrics metrics;
  metrics.signed_mm = SignedDistances(truth, region.scored, face_query, context);
  const std::vector<Sample> all =
      TakeSamples(metrics.signed_mm, truth_areas, [](std::size_t) { return true; });
  metrics.truth_to_face = Summarize(all);
  metrics.quantiles_mm = Quantiles(all);
  metrics.regions = SummarizeParts(metrics.signed_mm, truth_areas, region);
  const std::vector<bool> over = FaceOverScoredSkin(truth, region, truth_query, face, context);
  // Seen from the face, the truth lies outside where the face lies inside: the sign turns.
  std::vector<double> back = SignedDistances(face, over, truth_query, context);
  std::transform(back.begin(), back.end(), back.begin(), [](double d) { return -d; });
  metrics.face_to_truth =
      SummarizeDistances(back, VertexAreas(face), [](std::size_t) { return true; });
  metrics.hausdorff_mm = std::fmax(metrics.truth_to_face.max_mm, metrics.face_to_truth.max_mm);
  metrics.volume_between_cm3 =
      metrics.truth_to_face.mean_abs_mm * metrics.truth_to_face.area_cm2 / 10;
  return metrics;
}

}  // namespace semblance
