// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/phantom_relief.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace semblance {
namespace {

// Where three measured heads have much tissue or little, as far as their variogram lets it be.
const BumpOnSkull kBumps[] = {
    {{36, 26, -62}, {12.7, 28.3, 12.7}, -8},  // between cheek bone and jaw
    {{52, 58, -60}, {28.3, 12.7, 14.1}, -3},  // masseteric fossa
    {{36, 34, -92}, {12.7, 21.2, 8.5}, -3},   // beside the lower teeth
    {{28, 10, -44}, {7.8, 21.2, 7.1}, -3},    // canine fossa
    {{34, 10, -9}, {12, 21.2, 10.6}, 4, 2},   // orbit, filled as the shell of a head fills it
    {{0, -4, -42}, {7.8, 21.2, 9.2}, -4, 2},  // nasal opening
    {{0, -5, -64}, {15.6, 21.2, 8.5}, -3},    // over the upper teeth
    {{0, -1, -96}, {15.6, 21.2, 5.7}, -3},    // between teeth and chin
    {{60, 44, 6}, {28.3, 12.7, 12.7}, -3},    // temporal fossa
    {{28, 28, -118}, {17, 17, 7.1}, -3},      // below the jaw
    {{50, 70, -90}, {28.3, 9.9, 9.9}, -3},    // behind the angle of the jaw
    {{0, -10, -21}, {6.4, 21.2, 7.1}, 2},     // nasal bones
    {{66, 58, -26}, {28.3, 18.4, 4.9}, 2},    // zygomatic arch
    {{48, 20, -32}, {7.8, 14.1, 5.7}, 2},     // cheek bone
};
// As a part of the tissue: on heads the bone is rough where tissue is thick, and not under a scalp.
constexpr RoughnessOptions kRoughness{
    .sd = 0.26, .length_mm = 20, .shortest_mm = 12, .radius_mm = 90};

// x where the integral of sin^2 from 0 to x is `share` of that to `end`.
double SineSquareQuantile(double share, double end) {
  const auto integral = [](double x) { return x - std::sin(x) * std::cos(x); };
  double low = 0, high = end;
  for (int i = 0; i < 50; ++i) {
    const double middle = (low + high) / 2;
    (integral(middle) < share * integral(end) ? low : high) = middle;
  }
  return (low + high) / 2;
}

}  // namespace

// In space the spectrum of exp(-r / length) falls as 1 / (1 + (k length)^2)^2, and at the wave
// number k = tan(x) / length there are waves in proportion to sin^2 x.
WaveSum DrawRoughness(const RoughnessOptions& options, Random& random) {
  constexpr int kWaves = 160;
  const double end = std::atan(2 * std::numbers::pi / options.shortest_mm * options.length_mm);
  WaveSum sum;
  for (int i = 0; i < kWaves; ++i) {
    const double angle = SineSquareQuantile((i + random.Uniform()) / kWaves, end);
    const Vec3 direction = random.Direction();
    const double wave_number = std::tan(angle) / options.length_mm * options.radius_mm;
    const double phase = random.Uniform(0, 2 * std::numbers::pi);
    sum.waves.push_back({wave_number * direction, phase, options.sd * std::sqrt(2.0 / kWaves)});
  }
  return sum;
}

PhantomRelief::PhantomRelief(Random& random)
    : weight_(std::clamp(1 + 0.12 * random.BoundedNormal(), 0.76, 1.24)),
      bumps_(DrawBumps(kBumps, {.height = 0.25, .side = 0.1}, random)),
      roughness_(DrawRoughness(kRoughness, random)) {}

double PhantomRelief::Height(const Vec3& direction) const {
  double height_mm = 0;
  for (const PhantomBump& bump : bumps_) {
    height_mm += bump.Value(direction);
  }
  return height_mm;
}

// Beyond its mean the roughness acts linearly, that no tissue grows out of all bounds; the least
// thickness is neared smoothly, so that prominences are rounded off and not cut.
double PhantomRelief::Thickness(const Vec3& direction, double smooth_mm) const {
  constexpr double kLeast_mm = 2, kRounding_mm = 1;
  const double tissue_mm = std::max(0.0, smooth_mm - Height(direction));
  const double rough = roughness_.Value(direction);
  const double factor = weight_ * (rough < 0 ? std::exp(rough) : 1 + rough);
  const double above = (factor * tissue_mm - kLeast_mm) / kRounding_mm;
  const double rounded = above > 30 ? above : std::log1p(std::exp(above));
  return kLeast_mm + kRounding_mm * rounded;
}

}  // namespace semblance
