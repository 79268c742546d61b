// SPDX-License-Identifier: GPL-3.0-or-later
// The standard sites on an average skull, and the fit of a subject's landmarks to it. The average
// skull's frame names the parts of a head; the misfit reveals landmarks that cannot be right.
#pragma once

#include <array>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "problems/subject/landmarks.h"
#include "surfaces/base/geometry.h"

namespace semblance::problems {

// The point of a standard site on the average skull's bone, in mm. Nasion is the origin, the axes
// are LPS, the face looks to -y. The points are the mean of three adults (CThead, Visible Human
// Male, Cranium: configs/landmarks/) aligned by similarities, made symmetric. Each of the three
// lies within 8 mm of the mean of the other two. Throws InputError for a site that is not standard.
Vec3 AverageSite(std::string_view site);

// The unit direction out of the bone at that site. Throws as AverageSite.
Vec3 AverageDirection(std::string_view site);

struct SkullFit {
  Similarity skull_from_average;  // if `mirrored`, from the average skull's mirror image, x -> -x
  bool mirrored = false;
  std::vector<double> residual_mm;  // one per site, in mm of an average skull
  double median_mm = kNaN;          // median residual

  Vec3 Predicted(std::string_view site) const;  // expected point of the site on the skull
};

enum class Handedness { kAsIs, kMirrored };

// Fits the average skull to standard sites by a similarity that a few wrong sites cannot spoil.
// Starts from the similarity with the least median residual among those that three of the sites
// define (least median of squares, Rousseeuw 1984, all triples). Then repeats least squares with
// weights 1 / (1 + (r / 8 mm)^2) until the cost is stationary. Throws InputError if there are fewer
// than three sites, or if all lie on a line.
SkullFit FitAverageSkull(std::span<const SitePoint> sites, Handedness hand = Handedness::kAsIs);

// The axes that a skull's pose suggests: its rotation is within 60 degrees of that of a head in
// LPS, or in RAS, or neither. The limit lies between a tilted head and exchanged axes, which are 90
// apart.
enum class PoseAxes { kLps, kRas, kNeither };
PoseAxes FindPoseAxes(const Mat3& skull_from_average);

// The pose of a skull and its 32 standard sites. A site without a landmark is predicted.
struct SkullSites {
  Similarity skull_from_average;
  std::map<std::string, Vec3> points;  // one for each of StandardSiteCodes()

  Vec3 InAverage(
      const Vec3& point) const;  // converts from the skull's to the average skull's frame
};
// Throws as FitAverageSkull.
SkullSites CompleteSites(std::span<const SitePoint> sites);

}  // namespace semblance::problems
