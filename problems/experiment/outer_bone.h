// SPDX-License-Identifier: GPL-3.0-or-later
// Samples of the bone that a face must cover, and how far they lie outside a face.
#pragma once

#include <span>
#include <vector>

#include "problems/subject/mirror.h"
#include "surfaces/base/run_context.h"
#include "surfaces/hspline_query/tessellate.h"
#include "surfaces/mesh/mesh_query.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

struct BoneSample {
  Vec3 position, normal;     // mm; outward unit normal of the bone
  double outside_mm = kNaN;  // of the face, negative inside; NaN: not measured, or not under it
  Vec2 face_uv = Vec2::Constant(kNaN);  // of the point of the face nearest to the sample
};

// Samples of the observed outer bone, each for the same area. Bone is outer if the skull's shell
// lies close to it and faces the same way. origin: one per triangle of the skull; empty: all
// observed. `query` must be that of the shell. area_mm2 > 0.
std::vector<BoneSample> SampleOuterBone(const TriMesh& skull, std::span<const BoneOrigin> origin,
                                        const TriMesh& shell, const MeshQuery& query,
                                        double area_mm2, const RunContext& context);

// Sets outside_mm and face_uv of each sample: the distance from the nearest point of the face, NaN
// beyond the border of the face. face_uv has no meaning at the seam of a closed face.
void MeasureOutside(const Tessellation& face, std::vector<BoneSample>& samples,
                    const RunContext& context);

}  // namespace semblance::problems
