// SPDX-License-Identifier: GPL-3.0-or-later
// The same face scored as other papers score theirs, so that figures can be set side by side. Ours,
// in the frame of the scan without any alignment, is the strictest (face_metrics.h).
#pragma once

#include "problems/metrics/face_metrics.h"

namespace semblance {

// After the rigid motion of the face that lies best on the scored skin (Lee et al. 2012, Miranda et
// al. 2018): it hides an error of pose.
struct BestFitScore {
  DistanceSummary truth_to_face;
  Similarity aligned_from_face;  // scale 1
  double turned_deg = kNaN;
  double moved_mm = kNaN;  // of the middle of the scored skin
  int steps = -1;
  bool converged = false;
};

// Along rays from the front (Hu et al. 2021), of the scored skin that is seen from there and does
// not stand steeper than 75 degrees to the view, weighted by the area in the picture.
struct ViewRayScore {
  DistanceSummary along_ray;  // > 0: the face is nearer to the viewer
  double missed_cm2 = kNaN;   // of scored skin that is seen, where the ray misses the face
};

// Minimises the squared closest-point distance, by area, over up to 4000 evenly taken vertices
// (Levenberg-Marquardt on the distance itself, which makes it ICP's minimum without its many
// steps). The distances told are of all vertices. Throws as CompareFaces.
BestFitScore ScoreBestFit(const TriMesh& truth, const FaceRegion& region, const TriMesh& face,
                          const RunContext& context);

// to_front: unit, from the face to the viewer.
ViewRayScore ScoreAlongView(const TriMesh& truth, const FaceRegion& region, const TriMesh& face,
                            const Vec3& to_front, const RunContext& context);

}  // namespace semblance
