// SPDX-License-Identifier: GPL-3.0-or-later
// How far a reconstructed face is from the true skin.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "problems/metrics/enclosed_volume.h"
#include "problems/metrics/face_region.h"
#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// Unsigned distances over a set of skin vertices, each weighted by the area it stands for. All NaN
// where nothing was scored.
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

// Of the signed values at the vertices that are finite and for which take(v), weighted by the
// areas; one value and area per vertex.
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
  DistanceSummary
      truth_to_face;  // from each scored vertex of the true skin to the nearest point of the face
  DistanceSummary face_to_truth;  // from each face vertex whose nearest point of the outer skin
                                  // lies in a comparable triangle, to that point
  DistanceSummary symmetric;      // both directions together, half of the weight each
  double hausdorff_mm = kNaN;     // the larger of the two maxima
  AngleSummary normals;           // of each scored vertex and the nearest point of the face
  double volume_between_cm3 =
      kNaN;  // the mean absolute distance times the area: no volume where surfaces curve
  EnclosedVolume volume;                                 // between the surfaces (thesis 5.3)
  std::map<std::string, DistanceSummary> regions;        // truth_to_face by part of the face
  std::map<std::string, EnclosedVolume> region_volumes;  // by part of the face
  std::vector<double> quantiles_mm;  // of the absolute truth_to_face, by area: the k-th of 21 is
                                     // not exceeded on k/20 of it
  std::vector<double> signed_mm;     // one per vertex of the true skin, NaN where not scored
};

// Throws InputError if no vertex is scored.
void CheckScored(const FaceRegion& region);

// Area-weighted, closest-point distances (not along a normal); no alignment is done.
// region: of the vertices of `truth`. Throws as CheckScored.
FaceMetrics CompareFaces(const TriMesh& truth, const FaceRegion& region, const TriMesh& face,
                         const RunContext& context);

// The true skin without triangles that have a corner which is not outer; all its points, so that
// their indices stay.
TriMesh OuterSurface(const TriMesh& truth, const FaceRegion& region);

// One entry per triangle of the outer surface: whether what is nearest to it can be compared with
// it. All three corners are scored and none is on an open border, where a scan ends and the face
// goes on.
std::vector<bool> ComparableTriangles(const TriMesh& outer_surface, const FaceRegion& region);

// All of `truth` as one region without parts.
FaceRegion WholeSurface(const TriMesh& truth);

}  // namespace semblance
