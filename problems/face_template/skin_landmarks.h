// SPDX-License-Identifier: GPL-3.0-or-later
// Named points on the skin of a head, from files.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance {

struct SkinLandmark {
  std::string code;  // of a standard site, or of FacialLandmarks() (template_sites.h)
  Vec3 point = Vec3::Constant(kNaN);  // mm, in the frame of the head
};

struct SkinLandmarks {
  std::vector<SkinLandmark> points;  // each code once, in the order of the files
  std::vector<std::string> notes;    // which landmarks were left out, and why
};

// All landmarks of some files, each in one of three forms, told by its ending and columns:
//   .csv with columns site,x,y,z (or x_mm,y_mm,z_mm), others ignored: points on the skin, mm;
//   .csv with columns i_multipie,x,y,z: the 68 points of Multi-PIE (Gross et al. 2010) by number, 1
//     to 68, of which those are used that FacialLandmarks() knows;
//   any other ending that ReadLandmarks (read_landmarks.h) takes, the landmarks of a skull: point +
//     depth * normal, by the depth along the normal, else by the closest depth; those without a
//     depth or a normal are left out. Where no landmark of the file has a depth, its points are
//     taken to lie on the skin.
// Throws IoError, ConfigError or InputError as the readers do; InputError for a code that stands
// twice, or no landmark at all.
SkinLandmarks ReadSkinLandmarks(std::span<const std::filesystem::path> files);

}  // namespace semblance
