// SPDX-License-Identifier: GPL-3.0-or-later
// The distances, angles and volumes between a reconstructed face and the true skin, also as JSON
// for result.json and `semblance evaluate`.
#pragma once

#include <functional>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "problems/experiment/metrics/face_region.h"
#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

// ---------------------------------------------------------------------------------------------
// Volume
// ---------------------------------------------------------------------------------------------

// The volume between two surfaces (thesis 5.3).
struct EnclosedVolume {
  double outside_cm3 = 0;  // the part in which the other surface lies outside
  double inside_cm3 = 0;   // the part in which it lies inside

  double Enclosed() const { return outside_cm3 + inside_cm3; }
  double Net() const { return outside_cm3 - inside_cm3; }
};

struct VolumeByPart {
  EnclosedVolume all;
  std::map<int, EnclosedVolume> parts;  // a triangle counts by thirds for the parts of its corners
};

// Measures the volume that the triangles sweep from p to p + move. A triangle has the edges e1, e2.
// Its displacement is linear, with mean m and differences f1, f2 along the edges. It sweeps the
// volume
//   m . (e1 x e2 + (e1 x f2 + f1 x e2) / 2 + f1 x f2 / 3) / 2.
// This is the exact integral of the area element over the way. The area element grows or shrinks on
// the way where the surface is curved. The volume counts as outside where signed_mm > 0. A triangle
// on which the sign changes is divided at the zero of signed_mm. Triangles with a corner without a
// finite signed_mm are left out. move, signed_mm and part: one entry per point of the mesh; parts <
// 0 count for `all` only.
VolumeByPart MeasureEnclosed(const TriMesh& mesh, std::span<const Vec3> move,
                             std::span<const double> signed_mm, std::span<const int> part);

// ---------------------------------------------------------------------------------------------
// Distances and angles
// ---------------------------------------------------------------------------------------------

// Distances over a set of skin vertices, each weighted by its area. All NaN if nothing was scored.
struct DistanceSummary {
  double area_cm2 = kNaN;        // scored skin
  double mean_signed_mm = kNaN;  // > 0: the reconstruction lies outside the true skin
  double mean_abs_mm = kNaN;
  double sd_mm = kNaN;  // of the signed distance
  double rms_mm = kNaN;
  double median_mm = kNaN;  // of the absolute distance, area-weighted
  double p95_mm = kNaN;
  double max_mm = kNaN;
  double within_2_5mm = kNaN;  // share of the area, 0..1
  double within_5mm = kNaN;
};

// Summarises the finite values at the vertices with take(v), weighted by the areas. signed_mm and
// areas_mm2: one entry per vertex.
DistanceSummary SummarizeDistances(const std::vector<double>& signed_mm,
                                   const std::vector<double>& areas_mm2,
                                   const std::function<bool(std::size_t)>& take);

// The same by part of the face, without parts in which nothing is finite.
std::map<std::string, DistanceSummary> SummarizeParts(const std::vector<double>& signed_mm,
                                                      const std::vector<double>& areas_mm2,
                                                      const FaceRegion& region);

// Between the normals of the two surfaces at corresponding points, weighted by area.
struct AngleSummary {
  double mean_deg = kNaN;
  double median_deg = kNaN;
  double p95_deg = kNaN;
};

struct FaceMetrics {
  // From each scored vertex of the true skin to the nearest point of the face.
  DistanceSummary truth_to_face;
  // From each face vertex to the nearest point of the outer skin, if that lies in a comparable
  // triangle.
  DistanceSummary face_to_truth;
  DistanceSummary symmetric;   // both directions together, each with half of the weight
  double hausdorff_mm = kNaN;  // the larger of the two maxima
  AngleSummary normals;        // between each scored vertex and the nearest point of the face
  // The mean absolute distance times the area. On curved surfaces this is not the volume.
  double volume_between_cm3 = kNaN;
  EnclosedVolume volume;                                 // between the surfaces (thesis 5.3)
  std::map<std::string, DistanceSummary> regions;        // truth_to_face by part of the face
  std::map<std::string, EnclosedVolume> region_volumes;  // by part of the face
  // 21 quantiles of the absolute truth_to_face by area; the k-th is not exceeded on k/20 of the
  // area.
  std::vector<double> quantiles_mm;
  std::vector<double> signed_mm;  // one per vertex of the true skin; NaN if not scored
};

// Throws InputError if no vertex is scored.
void CheckScored(const FaceRegion& region);

// Measures area-weighted distances to closest points (not along a normal), without any alignment.
// region: of the vertices of `truth`. Throws as CheckScored does.
FaceMetrics CompareFaces(const TriMesh& truth, const FaceRegion& region, const TriMesh& face,
                         const RunContext& context);

// The true skin without the triangles that have an inner corner. It keeps all points, so that their
// indices stay the same.
TriMesh OuterSurface(const TriMesh& truth, const FaceRegion& region);

// One entry per triangle of the outer surface: whether distances may be measured to it. All its
// corners are scored, and none lies on an open border, where the scan ends but the face goes on.
std::vector<bool> ComparableTriangles(const TriMesh& outer_surface, const FaceRegion& region);

// ---------------------------------------------------------------------------------------------
// JSON
// ---------------------------------------------------------------------------------------------

// {mean_abs_mm, rms_mm, median_mm, p95_mm, hausdorff_mm, within_2_5mm, volume_between_cm3,
// enclosed_volume_cm3, ..., normals{}, reverse{}, symmetric{}, regions{}}; null for NaN.
nlohmann::ordered_json SummaryToJson(const DistanceSummary& summary);
nlohmann::ordered_json MetricsToJson(const FaceMetrics& metrics);

}  // namespace semblance::problems
