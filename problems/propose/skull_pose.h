// SPDX-License-Identifier: GPL-3.0-or-later
// How one skull lies in the frame of another: from any pose, by shape alone.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "problems/propose/skull_shell.h"

namespace semblance {

// A point of the moved reference and the point of the skull that corresponds to it. All NaN if none
// does.
struct ShellMatch {
  Vec3 from = Vec3::Constant(kNaN);    // of the moved reference
  Vec3 to = Vec3::Constant(kNaN);      // of the skull
  Vec3 normal = Vec3::Constant(kNaN);  // of the skull there
  double distance_mm = kNaN;
};

// One damped Gauss-Newton step towards least squared distances along the normals: the motion, of
// the moved reference, that makes them least. With scale_too false the scale stays 1.
Similarity StepTowards(const std::vector<ShellMatch>& matches, bool scale_too);

// The `share` with the least distances of the points that have a match.
std::vector<ShellMatch> KeepClosest(const std::vector<ShellMatch>& matches, double share);

Similarity operator*(const Similarity& c_from_b, const Similarity& b_from_a);
Similarity Inverse(const Similarity& b_from_a);

struct SkullPose {
  Similarity skull_from_reference;
  // Mean distance both ways of the 70 % of the points with the least; of points that do not face
  // alike, and at most: 15 mm.
  double misfit_mm = kNaN;
  // The least of poses that are turned by more than 45 degrees from it: hardly more where the shape
  // does not say how it lies.
  double rival_misfit_mm = kNaN;
};

// Starts from the 24 ways to lay principal axes on principal axes and the 24 ways to lay the axes
// of the files on each other (proper rotations only, so that sides are never exchanged), each
// shifted up and down by 0 and 35 mm for skulls without a mandible or a vault. All are refined by
// trimmed ICP both ways with scale; the best twelve further, the best of them to
// the end.
// reference: z up. Scale stays within 0.7 ... 1.4.
SkullPose FindPose(const SkullShell& reference, const SkullShell& skull, int threads);

// A pose that is nearly right, refined by the points where counts(p) is true, p in the reference's
// frame.
Similarity RefinePose(const SkullShell& reference, const SkullShell& skull,
                      const Similarity& skull_from_reference,
                      const std::function<bool(const Vec3&)>& counts);

// "" if the pose says how the skull lies; else what is wrong, and what to do.
std::string ComplaintAbout(const SkullPose& pose);

}  // namespace semblance
