// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/prior/seed_trust.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace semblance {

double TrustAt(const Vec3& p, std::span<const Vec3> tips, std::span<const Sphere> features,
               const SeedTrustOptions& options) {
  double trust = 1;
  if (!tips.empty()) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Vec3& tip : tips) {
      nearest = std::min(nearest, (tip - p).squaredNorm());
    }
    trust = std::exp(-nearest / (options.reach_mm * options.reach_mm));
  }
  for (const Sphere& feature : features) {
    const double radii = (feature.center - p).norm() / feature.radius_mm;
    trust *= std::clamp(radii - 1, 0.0, 1.0);
  }
  return trust;
}

void WeighSeeds(std::span<const Vec3> tips, std::span<const Sphere> features,
                const SeedTrustOptions& options, std::vector<FitPoint>& seeds) {
  constexpr double kLeast = 0.01;
  std::vector<FitPoint> known;
  for (FitPoint& seed : seeds) {
    const double trust = TrustAt(seed.position, tips, features, options);
    if (trust >= kLeast) {
      seed.weight *= trust;
      known.push_back(std::move(seed));
    }
  }
  seeds = std::move(known);
}

}  // namespace semblance
