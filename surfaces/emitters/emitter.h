// SPDX-License-Identifier: GPL-3.0-or-later
// The emission e(p) of a triangle of the skull (thesis ch. 3), in three kinds. The face is the
// surface where the emissions of all triangles sum to 1. In the formulas T is a triangle with
// tissue depth l (mm), k is the decay, and h is the height of the point p over T's plane. Every
// emission is 0 for h <= 0.
#pragma once

#include <array>
#include <string_view>
#include <variant>

#include "surfaces/base/fields.h"

namespace semblance::surfaces {

// e(p) = (l / d)^k, with d the distance from p to T (thesis eq. 3.1). Over a flat plate the surface
// lies further out the finer the mesh is.
struct ThesisEmitter {
  static constexpr std::string_view kName = "thesis";
  double decay = 6;
  double cut_below = 0;
};

// e(p) = ((1 - t) l / d_t)^k, with d_t the distance from p to T moved out by t l (thesis eq. 3.2).
// The prism between T and the moved T is solid.
struct SplitEmitter {
  static constexpr std::string_view kName = "split";
  double decay = 6;
  double split = 0.5;
  double cut_below = 0;
};

// The depth over a triangle. With kLinear l^k moves under the integral, which avoids steps where
// the depth changes from triangle to triangle. (The thesis's emitters have one depth per triangle.)
enum class EmitterDepth { kMean, kLinear };
constexpr auto EnumNames(EmitterDepth) {
  return std::to_array<std::string_view>({"mean", "linear"});
}

// e(p) = (k+1)/(2 pi) l^k * integral over T of h / |p - q|^(k+3) dq. Over an infinite plane the
// integral is 2 pi h^(-k) / (k+1). Hence coplanar triangles of one depth l sum to (l/h)^k, and
// their surface is flat, at exactly the height l, for any mesh (docs/explanation/mathematics.md,
// 2).
struct FlatEmitter {
  static constexpr std::string_view kName = "flat";
  double decay = 6;
  EmitterDepth depth = EmitterDepth::kMean;
};

// Bounds of an emission in a box: least <= e(p) <= most.
struct EmissionBounds {
  double least = 0, most = 0;
  // True if the smallest emission in the box occurs at one of its corners (within SumShare).
  bool least_at_corner = false;
};

using Emitter = std::variant<FlatEmitter, SplitEmitter, ThesisEmitter>;

namespace emitter_internal {
inline constexpr FieldInfo kDecay{.name = "decay",
                                  .min = 1,
                                  .max = 30,
                                  .doc =
                                      "k: how fast emission falls with distance; more blends less "
                                      "and follows the skull's shape more (thesis: 3, 6, 15)"};
inline constexpr FieldInfo kCutBelow{
    .name = "cut_below",
    .min = 0,
    .max = 0.1,
    .doc =
        "emissions below this count as 0; the thesis's boxes (3.2.2, m = 500), but round, are "
        "0.002. The loss adds up where the mesh is dense; 0 cuts nothing"};
}  // namespace emitter_internal
template <class Visitor>
void Fields(Visitor& visit, ThesisEmitter& o) {
  visit(emitter_internal::kDecay, o.decay);
  visit(emitter_internal::kCutBelow, o.cut_below);
}
template <class Visitor>
void Fields(Visitor& visit, SplitEmitter& o) {
  visit(emitter_internal::kDecay, o.decay);
  visit(FieldInfo{.name = "split",
                  .min = 0,
                  .max = 0.99,
                  .doc = "t: share of the depth by which the triangle is moved out before it "
                         "emits; 0 is the thesis's first emitter"},
        o.split);
  visit(emitter_internal::kCutBelow, o.cut_below);
}
template <class Visitor>
void Fields(Visitor& visit, FlatEmitter& o) {
  visit(emitter_internal::kDecay, o.decay);
  visit(FieldInfo{.name = "depth",
                  .doc = "depth over a triangle: the mean of its corners (thesis 3.1), or linear "
                         "between them"},
        o.depth);
}

}  // namespace semblance::surfaces
