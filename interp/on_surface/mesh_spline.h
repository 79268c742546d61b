// SPDX-License-Identifier: GPL-3.0-or-later
// The smoothest function on a skull with given local means around some points: the core of the
// harmonic and the biharmonic scheme.
#pragma once

#include <string_view>
#include <vector>

#include "interp/dowels/dowel_network.h"
#include "interp/dowels/dowel_samples.h"

namespace semblance::interp {

enum class SplineEnergy {
  kGradient,  // integral of the squared gradient; harmonic between dowels
  kLaplacian  // integral of the squared Laplacian; biharmonic between dowels
};

struct MeshSpline {
  SplineEnergy energy = SplineEnergy::kGradient;
  // A dowel prescribes the function's mean over the vertices within this radius of the dowel's
  // closest point; with 0, the value at that point.
  double radius_mm = 0;
  double softness = 0;  // see SoftnessField
};

// The function at every vertex, mm; NaN on pieces of the skull without a dowel. Open borders have
// natural boundary conditions: the function's normal derivative is 0 there. Throws InputError, with
// the scheme's name, if the skull has no triangle; Cancelled if stopped.
std::vector<double> SolveMeshSpline(const MeshSpline& spline, std::string_view scheme,
                                    const TriMesh& skull, const std::vector<DepthSample>& samples,
                                    const RunContext& run);

// Makes a field of these depths, limited; kOutside for NaN, kNotFacing as in AssignWhereFacing.
DepthField AssignSpline(const std::vector<double>& depth_mm, const DepthLimits& limits,
                        const DepthInput& input, const std::vector<DepthSample>& samples,
                        double max_angle_deg, const RunContext& run);

// Predicts left-out dowels: one field per fold, with one entry per dowel of the fold. A prediction
// is the limited local mean around the dowel, for bone that faces along the dowel's direction. The
// skull is factored once for all folds; each fold then costs the cube of the number of dowels.
// Throws as SolveMeshSpline does.
std::vector<DepthField> MeshSplineLeftOut(const MeshSpline& spline, std::string_view scheme,
                                          bool clamp, double max_angle_deg, const DepthInput& input,
                                          const Folds& folds, const RunContext& run);

template <class Visitor>
void SoftnessField(Visitor& visit, double& softness) {
  visit(
      FieldInfo{
          .name = "softness",
          .min = 0,
          .max = 1e6,
          .doc =
              "0 interpolates every dowel; otherwise a dowel's depth has a variance of this share "
              "of the function's own variance at the dowels; more smooths, down to the mean"},
      softness);
}

}  // namespace semblance::interp
