// SPDX-License-Identifier: GPL-3.0-or-later
// The true depth at every vertex of a skull whose skin is known: what schemes are measured against.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "surfaces/base/fields.h"
#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

struct DepthTruthOptions {
  double max_depth_mm = 60;     // thicker tissue is an error of the search
  double max_grazing_deg = 75;  // between skin's normal and the direction
};
template <class Visitor>
void Fields(Visitor& visit, DepthTruthOptions& o) {
  visit(FieldInfo{.name = "max_depth_mm",
                  .unit = "mm",
                  .min = 1,
                  .max = 200,
                  .doc = "true tissue thicker than this is taken for an error of the search"},
        o.max_depth_mm);
  visit(FieldInfo{.name = "max_grazing_deg",
                  .unit = "deg",
                  .min = 1,
                  .max = 90,
                  .doc = "skin that stands steeper than this to the direction of the depth is "
                         "grazed, not measured"},
        o.max_grazing_deg);
}

enum class TruthStatus : std::uint8_t {
  kValid,
  kNoDirection,  // the vertex has no direction
  kNoHit,        // no skin within max_depth_mm that the direction leaves by
  kTooFar,       // the closest skin is further than max_depth_mm
  kGrazing,      // skin is met at more than max_grazing_deg from its normal
  kBehind        // the closest skin lies on the inner side of the bone
};

// One convention's depths.
struct TruthMap {
  std::vector<double> depth_mm;     // one per vertex, >= 0; NaN where not valid
  std::vector<TruthStatus> status;  // one per vertex
};

// The two conventions of the literature, kept apart: of one head they differ by half a millimetre
// and more where skin is not parallel to bone, and the second is never more.
struct DepthTruth {
  TruthMap along_direction;  // to the first skin that the ray leaves by
  TruthMap closest;          // to the closest point of the skin
};

// directions: unit or zero, one per vertex of the skull. Skin's triangles face outwards; inner
// walls of airways may be there. Throws InputError if the directions are not one per vertex or the
// skin has no triangle; Cancelled if stopped.
DepthTruth MeasureDepthTruth(const TriMesh& skull, std::span<const Vec3> directions,
                             const TriMesh& skin, const DepthTruthOptions& options,
                             const RunContext& run);

}  // namespace semblance
