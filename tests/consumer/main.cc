// SPDX-License-Identifier: GPL-3.0-or-later
// A surface through scattered points, with the installed package alone: `app < points.txt`.
#include <semblance/fitting/fit.h>
#include <semblance/fitting/parameters/parametrise.h>
#include <semblance/fitting/problem/start_surface.h>

#include <iostream>
#include <vector>

using namespace semblance::fitting;

int main() {
  std::vector<Vec3> points;
  for (double x, y, z; std::cin >> x >> y >> z;) points.emplace_back(x, y, z);
  const std::vector<Vec2> uv = Parametrise(points).uv;
  const HSplineSurface start =
      StartSurface({.patches_u = 8, .patches_v = 8, .max_level = 3}, points, uv);
  const FitOptions options{.plan = AdaptivePlan{.tolerance_mm = 0.01, .finest = 3},
                           .terms = {PointTerm{}, SmoothnessTerm{.weight = 1e-6}}};
  const FitResult fit = Fit(start, MakeFitTarget(points, uv), {}, options, {});
  std::cout << "rms " << fit.point_rms_mm << " mm, centre "
            << fit.surface.Point({0.5, 0.5}).transpose() << '\n';
  return fit.usable ? 0 : 1;
}
