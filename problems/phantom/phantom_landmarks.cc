// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/phantom/phantom_landmarks.h"

#include <fmt/format.h>

namespace semblance {

LandmarkFile PhantomLandmarks(const Phantom& phantom, std::uint64_t random_seed) {
  LandmarkFile file;
  file.subject = fmt::format("phantom {}", random_seed);
  for (const PhantomSite& site : phantom.sites) {
    Landmark landmark;
    landmark.site = site.site;
    landmark.point = {site.base.x(), site.base.y(), site.base.z()};
    landmark.normal = {site.normal.x(), site.normal.y(), site.normal.z()};
    landmark.depth_along_normal_mm = site.depth_mm;
    file.landmarks.push_back(landmark);
  }
  return file;
}

}  // namespace semblance
