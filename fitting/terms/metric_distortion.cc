// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/terms/metric_distortion.h"

#include <algorithm>
#include <cmath>

namespace semblance::fitting {

MetricDistortion MeasureDistortion(const HSplineSurface& surface, const HSplineSurface& rest,
                                   const std::function<bool(const Vec3&)>& wanted) {
  const HSplineShape& shape = rest.shape();
  const int columns = shape.PatchesU(shape.max_level), rows = shape.PatchesV(shape.max_level);
  double area = 0, strains = 0, areas = 0, largest = 0;
  for (int k = 0; k < 4 * columns * rows; ++k) {
    const Vec2 uv = GaussPoint(k, columns, rows);
    const SurfaceFrame from = rest.Frame(uv);
    const auto axes = TemplateAxes::At(from.du, from.dv);
    if (!axes || !wanted(from.point)) {
      continue;
    }
    const SurfaceFrame to = surface.Frame(uv);
    const Strain strain = ComputeStrain(*axes, to.du, to.dv);
    area += axes->area;
    strains += axes->area * strain.SquaredNorm();
    areas += axes->area * strain.area * strain.area;
    largest = std::max(largest, strain.SquaredNorm());
  }
  if (area <= 0) {
    return {};
  }
  return {.rms_strain = std::sqrt(strains / area),
          .max_strain = std::sqrt(largest),
          .rms_area = std::sqrt(areas / area),
          .area_cm2 = area / (4.0 * columns * rows) / 100};
}

}  // namespace semblance::fitting
