// SPDX-License-Identifier: GPL-3.0-or-later
// A peer of the fit: multilevel B-spline approximation (Lee, Wolberg & Shin, "Scattered data
// interpolation with multilevel B-splines", IEEE TVCG 3(3), 1997), written from the paper and
// sharing no code with ours. Dense, uniform, no solve.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace semblance::bench {
using namespace problems;

struct HeightPoint {
  double u = 0, v = 0, z = 0;  // u and v in [0,1]
};

class MultilevelBSpline {
 public:
  // Lattices of 1, 2, 4 .. 2^(levels - 1) patches a side, each fitted to what the coarser leave.
  MultilevelBSpline(std::vector<HeightPoint> points, int levels) {
    for (int level = 0; level < levels; ++level) {
      lattices_.push_back(Approximate(points, 1 << level));
      for (HeightPoint& p : points) {
        p.z -= Height(lattices_.back(), p.u, p.v);
      }
    }
  }

  double Height(double u, double v) const {
    double z = 0;
    for (const Lattice& lattice : lattices_) {
      z += Height(lattice, u, v);
    }
    return z;
  }

 private:
  struct Lattice {
    int patches;
    std::vector<double> values;  // (patches + 3) a side
  };
  struct Place {
    int first;  // of four
    std::array<double, 4> weights;
  };

  static Place PlaceOf(int patches, double x) {
    const int first = std::clamp(static_cast<int>(x * patches), 0, patches - 1);
    const double t = x * patches - first, s = 1 - t;
    return {first,
            {s * s * s / 6, (3 * t * t * t - 6 * t * t + 4) / 6,
             (-3 * t * t * t + 3 * t * t + 3 * t + 1) / 6, t * t * t / 6}};
  }

  template <class Visit>
  static void ForEach(int patches, double u, double v, const Visit& visit) {
    const Place a = PlaceOf(patches, u), b = PlaceOf(patches, v);
    for (int k = 0; k < 16; ++k) {
      visit((a.first + k % 4) + (patches + 3) * (b.first + k / 4),
            a.weights[k % 4] * b.weights[k / 4]);
    }
  }

  static double Height(const Lattice& lattice, double u, double v) {
    double z = 0;
    ForEach(lattice.patches, u, v, [&](int at, double w) { z += w * lattice.values[at]; });
    return z;
  }

  // The paper's BA algorithm: each point's own least-norm lattice, averaged by squared weights.
  static Lattice Approximate(const std::vector<HeightPoint>& points, int patches) {
    const auto side = static_cast<std::size_t>(patches) + 3;
    std::vector<double> sum(side * side, 0), weight(side * side, 0);
    for (const HeightPoint& p : points) {
      double squares = 0;
      ForEach(patches, p.u, p.v, [&](int, double w) { squares += w * w; });
      ForEach(patches, p.u, p.v, [&](int at, double w) {
        sum[at] += w * w * (w * p.z / squares);
        weight[at] += w * w;
      });
    }
    for (std::size_t k = 0; k < sum.size(); ++k) {
      sum[k] = weight[k] > 0 ? sum[k] / weight[k] : 0;
    }
    return {patches, std::move(sum)};
  }

  std::vector<Lattice> lattices_;
};

}  // namespace semblance::bench
