// SPDX-License-Identifier: GPL-3.0-or-later
// Bone that one side lacks, taken from the other through the mid-sagittal plane.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "problems/preparation/bone_origin.h"
#include "problems/subject/average_skull.h"
#include "problems/subject/landmarks.h"
#include "surfaces/base/fields.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

struct MirrorOptions {
  bool missing = false;       // whether bone of one side alone is mirrored
  double counterpart_mm = 6;  // within this, bone has a counterpart
  double least_cm2 = 2;       // of a piece
};

template <class Visitor>
void Fields(Visitor& visit, MirrorOptions& o) {
  visit(FieldInfo{.name = "missing",
                  .doc = "bone that one side has and the other lacks is mirrored; it is invented, "
                         "and is told and drawn as such"},
        o.missing);
  visit(FieldInfo{.name = "counterpart_mm",
                  .unit = "mm",
                  .min = 1,
                  .max = 50,
                  .doc = "bone lacks a counterpart if its mirror image is further than this from "
                         "any bone; less mirrors the usual asymmetry too"},
        o.counterpart_mm);
  visit(FieldInfo{.name = "least_cm2",
                  .unit = "cm2",
                  .min = 0,
                  .max = 1000,
                  .doc = "smaller pieces are not mirrored"},
        o.least_cm2);
}

// normal . p = offset_mm.
struct MidPlane {
  Vec3 normal = Vec3::Constant(kNaN);  // unit, to the subject's left
  double offset_mm = kNaN;
  int pairs = 0, midline = 0;  // sites that it was fitted to
  double rms_mm = kNaN;        // of the mirrored left sites from the right ones

  Vec3 Mirrored(const Vec3& p) const { return p - 2 * (normal.dot(p) - offset_mm) * normal; }
};

// Least squares over |mirrored left site - right site| of all pairs and |mirrored site - site| of
// the midline. sites: standard ones. Throws InputError without a pair, or where the sites do not
// say how the plane lies.
MidPlane FitMidPlane(std::span<const SitePoint> sites);

struct MirroredSkull {
  TriMesh mesh;                    // the points and triangles given, as they are; then the new ones
  std::vector<BoneOrigin> origin;  // one per triangle
  double to_left_cm2 = 0, to_right_cm2 = 0;  // area that was added
};

// Adds the mirror image of each triangle that lacks a counterpart (its middle, mirrored, is further
// than counterpart_mm from any bone), and of their neighbours within as much again, up to where
// bone is 2 mm near: so that no gap is left at the seam. Throws InputError if that is more than
// half of the skull: then the plane does not mirror it.
MirroredSkull MirrorMissing(const TriMesh& skull, const MidPlane& plane,
                            const MirrorOptions& options, int threads);

// Does it to a skull and its landmarks as the options say, and nothing unless they say so. A
// landmark that only the other side has, and whose mirror image lies on mirrored bone, is mirrored
// too (certainty low). Returns what was done, a line each.
std::vector<std::string> PrepareMirrored(const MirrorOptions& options, TriMesh& skull,
                                         std::vector<BoneOrigin>& origin, LandmarkFile& landmarks,
                                         int threads);

}  // namespace semblance
