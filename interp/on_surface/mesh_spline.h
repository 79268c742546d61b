// SPDX-License-Identifier: GPL-3.0-or-later
// The smoothest function on a skull that has given means around some points: the kernel of the
// harmonic and the biharmonic scheme.
#pragma once

#include <string_view>
#include <vector>

#include "interp/dowels/dowel_samples.h"
#include "interp/dowels/left_out_dowels.h"

namespace semblance {

enum class SplineEnergy {
  kGradient,  // integral of the squared gradient: harmonic between the dowels
  kLaplacian  // integral of the squared Laplacian: biharmonic between them
};

struct MeshSpline {
  SplineEnergy energy = SplineEnergy::kGradient;
  double radius_mm = 0;  // a dowel's depth is the function's mean over the vertices so near to its
                         // closest point; 0: its value at that point
  double softness = 0;   // 0: met exactly; see SoftnessField
};

// At every vertex, mm; NaN on pieces of the skull to which no dowel is closest. Any energy is free
// at open borders: the function meets them at a right angle. Throws InputError, naming the scheme,
// if the skull has no triangle; Cancelled if stopped.
std::vector<double> SolveMeshSpline(const MeshSpline& spline, std::string_view scheme,
                                    const TriMesh& skull, const std::vector<DepthSample>& samples,
                                    const RunContext& run);

// Depths of these, limited; kOutside where NaN, kNotFacing as AssignWhereFacing.
DepthField AssignSpline(const std::vector<double>& depth_mm, const DepthLimits& limits,
                        const DepthInput& input, const std::vector<DepthSample>& samples,
                        double max_angle_deg, const RunContext& run);

// One field a fold, with an entry for each of its dowels: the function's local mean around a dowel
// that it is not shown, limited, for bone that faces along the dowel's direction. The skull is
// factored once for all folds; each then costs the cube of the number of dowels. Throws as
// SolveMeshSpline.
std::vector<DepthField> MeshSplineLeftOut(const MeshSpline& spline, std::string_view scheme,
                                          bool clamp, double max_angle_deg, const DepthInput& input,
                                          const Folds& folds, const RunContext& run);

template <class Visitor>
void SoftnessField(Visitor& visit, double& softness) {
  visit(FieldInfo{.name = "softness",
                  .min = 0,
                  .max = 1e6,
                  .doc = "0 honours every dowel; else its depth is uncertain by a variance of this "
                         "share of the function's own variance at the dowels; more smooths, down "
                         "to the mean"},
        softness);
}

}  // namespace semblance
