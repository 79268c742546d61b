// SPDX-License-Identifier: GPL-3.0-or-later
// Named points on the skin of a head, from files.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance::problems {

struct SkinLandmark {
  std::string code;  // of a standard site, or of FacialLandmarks() (head_formula.h)
  Vec3 point = Vec3::Constant(kNaN);  // mm, in the frame of the head
};

struct SkinLandmarks {
  std::vector<SkinLandmark> points;  // each code once, in the order of the files
  std::vector<std::string> notes;    // the landmarks that were left out, and the reasons
};

// Reads all landmarks of some files. Each file has one of three forms, which its ending and columns
// distinguish:
//   .csv with columns site,x,y,z (or x_mm,y_mm,z_mm), others ignored: points on the skin, mm;
//   .csv with columns i_multipie,x,y,z: the points of Multi-PIE (Gross et al. 2010) by number, 1 to
//     68. The points that FacialLandmarks() contains are used;
//   any other ending that ReadLandmarks (read_landmarks.h) accepts: the landmarks of a skull. The
//     skin point is point + depth * normal, with the depth along the normal, else the closest
//     depth. A landmark without depth or normal is left out. If no landmark of the file has a
//     depth, its points are taken to lie on the skin.
// Throws IoError, ConfigError or InputError as the readers do, and InputError for a code that
// appears twice or if there is no landmark at all.
SkinLandmarks ReadSkinLandmarks(std::span<const std::filesystem::path> files);

}  // namespace semblance::problems
