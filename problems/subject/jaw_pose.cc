// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/jaw_pose.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "interp/dowels/dowel.h"
#include "surfaces/base/error.h"
#include "surfaces/base/quantile.h"

namespace semblance {
namespace {

std::vector<SitePoint> SitesOf(std::span<const SitePoint> sites, bool mandible) {
  std::vector<SitePoint> part;
  std::ranges::copy_if(sites, std::back_inserter(part),
                       [mandible](const SitePoint& s) { return IsOfMandible(s.site) == mandible; });
  return part;
}

std::optional<SkullFit> FitPart(std::span<const SitePoint> sites) try {
  constexpr std::size_t kFewest = 4;
  return sites.size() < kFewest ? std::nullopt : std::optional(FitAverageSkull(sites));
} catch (const InputError&) {  // all on a line
  return std::nullopt;
}

// About x, from y to z: of a hinge from right to left, the way in which a mouth opens.
double TurnAboutX_deg(const Mat3& r) {
  return std::atan2(r(2, 1) - r(1, 2), r(1, 1) + r(2, 2)) * 180 / std::numbers::pi;
}

}  // namespace

bool IsOfMandible(std::string_view site) {
  constexpr std::array<std::string_view, 10> kMandible = {"id", "sm",  "pg", "me", "go",
                                                          "mr", "iM2", "gn", "iC", "mmb"};
  return std::ranges::find(kMandible, WithoutSide(site)) != kMandible.end();
}

std::array<Vec3, 2> AverageCondyles() {
  const Vec3 left = AverageSite("sgl_l") + Vec3(-10, -5, -11);
  return {left, Vec3(-left.x(), left.y(), left.z())};
}

std::optional<JawPose> FindJawPose(std::span<const SitePoint> sites) {
  const std::vector<SitePoint> lower = SitesOf(sites, /*mandible=*/true);
  const auto cranium = FitPart(SitesOf(sites, /*mandible=*/false)), mandible = FitPart(lower);
  if (!cranium || !mandible) {
    return std::nullopt;
  }
  std::vector<double> off_mm;
  off_mm.reserve(lower.size());
  for (const SitePoint& s : lower) {
    off_mm.push_back((s.point - cranium->Predicted(s.site)).norm());
  }
  const Mat3 between =
      cranium->skull_from_average.rotation.transpose() * mandible->skull_from_average.rotation;
  return JawPose{.opening_deg = TurnAboutX_deg(between), .off_mm = UpperMedian(off_mm)};
}

}  // namespace semblance
