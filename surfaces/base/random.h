// SPDX-License-Identifier: GPL-3.0-or-later
// Random draws from a seed, the same on every machine and with every compiler.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance::surfaces {

// The C++ standard fixes the bits of the 64-bit Mersenne Twister, but not the results of its
// distributions. Hence the draws are computed here. Each comment ends with the number of 64-bit
// words that a draw consumes.
class Random {
 public:
  explicit Random(std::uint64_t random_seed) : engine_(random_seed) {}

  // In [0, 1), a multiple of 2^-53. One.
  double Uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  // In [low, high). One.
  double Uniform(double low, double high) { return low + (high - low) * Uniform(); }
  // Each coordinate in [low, high). Three.
  Vec3 InBox(double low, double high) {
    return {Uniform(low, high), Uniform(low, high), Uniform(low, high)};
  }
  // -1 or 1. One.
  double Sign() { return (engine_() >> 63) != 0 ? 1 : -1; }
  // 0 .. count - 1; count >= 1. One.
  std::size_t Index(std::size_t count) { return engine_() % count; }

  // Mean 0, variance 1 (Box & Muller 1958). Two.
  double Normal() {
    const double r = std::sqrt(-2 * std::log(1 - Uniform()));
    return r * std::cos(2 * std::numbers::pi * Uniform());
  }
  // Nearly normal with mean 0 and variance 1, within -6..6: the sum of twelve uniform draws minus
  // 6. Twelve.
  double BoundedNormal() {
    double sum = -6;
    for (int i = 0; i < 12; ++i) {
      sum += Uniform();
    }
    return sum;
  }
  // A unit vector, uniform over the sphere (Archimedes' hat box). Two.
  Vec3 Direction() {
    const double z = Uniform(-1, 1);
    const double azimuth = Uniform(0, 2 * std::numbers::pi);
    const double s = std::sqrt(1 - z * z);
    return {s * std::cos(azimuth), s * std::sin(azimuth), z};
  }

  // Shuffles the values (Fisher & Yates). One per value except the first.
  template <class Value>
  void Shuffle(std::vector<Value>& values) {
    for (std::size_t k = values.size(); k > 1; --k) {
      std::swap(values[k - 1], values[(engine_() >> 11) % k]);
    }
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace semblance::surfaces
