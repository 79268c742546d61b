// SPDX-License-Identifier: GPL-3.0-or-later
// The true depth at every vertex of a skull with known skin, to which schemes are compared.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "surfaces/base/fields.h"
#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::interp {

struct DepthTruthOptions {
  double max_depth_mm = 60;
  double max_grazing_deg = 75;
};
template <class Visitor>
void Fields(Visitor& visit, DepthTruthOptions& o) {
  visit(FieldInfo{.name = "max_depth_mm",
                  .unit = "mm",
                  .min = 1,
                  .max = 200,
                  .doc = "thicker tissue counts as an error of the measurement"},
        o.max_depth_mm);
  visit(FieldInfo{.name = "max_grazing_deg",
                  .unit = "deg",
                  .min = 1,
                  .max = 90,
                  .doc = "largest angle between the skin's normal and the direction of the depth; "
                         "beyond it the ray grazes the skin, and no depth is measured"},
        o.max_grazing_deg);
}

enum class TruthStatus : std::uint8_t {
  kValid,
  kNoDirection,  // the vertex has no direction
  kNoHit,        // the ray leaves through no skin within max_depth_mm
  kTooFar,       // the closest skin is more than max_depth_mm away
  kGrazing,      // the angle to the skin's normal is above max_grazing_deg
  kBehind        // the closest skin lies on the inner side of the bone
};

// The reason why there is no depth, e.g. "no skin along the normal"; empty for kValid.
std::string_view DescribeStatus(TruthStatus status);

// The depths of one convention.
struct TruthMap {
  std::vector<double> depth_mm;     // one per vertex, >= 0; NaN if not valid
  std::vector<TruthStatus> status;  // one per vertex
};

// The depths by the two conventions of the literature. They differ by half a millimetre and more
// where skin and bone are not parallel. The second is never larger.
struct DepthTruth {
  TruthMap along_direction;  // to the first skin through which the ray leaves
  TruthMap closest;          // to the closest skin point
};

// Measures the depths. directions: unit or zero, one per vertex of the skull. skin: with outward
// triangles; it may contain inner walls of airways. Throws InputError if there is not one direction
// per vertex or the skin has no triangle; Cancelled if stopped.
DepthTruth MeasureDepthTruth(const TriMesh& skull, std::span<const Vec3> directions,
                             const TriMesh& skin, const DepthTruthOptions& options,
                             const RunContext& run);

}  // namespace semblance::interp
