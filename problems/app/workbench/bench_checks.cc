// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/workbench/bench_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "problems/subject/average_skull.h"
#include "problems/subject/landmark_mistakes.h"
#include "problems/subject/mirror.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

std::vector<SitePoint> StandardSites(const LandmarkFile& file) {
  std::vector<SitePoint> sites;
  for (const Landmark& l : file.landmarks) {
    if (IsStandardSite(l.site)) {
      sites.push_back({l.site, l.Position()});
    }
  }
  return sites;
}

// Return none if there are too few sites or all lie on a line.
std::optional<SkullFit> TryFitAverageSkull(std::span<const SitePoint> sites) {
  try {
    return FitAverageSkull(sites);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

std::optional<MidPlane> TryFitMidPlane(std::span<const SitePoint> sites) {
  try {
    return FitMidPlane(sites);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

void MeasureMirrors(std::span<const SitePoint> sites, const MidPlane& plane,
                    LandmarkChecks& checks) {
  for (const SitePoint& site : sites) {
    const auto partner = std::ranges::find(sites, MirroredSite(site.site), &SitePoint::site);
    if (partner != sites.end()) {
      const double apart = (plane.Mirrored(partner->point) - site.point).norm();
      checks.sites[site.site].from_mirror_mm = partner->site == site.site ? apart / 2 : apart;
    }
  }
}

void Predict(const SkullFit& fit, std::span<const SitePoint> sites, const SuggestedBone& bone,
             LandmarkChecks& checks) {
  for (std::size_t k = 0; k < sites.size(); ++k) {
    checks.sites[sites[k].site].from_predicted_mm = fit.residual_mm[k];
  }
  for (const std::string& site : StandardSiteCodes()) {
    if (checks.sites.contains(site)) {
      continue;
    }
    const Vec3 outward = fit.skull_from_average.rotation * AverageDirection(site);
    if (const auto point = FindOuterPoint(fit.Predicted(site), outward, bone)) {
      checks.predicted[site] = *point;
    }
  }
}

}  // namespace

LandmarkChecks CheckLandmarks(const LandmarkFile& file, const SuggestedBone& bone,
                              const PlaceOptions& options) {
  LandmarkChecks checks;
  for (const Landmark& l : file.landmarks) {
    checks.sites[l.site].from_bone_mm = bone.query.Closest(l.Position()).distance_mm;
  }
  const std::vector<SitePoint> sites = StandardSites(file);
  if (const auto fit = TryFitAverageSkull(sites)) {
    Predict(*fit, sites, bone, checks);
  }
  if (const auto plane = TryFitMidPlane(sites)) {
    MeasureMirrors(sites, *plane, checks);
  }
  if (!file.landmarks.empty()) {
    InputMistakes found = FindLandmarkMistakes(file, bone.mesh, bone.query, options);
    checks.errors = std::move(found.errors);
    checks.notes = std::move(found.notes);
  }
  return checks;
}

}  // namespace semblance::problems
