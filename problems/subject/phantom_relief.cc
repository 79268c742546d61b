// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/phantom_relief.h"

#include <cmath>
#include <numbers>

namespace semblance {
namespace {

const BumpOnSkull kHollows[] = {
    {{0, -4, -44}, {9, 20, 11}, 4},      // nasal opening
    {{0, -2, -97}, {16, 20, 7}, 1},      // between teeth and chin
    {{33, 10, -13}, {11, 15, 10}, 5},    // orbit
    {{26, 4, -48}, {8, 15, 8}, 2},       // canine fossa
    {{57, 38, 6}, {16, 16, 15}, 3},      // temporal fossa
    {{44, 36, -62}, {14, 22, 17}, 5},    // under the cheek bone, beside the teeth
    {{52, 60, -58}, {12, 16, 16}, 2.5},  // masseteric fossa
    {{26, 22, -116}, {18, 18, 8}, 2},    // under the jaw
};

// Waves whose sum has about the covariance exp(-r / length) of a rough field (a Cauchy distribution
// of wave vectors), without those shorter than the mesh can show.
WaveSum DrawRough(Random& random) {
  constexpr int kWaves = 400;
  constexpr double kLength_mm = 20, kShortest_mm = 12, kRadius_mm = 85;  // of the bone
  WaveSum sum;
  while (sum.waves.size() < kWaves) {
    const Vec3 normal(random.Normal(), random.Normal(), random.Normal());
    const double spread = std::abs(random.Normal());
    const Vec3 per_mm = normal / (spread * kLength_mm);
    const double phase = random.Uniform(0, 2 * std::numbers::pi);
    if (per_mm.norm() * kShortest_mm < 2 * std::numbers::pi) {
      sum.waves.push_back({kRadius_mm * per_mm, phase, std::sqrt(2.0 / kWaves)});
    }
  }
  return sum;
}

}  // namespace

PhantomRelief::PhantomRelief(Random& random)
    : hollows_(DrawBumps(kHollows, {.height = 0.3, .side = 0.1}, random)),
      rough_(DrawRough(random)) {}

double PhantomRelief::Depth(const Vec3& direction, double smooth_depth_mm) const {
  constexpr double kRoughness = 0.45, kThick_mm = 12;  // standard deviation of the logarithm
  double depth = smooth_depth_mm;
  for (const PhantomBump& hollow : hollows_) {
    depth += hollow.Value(direction);
  }
  const double roughness = kRoughness / (1 + depth / kThick_mm);
  return depth * std::exp(roughness * rough_.Value(direction));
}

}  // namespace semblance
