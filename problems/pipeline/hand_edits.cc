// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/pipeline/hand_edits.h"

#include <fmt/format.h>

#include <cmath>

#include "problems/edits/edit_script.h"

namespace semblance {
namespace {

// Weighted, as those of a fit.
void MeasureResiduals(const FitTarget& target, FitResult& fit) {
  double all = 0, weight = 0, of_dowels = 0, dowel_weight = 0;
  for (std::size_t k = 0; k < target.points.size(); ++k) {
    const FitPoint& point = target.points[k];
    fit.residual_mm[k] = (fit.surface.Point(fit.uv[k]) - point.position).norm();
    const double squared = point.weight * fit.residual_mm[k] * fit.residual_mm[k];
    all += squared;
    weight += point.weight;
    if (point.role != PointRole::kSeed) {
      of_dowels += squared;
      dowel_weight += point.weight;
    }
  }
  fit.point_rms_mm = std::sqrt(all / weight);
  fit.dowel_rms_mm = std::sqrt(of_dowels / dowel_weight);
}

}  // namespace

std::optional<HSplineSurface> EditByHand(const Experiment& experiment, FaceFit& fitted,
                                         Case& subject) {
  if (experiment.edits.empty()) {
    return std::nullopt;
  }
  const EditScript script = ReadEditScript(experiment.edits);
  HSplineSurface before = fitted.fit.surface;
  ApplyEdits(script, fitted.fit.surface);
  MeasureResiduals(fitted.target, fitted.fit);
  subject.inputs.push_back(experiment.edits);
  subject.notes.push_back(
      fmt::format("the face was changed by hand: {} vertices and {} parts of it, by {}; what is "
                  "measured is the changed face",
                  script.edits.size(), script.resets.size(), experiment.edits.filename().string()));
  return before;
}

}  // namespace semblance
