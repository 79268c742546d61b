// SPDX-License-Identifier: GPL-3.0-or-later
// Steps that several ways to a face share.
#pragma once

#include <span>

#include "problems/experiment/make_face.h"

namespace semblance::problems {

// The generic face, with its features, placed by the similarity.
TemplateFace InSubjectFrame(const TemplateFace& generic, const Similarity& face_from_template);

// Seeds on the implicit face below `surface`; none for seeds: none. They lie on the implicit
// surface itself (in.field) where that is known, else on its triangles.
SeedResult MakeSeeds(const HSplineSurface& surface, const MeshQuery& query, const FaceInput& in,
                     std::span<const Sphere> masks, const SeedSource& source);

// Sets the residuals of the points and their RMS, weighted as those of a fit, for a surface that
// the fit has not made.
void MeasureResiduals(FaceFit& fitted);

// Points and where they belong, mm.
struct PointPairs {
  std::vector<Vec3> from, to;
};

// From the sites of the dowels on the surface to their tips.
PointPairs FromSitesToTips(const HSplineSurface& surface, const FitTarget& dowels);

// The surface under the thin plate that brings `from` to `to`; stiffness 0 meets all of them.
// Throws InputError as FitThinPlate does.
HSplineSurface UnderThinPlate(const HSplineSurface& surface, const PointPairs& pairs,
                              double stiffness_mm);

// A face without a fit, in the form of a fit's result.
FaceFit Unfitted(HSplineSurface surface, const FitTarget& dowels);

}  // namespace semblance::problems
