// SPDX-License-Identifier: GPL-3.0-or-later
// Rules that find the exact point of a site on the bone near its predicted point. A rule states the
// definition of the site as a direction.
#pragma once

#include <string>
#include <string_view>

#include "problems/subject/propose/reference_head.h"

namespace semblance::problems {

// Chooses the point p of bone that maximises d . direction - |d|^2 / (2 reach), where d is p minus
// the predicted point. On a plane tilted by an angle a, the site moves by reach * tan(a); a ridge
// stops it. Only bone within 1.5 reaches counts that faces within 72 degrees of the bone at the
// predicted point, so that the point stays on the same side of a thin wall. In the midline, only
// bone within 1.5 mm of the sagittal plane through the predicted point counts.
struct SiteRule {
  std::string_view landmark;      // Site::landmark
  Vec3 direction = Vec3::Zero();  // in the average skull's frame (LPS, Frankfurt), for the left
                                  // site; zero: the closest bone
  double reach_mm = 0;
  double inset_mm = 0;    // distance from the chosen point back against the direction
  std::string_view what;  // the rule in words
};

// Throws InputError for a site that is not a standard one.
const SiteRule& FindSiteRule(std::string_view site);

struct SnappedSite {
  Vec3 point = Vec3::Constant(kNaN);  // on the shell
  double from_bone_mm = kNaN;         // distance of the predicted point from bone
  double moved_mm = kNaN;             // distance of `point` from the predicted point
  double sharpness_mm = kNaN;  // rms distance from the extremum of bone that is within 0.25 mm as
                               // far in the direction; 0 without a direction
};

// Applies the rule of a site. `skull_from_average` rotates the average skull's frame to the
// skull's.
SnappedSite SnapToBone(std::string_view site, const Vec3& predicted, const SkullShell& skull,
                       const Mat3& skull_from_average);

}  // namespace semblance::problems
