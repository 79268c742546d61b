// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/schemes/harmonic.h"

namespace semblance::interp {

DepthField InterpolateDepth(const Harmonic& options, const DepthInput& input,
                            const RunContext& run) {
  CheckDepthInput(input);
  const std::vector<DepthSample> samples = DepthSamples(input.dowels);
  const MeshSpline spline{SplineEnergy::kGradient, options.radius_mm, options.softness};
  const std::vector<double> depth_mm =
      SolveMeshSpline(spline, Harmonic::kName, input.skull, samples, run);
  return AssignSpline(depth_mm, DepthLimits(samples, true), input, samples, options.max_angle_deg,
                      run);
}

std::vector<DepthField> InterpolateLeftOut(const Harmonic& options, const DepthInput& input,
                                           const Folds& folds, const RunContext& run) {
  return MeshSplineLeftOut({SplineEnergy::kGradient, options.radius_mm, options.softness},
                           Harmonic::kName, true, options.max_angle_deg, input, folds, run);
}
DepthField InterpolateDepth(const Biharmonic& options, const DepthInput& input,
                            const RunContext& run) {
  CheckDepthInput(input);
  const std::vector<DepthSample> samples = DepthSamples(input.dowels);
  const MeshSpline spline{SplineEnergy::kLaplacian, 0, options.softness};
  const std::vector<double> depth_mm =
      SolveMeshSpline(spline, Biharmonic::kName, input.skull, samples, run);
  return AssignSpline(depth_mm, DepthLimits(samples, options.clamp), input, samples,
                      options.max_angle_deg, run);
}

std::vector<DepthField> InterpolateLeftOut(const Biharmonic& options, const DepthInput& input,
                                           const Folds& folds, const RunContext& run) {
  return MeshSplineLeftOut({SplineEnergy::kLaplacian, 0, options.softness}, Biharmonic::kName,
                           options.clamp, options.max_angle_deg, input, folds, run);
}
}  // namespace semblance::interp
