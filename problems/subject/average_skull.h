// SPDX-License-Identifier: GPL-3.0-or-later
// Where the standard sites lie on an average skull, and how the landmarks of a subject fit it: the
// frame in which parts of a head have a name, and the measure of what cannot be right.
#pragma once

#include <array>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance {

// On bone, mm; nasion at the origin, LPS, the face looks to -y. The mean of three adults (CThead,
// Visible Human Male, Cranium: configs/landmarks/) after similarities, made symmetric. Each of the
// three lies within 8 mm of the mean of the other two. `site`: one of StandardSiteCodes().
Vec3 AverageSite(std::string_view site);

struct SitePoint {
  std::string site;  // one of StandardSiteCodes()
  Vec3 point = Vec3::Constant(kNaN);
};

struct SkullFit {
  Similarity skull_from_average;    // as it is where `mirrored` is false; else of the mirror image
  bool mirrored = false;            // of the average skull, x -> -x
  std::vector<double> residual_mm;  // one per site, in mm of an average skull
  double median_mm = kNaN;          // of those

  Vec3 Predicted(std::string_view site) const;  // where the skull is expected to have it
};

enum class Handedness { kAsIs, kMirrored };

// The similarity that the sites agree on, whatever a few of them say: the one with the least median
// residual that some three of them define (Rousseeuw 1984, all triples), then least squares with
// weights 1 / (1 + (r / 8 mm)^2) until it rests. Throws InputError if there are fewer than three
// sites, or all lie on a line.
SkullFit FitAverageSkull(std::span<const SitePoint> sites, Handedness hand = Handedness::kAsIs);

// The pose of a skull and its 32 sites: landmarks where there are, else as predicted.
struct SkullSites {
  Similarity skull_from_average;
  std::map<std::string, Vec3> points;  // one for each of StandardSiteCodes()

  Vec3 InAverage(const Vec3& point) const;  // a point of the skull's frame in the average skull's
};
SkullSites CompleteSites(std::span<const SitePoint> sites);  // throws as FitAverageSkull

}  // namespace semblance
