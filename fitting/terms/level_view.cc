// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/terms/level_view.h"

#include <fmt/format.h>

#include "surfaces/base/error.h"

namespace semblance {

double LevelView::WeightSum() const {
  double sum = 0;
  for (const Observation& o : observations) {
    sum += o.weight;
  }
  return sum;
}

double LevelView::LandmarkWeightSum() const {
  double sum = 0;
  for (const Observation& o : observations) {
    sum += o.landmark ? o.weight : 0;
  }
  return sum;
}

LevelView ViewOfLevel(const HSplineSurface& surface, const HSplineSurface& rest,
                      const FitTarget& target, int level) {
  const HSplineShape& shape = surface.shape();
  if (level < 0 || level > shape.max_level || !(shape == rest.shape())) {
    throw InputError(fmt::format(
        "uncertainty: level {} of a surface with levels 0..{}; give one of them, and a template of "
        "the same shape",
        level, shape.max_level));
  }
  CheckTarget(target);
  const bool periodic = shape.closure == Closure::kPeriodicU;
  LevelView view{
      .grid = {.patches_u = shape.PatchesU(level),
               .patches_v = shape.PatchesV(level),
               .periodic_u = periodic},
      .start = surface.Net(level),
      .rest = rest.Net(level),
      .lengths_mm = MeanLengths(
          {.patches_u = shape.patches_u, .patches_v = shape.patches_v, .periodic_u = periodic},
          rest.Net(0)),
      .observations = {}};
  for (const FitPoint& p : target.points) {
    const Vec3 finer = surface.Point(p.uv) - surface.LevelDerivative(level, p.uv);
    view.observations.push_back({.uv = p.uv,
                                 .position = p.position - finer,
                                 .weight = p.weight,
                                 .landmark = p.role == PointRole::kLandmark});
  }
  return view;
}

}  // namespace semblance
