// SPDX-License-Identifier: GPL-3.0-or-later
// A terrain of any roughness with exact heights everywhere.
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "surfaces/base/geometry.h"
#include "surfaces/base/random.h"
#include "tests/testing/shapes.h"

namespace semblance::testing {
using namespace problems;

// Fractional Brownian motion by spectral synthesis (Voss 1985): waves in random directions, as many
// in each octave of wavelengths from two sides of the unit square down to 1/512 of one, with
// amplitudes that grow with the wavelength to the power `hurst`; rms height about 0.1.
class Terrain {
 public:
  explicit Terrain(std::uint64_t random_seed, double hurst = 0.8) {
    Random random(random_seed);
    double squares = 0;
    for (int k = 0; k < kWaves; ++k) {
      const double frequency = std::exp2(-1 + 10 * (k + random.Uniform(0, 1)) / kWaves);
      const double angle = random.Uniform(0, 2 * std::numbers::pi);
      waves_.push_back({2 * std::numbers::pi * frequency * Vec2(std::cos(angle), std::sin(angle)),
                        random.Uniform(0, 2 * std::numbers::pi), std::pow(frequency, -hurst)});
      squares += waves_.back().height * waves_.back().height / 2;
    }
    for (Wave& wave : waves_) {
      wave.height *= 0.1 / std::sqrt(squares);
    }
  }

  Vec3 operator()(const Vec2& uv) const {
    double z = 0;
    for (const Wave& wave : waves_) {
      z += wave.height * std::cos(wave.frequency.dot(uv) + wave.phase);
    }
    return {uv.x(), uv.y(), z};
  }

 private:
  static constexpr int kWaves = 2000;
  struct Wave {
    Vec2 frequency;
    double phase, height;
  };
  std::vector<Wave> waves_;
};

}  // namespace semblance::testing
