// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/head_planes.h"

#include <algorithm>
#include <iterator>
#include <optional>

#include "problems/subject/average_skull.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

std::optional<SkullSites> FindSites(std::span<const SitePoint> landmarks) {
  constexpr std::size_t kFewest = 3;
  std::vector<SitePoint> standard;
  std::ranges::copy_if(landmarks, std::back_inserter(standard), IsStandardSite, &SitePoint::site);
  if (standard.size() < kFewest) {
    return std::nullopt;
  }
  try {
    return CompleteSites(standard);
  } catch (const InputError&) {  // on one line
    return std::nullopt;
  }
}

}  // namespace

std::vector<HeadPlane> HeadPlanes(std::span<const SitePoint> landmarks) {
  const std::optional<SkullSites> sites = FindSites(landmarks);
  if (!sites) {
    return {};
  }
  const Mat3& axes = sites->skull_from_average.rotation;
  const Vec3 left = axes.col(0), back = axes.col(1), up = axes.col(2);
  const auto at = [&](const char* site) { return sites->points.at(site); };
  return {{"sagittal_n", {at("n"), back, up}, "front", "back"},
          {"axial_n", {at("n"), left, -back}, "right", "left"},
          {"axial_mp", {at("mp"), left, -back}, "right", "left"},
          {"coronal_zy", {(at("zy_l") + at("zy_r")) / 2, left, up}, "right", "left"}};
}

}  // namespace semblance::problems
