// SPDX-License-Identifier: GPL-3.0-or-later
// A dowel (a depth marker; thesis def. 2.1): a base on the bone, a direction out of the bone, and
// the depth of the tissue along it. Also the meaning of its site code.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "surfaces/base/geometry.h"
#include "surfaces/base/point_role.h"

namespace semblance::interp {

struct Dowel {
  std::string site;                       // landmark code with side, e.g. "g", "go_l", "go_r"
  Vec3 base = Vec3::Constant(kNaN);       // on the skull, mm
  Vec3 direction = Vec3::Constant(kNaN);  // unit, out of the bone
  double depth_mm = kNaN;                 // tissue depth, > 0
  double sd_mm = kNaN;                    // standard deviation of depth_mm, or NaN if unknown
  PointRole role = PointRole::kLandmark;

  Vec3 Tip() const { return base + depth_mm * direction; }
};

// The subject's side. Codes without a side count as kMidline.
enum class Side : std::uint8_t { kMidline, kLeft, kRight };

// The side of a site code: kLeft for "go_l" (the gonion on the subject's left), kRight for "go_r",
// otherwise kMidline.
Side SideOfSite(std::string_view site);

// The site code without its side: "go" for "go_l", "go_r" and "go".
std::string WithoutSide(std::string_view site);

}  // namespace semblance::interp
