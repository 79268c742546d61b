// SPDX-License-Identifier: GPL-3.0-or-later
// Scores a face by the protocols of other papers, so that figures can be compared. Our own protocol
// (face_metrics.h) measures in the frame of the scan without any alignment, and is the strictest.
#pragma once

#include "problems/experiment/metrics/face_metrics.h"

namespace semblance::problems {

// The score after the rigid motion that brings the face closest to the scored skin (Lee et al.
// 2012, Miranda et al. 2018). It hides an error of pose.
struct BestFitScore {
  DistanceSummary truth_to_face;
  Similarity aligned_from_face;  // scale 1
  double turned_deg = kNaN;
  double moved_mm = kNaN;  // of the middle of the scored skin
  int steps = -1;
  bool converged = false;
};

// The score along rays from the front (Hu et al. 2021), weighted by the area in the picture. It
// covers the scored skin that is seen from there, except skin that is steeper than 75 degrees to
// the view.
struct ViewRayScore {
  DistanceSummary along_ray;  // > 0: the face is nearer to the viewer
  double missed_cm2 = kNaN;   // area of such skin whose ray misses the face
};

// Minimises the mean squared distance to the closest points, by area, over up to 4000 evenly taken
// vertices. Levenberg-Marquardt on the distance itself finds the minimum of ICP without its many
// steps. The reported distances are over all vertices. Throws as CompareFaces does.
BestFitScore ScoreBestFit(const TriMesh& truth, const FaceRegion& region, const TriMesh& face,
                          const RunContext& context);

// to_front: unit, from the face to the viewer.
ViewRayScore ScoreAlongView(const TriMesh& truth, const FaceRegion& region, const TriMesh& face,
                            const Vec3& to_front, const RunContext& context);

}  // namespace semblance::problems
