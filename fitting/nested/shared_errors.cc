// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/shared_errors.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fitting/nested/error_structure.h"
#include "surfaces/base/quantile.h"

namespace semblance::fitting {

double RoundingNoiseSquare(const NestedPoints& points) {
  constexpr double kAlongZ = 0.999;
  const bool is_rounded = points.lattice_mm > 0 && points.channels == 1 && !points.weighted &&
                          std::abs(points.axes(2, 0)) > kAlongZ && !LieAlongLines(points);
  return is_rounded ? points.lattice_mm * points.lattice_mm / 12 : 0;
}

double MeanSquareBeyondRounding(NestedSolve& solve, const NestedPoints& points,
                                const std::vector<char>& outlier) {
  const double half_mm = points.lattice_mm / 2;
  double sum = 0;
  std::size_t count = 0;
  NestedResiduals(solve).ForEach([&](std::size_t k, const NestedResidual& residual) {
    if (outlier[k] == 0) {
      const double beyond = std::max(std::sqrt(residual.Square()) - half_mm, 0.0);
      sum += beyond * beyond;
      ++count;
    }
  });
  return sum / static_cast<double>(std::max<std::size_t>(count, 1));
}

double MostSharedSquare(const NestedPoints& points, const std::vector<char>& outlier) {
  constexpr double kMostShare = 0.0225;  // a seventh of the heights
  Vec3 sum = Vec3::Zero(), squares = Vec3::Zero();
  double count = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (outlier[k] == 0) {
      sum += points.value[k];
      squares += points.value[k].cwiseAbs2();
      ++count;
    }
  }
  return kMostShare * (squares / count - (sum / count).cwiseAbs2()).sum() / points.channels;
}

bool AreAlikeEverywhere(NestedSolve& solve, const NestedPoints& points,
                        const std::vector<char>& outlier) {
  constexpr std::size_t kRun = 256, kFewestRuns = 8;  // of fewer the median tells little
  // Errors correlated over a fiftieth of the domain gave 0.9 to 1, detail in a tenth of the domain
  // 0.24.
  constexpr double kLeast = 0.6;
  std::vector<double> squares;
  double sum = 0, all = 0;
  std::size_t count = 0;
  NestedResiduals(solve).ForEach([&](std::size_t k, const NestedResidual& residual) {
    if (outlier[k] == 0) {
      sum += ScaledResidual(points, k, residual).Square();
      if (++count % kRun == 0) {
        squares.push_back(sum);
        all += std::exchange(sum, 0);
      }
    }
  });
  const auto runs = static_cast<double>(squares.size());
  return squares.size() >= kFewestRuns && UpperMedian(squares) > kLeast * all / runs;
}

}  // namespace semblance::fitting
