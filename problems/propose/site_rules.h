// SPDX-License-Identifier: GPL-3.0-or-later
// How each site is found on the bone once it is known about where it lies: its definition as a
// direction to go.
#pragma once

#include <string>
#include <string_view>

#include "problems/propose/skull_shell.h"

namespace semblance {

// Of the bone near the predicted point the one that lies furthest in a direction, less the square
// of its distance from the predicted point over twice the reach: a plane tilted by an angle a moves
// the site by reach * tan(a), a ridge catches it. Only bone within 1.5 reaches that faces within 72
// degrees of the bone there counts, so that it is on the same side of a thin wall. In the midline
// only bone within 1.5 mm of the sagittal plane through the predicted point counts.
struct SiteRule {
  std::string_view landmark;      // Site::landmark
  Vec3 direction = Vec3::Zero();  // in an average skull's frame (LPS, Frankfurt), on the left;
                                  // zero: the closest bone
  double reach_mm = 0;
  double inset_mm = 0;    // from the furthest point back against the direction
  std::string_view what;  // in words
};

// Throws InputError for a site that is not a standard one.
const SiteRule& RuleOf(std::string_view site);

struct SnappedSite {
  Vec3 point = Vec3::Constant(kNaN);  // on the shell
  double from_bone_mm = kNaN;         // of the predicted point
  double moved_mm = kNaN;             // from the predicted point
  double sharpness_mm = kNaN;  // rms spread of the bone that lies as far to 0.25 mm; 0 without a
                               // direction
};

// skull_from_average: rotation of an average skull's frame to the skull's.
SnappedSite SnapToBone(std::string_view site, const Vec3& predicted, const SkullShell& skull,
                       const Mat3& skull_from_average);

}  // namespace semblance
