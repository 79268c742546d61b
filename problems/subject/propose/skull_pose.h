// SPDX-License-Identifier: GPL-3.0-or-later
// Finds the pose of one skull in the frame of another, from any start and by shape alone.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "problems/subject/propose/reference_head.h"

namespace semblance::problems {

// A point of the moved reference and the corresponding point of the skull. All NaN if none
// corresponds.
struct ShellMatch {
  Vec3 from = Vec3::Constant(kNaN);    // on the moved reference
  Vec3 to = Vec3::Constant(kNaN);      // on the skull
  Vec3 normal = Vec3::Constant(kNaN);  // the skull's normal at `to`
  double distance_mm = kNaN;
};

// One damped Gauss-Newton step that reduces the squared distances along the normals. Returns the
// motion of the moved reference. With scale_too false the scale stays 1.
Similarity StepTowards(const std::vector<ShellMatch>& matches, bool scale_too);

// Keeps, of the points that have a match, the fraction `share` with the least distances.
std::vector<ShellMatch> KeepClosest(const std::vector<ShellMatch>& matches, double share);

Similarity operator*(const Similarity& c_from_b, const Similarity& b_from_a);
Similarity Inverse(const Similarity& b_from_a);

struct SkullPose {
  Similarity skull_from_reference;
  // Mean distance, in both directions, over the 70 % of the points with the least distances. Every
  // distance counts at most 15 mm, and so does that of points that do not face alike.
  double misfit_mm = kNaN;
  // The least misfit of a pose that is turned by more than 45 degrees from this one. It is hardly
  // larger if the shape does not determine the pose.
  double rival_misfit_mm = kNaN;
};

// Says whether the search of the pose may assume an upright skull. A mesh may lie anyhow; the
// header of a CT states the axes, so its skull is upright.
enum class SkullLies { kAnyhow, kUpright };

// Finds the pose by trimmed ICP in both directions with scale. Most files lie upright, in LPS or
// RAS, so these two are tried first; if one of them fits well and much better than the other, it is
// the pose. Otherwise the search begins from 144 starts. The rotations of
// the starts are the 24 that lay principal axes on principal axes and the 24 that lay the axes of
// the files on each other; all are proper, so that sides are never exchanged. Each is shifted along
// z by 0, 35 and -35 mm, for skulls without a mandible or a vault. All starts are refined on few
// points, the best twelve on more points, and the best of these on many points until it rests. The
// reference must have z up. The scale stays within 0.7 ... 1.4. With kUpright, only LPS and RAS are
// tried: neck, masks and cropped heads make a search from all starts find worse poses.
SkullPose FindPose(const SkullShell& reference, const SkullShell& skull, int threads,
                   SkullLies lies = SkullLies::kAnyhow);

// Refines a nearly right pose by the points p, in the reference's frame, for which counts(p) is
// true.
Similarity RefinePose(const SkullShell& reference, const SkullShell& skull,
                      const Similarity& skull_from_reference,
                      const std::function<bool(const Vec3&)>& counts);

// SkullPose::misfit_mm of any pose.
double PoseMisfit_mm(const SkullShell& reference, const SkullShell& skull,
                     const Similarity& skull_from_reference);

// The fault of an unclear pose and its remedy; empty if the pose is clear.
std::string PoseFault(const SkullPose& pose);

}  // namespace semblance::problems
