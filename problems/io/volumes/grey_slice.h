// SPDX-License-Identifier: GPL-3.0-or-later
// The grey values of a CT in a plane.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "problems/io/volumes/ct_volume.h"
#include "surfaces/mesh/plane_section.h"

namespace semblance::problems {

struct GreySlice {
  std::string name;                     // of the plane
  Vec2 low_mm = Vec2::Zero();           // lower left corner in the plane's picture
  double pixel_mm = kNaN;               // side of a pixel
  int width = 0, height = 0;            // pixels
  std::vector<std::uint8_t> grey = {};  // brightness, row by row from the top left
};

// The brightness, 0..1, with which a CT value is shown: from air to dense bone, brighter in the
// range of soft tissue.
double CtBrightness(double hu);

// The slice of the volume in a plane, as large as the volume's extent there, each pixel by
// trilinear interpolation. A pixel outside the volume is black. pixel_mm > 0.
GreySlice SampleSlice(const CtVolume& volume, const PicturePlane& plane, std::string name,
                      double pixel_mm);

}  // namespace semblance::problems
