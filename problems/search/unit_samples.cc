// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/search/unit_samples.h"

#include <boost/random/sobol.hpp>

#include "surfaces/base/random.h"

namespace semblance {
namespace {

std::vector<std::vector<double>> SobolPoints(int n, int dimensions) {
  boost::random::sobol engine(dimensions);
  std::vector<std::vector<double>> points(n, std::vector<double>(dimensions));
  for (auto& point : points) {
    for (double& x : point) {
      x = static_cast<double>(engine() >> 11) * 0x1.0p-53;  // of 64 bits, as many as fit
    }
  }
  return points;
}

std::vector<std::vector<double>> LatinHypercube(int n, int dimensions, std::uint64_t random_seed) {
  Random random(random_seed);
  std::vector<std::vector<double>> points(n, std::vector<double>(dimensions));
  for (int d = 0; d < dimensions; ++d) {
    std::vector<int> slice(n);
    for (int k = 0; k < n; ++k) {
      const int other = static_cast<int>(random.Uniform() * (k + 1));
      slice[k] = slice[other];
      slice[other] = k;
    }
    for (int k = 0; k < n; ++k) {
      points[k][d] = (slice[k] + random.Uniform()) / n;
    }
  }
  return points;
}

}  // namespace

std::vector<std::vector<double>> UnitSamples(SampleMethod method, int n, int dimensions,
                                             std::uint64_t random_seed) {
  return method == SampleMethod::kSobol ? SobolPoints(n, dimensions)
                                        : LatinHypercube(n, dimensions, random_seed);
}

}  // namespace semblance
