// SPDX-License-Identifier: GPL-3.0-or-later
// The planes in which reports show a head in section.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "problems/subject/landmarks.h"
#include "surfaces/mesh/plane_section.h"

namespace semblance::problems {

// The names of the planes, for files, and their titles for people.
inline constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kHeadPlaneTitles = {
    {{"sagittal_n", "Sagittal, through nasion"},
     {"axial_n", "Axial, at nasion"},
     {"axial_mp", "Axial, at the mid-philtrum"},
     {"coronal_zy", "Coronal, at the zygomatic arches"}}};

struct HeadPlane {
  std::string name;  // as in kHeadPlaneTitles
  PicturePlane plane;
  // The sides of the picture, e.g. "front" and "back".
  std::string_view left, right;
};

// The sagittal plane through nasion, the axial planes at nasion (n) and at the mid-philtrum (mp),
// and the coronal plane midway between both zygomatic arches (zy). Their axes are those of the
// average skull that was fitted to the landmarks, so a head that lies askew in its scan is cut
// straight. A site that is no landmark is predicted. The subject's right is on the left of axial
// and coronal pictures, the front on the left of the sagittal one. Empty if the standard sites
// among the landmarks are fewer than three or on one line.
std::vector<HeadPlane> HeadPlanes(std::span<const SitePoint> landmarks);

}  // namespace semblance::problems
