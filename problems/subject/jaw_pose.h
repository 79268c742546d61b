// SPDX-License-Identifier: GPL-3.0-or-later
// How the lower jaw stands to the upper, told by the landmarks alone.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string_view>

#include "problems/subject/average_skull.h"

namespace semblance {

// Does the site stand on the mandible?
bool IsOfMandible(std::string_view site);

// The middles of the condyles in the average skull's frame, left and right: 11 mm below and 5 mm in
// front of supraglenoid, 10 mm towards the middle.
std::array<Vec3, 2> AverageCondyles();

struct JawPose {
  double opening_deg = kNaN;  // against the average skull's closed jaw; below 0: closed further
  double off_mm = kNaN;  // of the mandible's sites from where the cranium predicts them, median
};

// Two fits of the average skull (FitAverageSkull), one to the sites of the cranium and one to those
// of the mandible; the opening is the rotation between them about the condyles' axis. Of heads that
// bite it is within some degrees of 0. None where either has fewer than four standard sites, or
// they do not span a triangle. sites: standard ones.
std::optional<JawPose> FindJawPose(std::span<const SitePoint> sites);

}  // namespace semblance
