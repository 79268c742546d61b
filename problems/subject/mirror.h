// SPDX-License-Identifier: GPL-3.0-or-later
// Bone that a skull lacks: mirrored from the other side through the mid-sagittal plane, or bridged.
// Each triangle records whether its bone was observed, mirrored or inferred.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "problems/subject/average_skull.h"
#include "problems/subject/landmarks.h"
#include "surfaces/base/fields.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

enum class BoneOrigin : std::uint8_t {
  kObserved,  // in the scan
  kMirrored,  // copied from the other side
  kInferred   // bridged over temples, orbits and gaps
};
constexpr auto EnumNames(BoneOrigin) {
  return std::to_array<std::string_view>({"observed", "mirrored", "inferred"});
}

// The origin of each triangle of a skull's shell: that of the nearest triangle of the skull, or
// inferred if no triangle lies within 2 mm of its centroid. `of_skull` has one value per triangle
// of the skull; if it is empty, all bone is observed.
std::vector<BoneOrigin> OriginOfShell(const TriMesh& shell, const TriMesh& skull,
                                      std::span<const BoneOrigin> of_skull, int threads);

// The origin under each vertex of a face: that of the shell's nearest triangle.
std::vector<BoneOrigin> OriginUnder(const TriMesh& face, const TriMesh& shell,
                                    std::span<const BoneOrigin> of_shell, int threads);

// The area of each origin, in the order of the enum.
std::array<double, 3> AreaByOrigin_cm2(const TriMesh& mesh, std::span<const BoneOrigin> origin);

struct MirrorOptions {
  bool missing = false;
  double counterpart_mm = 6;
  double least_cm2 = 2;
};

template <class Visitor>
void Fields(Visitor& visit, MirrorOptions& o) {
  visit(FieldInfo{.name = "missing",
                  .doc = "mirrors bone that one side has and the other lacks; mirrored bone is "
                         "invented, and is reported and drawn as such"},
        o.missing);
  visit(FieldInfo{.name = "counterpart_mm",
                  .unit = "mm",
                  .min = 1,
                  .max = 50,
                  .doc = "bone lacks a counterpart if its mirror image is farther than this from "
                         "any bone; a smaller value also mirrors the usual asymmetry"},
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
  int pairs = 0, midline = 0;  // numbers of sites that the plane was fitted to
  double rms_mm = kNaN;        // distance of the mirrored left sites from the right ones

  Vec3 Mirrored(const Vec3& p) const { return p - 2 * (normal.dot(p) - offset_mm) * normal; }
};

// Minimises the sum of |mirrored left site - right site|^2 over all pairs and of
// |mirrored site - site|^2 over the midline. `sites` must be standard. Throws InputError without a
// pair, or if the sites do not determine the plane.
MidPlane FitMidPlane(std::span<const SitePoint> sites);

struct MirroredSkull {
  TriMesh mesh;                    // the given points and triangles unchanged, then the new ones
  std::vector<BoneOrigin> origin;  // one per triangle
  double to_left_cm2 = 0, to_right_cm2 = 0;  // area that was added
};

// Adds the mirror image of each triangle that lacks a counterpart (its mirrored centroid is farther
// than counterpart_mm from any bone). Also adds the neighbours within another counterpart_mm of
// such a triangle, up to 2 mm from bone, so that no gap remains at the seam. Throws InputError if
// this is more than half of the skull, because the plane then does not mirror it.
MirroredSkull MirrorMissing(const TriMesh& skull, const MidPlane& plane,
                            const MirrorOptions& options, int threads);

// Mirrors missing bone of a skull and its landmarks if options.missing is set; otherwise does
// nothing. A landmark of one side whose mirror image lies on mirrored bone is mirrored too, with
// low certainty, if the other side lacks it. Returns notes on what was done.
std::vector<std::string> PrepareMirrored(const MirrorOptions& options, TriMesh& skull,
                                         std::vector<BoneOrigin>& origin, LandmarkFile& landmarks,
                                         int threads);

}  // namespace semblance::problems
