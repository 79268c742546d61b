// SPDX-License-Identifier: GPL-3.0-or-later
// How much of the implicit face a fit on top of a prior's face should follow: it is known near
// dowels, and at nose, mouth and eyes it is not a face.
#pragma once

#include <span>
#include <vector>

#include "fitting/problem/fit_target.h"
#include "surfaces/base/fields.h"

namespace semblance {

struct SeedTrustOptions {
  double reach_mm = 25;  // a seed weighs exp(-(d / reach)^2)
};
template <class Visitor>
void Fields(Visitor& visit, SeedTrustOptions& o) {
  visit(FieldInfo{.name = "reach_mm",
                  .unit = "mm",
                  .min = 0.1,
                  .max = 1e6,
                  .doc = "a seed at the distance d from the nearest dowel's tip has exp(-(d / "
                         "reach_mm)^2) of its weight"},
        o.reach_mm);
}

// exp(-(d / reach)^2), d the distance to the nearest tip, times 0 within the radius of a feature
// and 1 from twice that on, in proportion between. Without tips or features: 1.
double TrustAt(const Vec3& p, std::span<const Vec3> tips, std::span<const Sphere> features,
               const SeedTrustOptions& options);

// Lowers the weights of the seeds by their trust; those with less than a hundredth of it go.
void WeighSeeds(std::span<const Vec3> tips, std::span<const Sphere> features,
                const SeedTrustOptions& options, std::vector<FitPoint>& seeds);

}  // namespace semblance
