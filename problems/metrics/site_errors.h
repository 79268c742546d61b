// SPDX-License-Identifier: GPL-3.0-or-later
// How far a face is off at named places: along the landmarks' dowels, and at features of the skin.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "interp/dowels/dowel.h"
#include "problems/subject/average_skull.h"
#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// Along a landmark's direction, from its base: to the first skin that the ray leaves by within 60
// mm, and to the first of the face within 30 mm behind the base and 60 mm in front of it.
struct SiteError {
  std::string site;
  double true_mm = kNaN;  // NaN where nothing is hit
  double face_mm = kNaN;

  double Error_mm() const { return face_mm - true_mm; }  // > 0: the face lies outside
};
// outer_skin: its triangles face outside air. Landmarks without a finite direction are left out.
std::vector<SiteError> MeasureSites(const TriMesh& outer_skin, const TriMesh& face,
                                    std::span<const Dowel> landmarks);

// A feature that both surfaces have, found on each by the same rule, to a vertex.
struct FeatureError {
  std::string name;
  Vec3 on_truth = Vec3::Constant(kNaN), on_face = Vec3::Constant(kNaN);

  double Error_mm() const { return (on_face - on_truth).norm(); }
};
// nose_tip (pronasale): the most anterior vertex within 20 mm of the midline and 5 to 60 mm below
// nasion, in the frame and millimetres of an average skull. Not there where a mesh has no triangle
// in that box, or is foremost at its upper or lower end: then it has no nose.
std::vector<FeatureError> MeasureFeaturePoints(const TriMesh& outer_skin, const TriMesh& face,
                                               const SkullSites& sites);

}  // namespace semblance
