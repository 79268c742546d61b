// SPDX-License-Identifier: GPL-3.0-or-later
// Sets of scattered points on known surfaces, each with a different difficulty.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "fitting/problem/fit_target.h"
#include "tests/testing/drawn_part.h"
#include "tests/testing/scattered_data.h"

namespace semblance::testing {
using namespace problems;

struct PointSet {
  std::string name;
  Closure closure = Closure::kOpen;  // open: a height field over (u,v), with errors in z only
  double noise = 0;                  // standard deviation
  std::function<Vec3(const Vec2&)> truth;
  std::function<Vec2(Random&)> place;
  double outliers = 0;                      // share
  std::array<double, 2> gross = {-1, 1};    // range of outliers' errors in z, uniform
  std::function<bool(const Vec2&)> scored;  // region in which errors are measured
};

// Eleven octaves of gradient noise (Perlin 1985) on lattices rotated against each other.
class Fractal {
 public:
  double operator()(const Vec2& q) const {
    double z = 0;
    for (int octave = 0; octave < 11; ++octave) {
      const double f = 2 * std::exp2(octave), turn = 0.7 + 2.3 * octave;
      const double c = std::cos(turn), s = std::sin(turn);
      z += std::pow(f, -0.8) * Noise(f * (c * q.x() - s * q.y()) + 17.3 * octave,
                                     f * (s * q.x() + c * q.y()) + 5.1 * octave, octave);
    }
    return 0.3 * z;
  }

 private:
  // A value in [-1, 1) per lattice point.
  static double Hash(int i, int j, int octave, int which) {
    std::uint64_t h =
        (std::uint64_t{static_cast<std::uint32_t>(i)} << 32 | static_cast<std::uint32_t>(j)) *
            0x9E3779B97F4A7C15u +
        octave * 0xD1B54A32D192ED03u + which * 0x94D049BB133111EBu;
    h = (h ^ h >> 31) * 0xBF58476D1CE4E5B9u;
    h = (h ^ h >> 27) * 0x94D049BB133111EBu;
    return static_cast<double>((h ^ h >> 31) >> 11) * 0x1p-52 - 1;
  }
  static double Blend(double t) { return t * t * t * (t * (t * 6 - 15) + 10); }
  static double Noise(double x, double y, int octave) {
    const int i = static_cast<int>(std::floor(x)), j = static_cast<int>(std::floor(y));
    const double s = x - i, t = y - j, a = Blend(s), b = Blend(t);
    const auto corner = [&](int k, int l) {
      return Hash(i + k, j + l, octave, 0) * (s - k) + Hash(i + k, j + l, octave, 1) * (t - l);
    };
    return (1 - b) * ((1 - a) * corner(0, 0) + a * corner(1, 0)) +
           b * ((1 - a) * corner(0, 1) + a * corner(1, 1));
  }
};

// Two straight ridges and a round one between flats.
inline double Creases(const Vec2& q) {
  const auto ridge = [&](double turn, double off, double slope, double height) {
    return height - slope * std::abs(std::cos(turn) * q.x() + std::sin(turn) * q.y() - off);
  };
  return std::max({ridge(0.4, 0.55, 1, 0.12), ridge(2.1, 0.1, 1.5, 0.15), 0.0}) +
         std::max(0.0, 0.1 - 2 * std::abs((q - Vec2(0.75, 0.25)).norm() - 0.12));
}

// A closed tube with nine wavy ridges along it and four around it.
inline Vec3 RidgedTube(const Vec2& q) {
  const double turn = 2 * std::numbers::pi * q.x();
  double r = 1 + 0.08 * std::cos(3 * turn + 4 * q.y());
  for (int k = 0; k < 9; ++k) {
    const double off = q.x() - k / 9.0 - 0.2 * std::sin(3 * q.y());
    r += 0.05 * std::exp(-std::pow((off - std::round(off)) / 0.012, 2) / 2);
  }
  for (int k = 1; k < 5; ++k) {
    r += 0.04 * std::exp(-std::pow((q.y() - k / 5.0) / 0.015, 2) / 2);
  }
  return {r * std::cos(turn), r * std::sin(turn), 3 * q.y()};
}

inline double FrankeHeight(const Vec2& q) { return Franke(9 * q.x(), 9 * q.y()); }

inline double DetailHeight(const Vec2& q) {
  return FrankeHeight(q) + 0.03 * std::sin(60 * q.x()) * std::sin(60 * q.y()) *
                               std::exp(-(q - Vec2(0.3, 0.6)).squaredNorm() / (2 * 0.08 * 0.08));
}

inline double Ripples(const Vec2& q) {
  return 0.06 * std::sin(2 * std::numbers::pi *
                         (40 * (0.9 * q.x() + 0.1 * q.y()) + 0.5 * std::sin(6 * q.y())));
}

// A fifth of the domain.
inline bool InWideGap(const Vec2& q) {
  constexpr std::array<std::array<double, 3>, 6> kGaps = {{{0.3, 0.35, 0.14},
                                                           {0.75, 0.6, 0.12},
                                                           {0.45, 0.8, 0.1},
                                                           {0.85, 0.15, 0.1},
                                                           {0.1, 0.8, 0.06},
                                                           {0.62, 0.3, 0.06}}};
  return std::any_of(kGaps.begin(), kGaps.end(),
                     [&](const auto& gap) { return (q - Vec2(gap[0], gap[1])).norm() < gap[2]; });
}

inline Vec2 Anywhere(Random& random) {
  const double u = random.Uniform();
  return {u, random.Uniform()};
}

// 95 % of the points in 5 % of the domain.
inline Vec2 Crowded(Random& random) {
  const bool crowd = random.Uniform() < 0.95;
  const Vec2 q = Anywhere(random);
  return crowd ? Vec2(0.19 + 0.2236 * q.x(), 0.49 + 0.2236 * q.y()) : q;
}

inline Vec2 OutsideWideGaps(Random& random) {
  Vec2 q = Anywhere(random);
  while (InWideGap(q)) {
    q = Anywhere(random);
  }
  return q;
}

template <class Function>
std::function<Vec3(const Vec2&)> HeightField(Function height) {
  return [height](const Vec2& q) { return Vec3(q.x(), q.y(), height(q)); };
}

inline std::vector<PointSet> PointSets() {
  const auto everywhere = [](const Vec2&) { return true; };
  const auto set = [&](const char* name, double noise, std::function<Vec3(const Vec2&)> truth) {
    return PointSet{.name = name,
                    .noise = noise,
                    .truth = std::move(truth),
                    .place = Anywhere,
                    .scored = everywhere};
  };
  std::vector<PointSet> sets = {
      set("head", 1e-4, HeadPoint),
      set("franke", 1e-3, HeightField(FrankeHeight)),
      set("terrain", 0, HeightField(Fractal())),
      set("creases", 5e-4, HeightField(Creases)),
      set("tube", 1e-3, RidgedTube),
      set("crowded", 1e-3, HeightField(DetailHeight)),
      set("outliers5", 1e-3, HeightField(FrankeHeight)),
      set("outliers20", 1e-3, HeightField(FrankeHeight)),
      set("gaps", 2e-4, DrawnPoint),
      set("ripples", 5e-3, HeightField(Ripples)),
  };
  sets[0].closure = sets[4].closure = Closure::kPeriodicU;
  sets[5].place = Crowded;
  sets[6].outliers = 0.05;
  sets[7].outliers = 0.2;
  sets[7].gross = {0, 2};
  sets[8].place = OutsideWideGaps;
  sets[8].scored = [](const Vec2& q) { return !InWideGap(q); };
  return sets;
}

inline FitTarget Draw(const PointSet& set, int count, std::uint64_t random_seed) {
  Random random(random_seed);
  FitTarget target;
  for (int k = 0; k < count; ++k) {
    const Vec2 uv = set.place(random);
    Vec3 position = set.truth(uv), off(random.Normal(), random.Normal(), random.Normal());
    if (set.closure == Closure::kOpen) {
      off.head<2>().setZero();
    }
    position += set.noise * off;
    if (set.outliers > 0 && random.Uniform() < set.outliers) {
      position.z() += random.Uniform(set.gross[0], set.gross[1]);
    }
    target.points.push_back({.label = {}, .position = position, .uv = uv});
  }
  return target;
}

}  // namespace semblance::testing
