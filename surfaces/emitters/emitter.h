// SPDX-License-Identifier: GPL-3.0-or-later
// What a triangle of the skull emits (thesis ch. 3): three kinds, chosen by option. For a triangle
// T with depth l, decay k and a point p at height h over T's plane; every emitter is 0 where h <=
// 0.
#pragma once

#include <array>
#include <string_view>
#include <variant>

#include "surfaces/base/fields.h"

namespace semblance {

// Eq. 3.1: (l / d)^k, d the distance from p to T. The surface of a flat plate lies the further out
// the finer its mesh.
struct ThesisEmitter {
  static constexpr std::string_view kName = "thesis";
  double decay = 6;      // k: more blends less, and follows the bone more
  double cut_below = 0;  // an emission below this is none; 0: all count
};

// Eq. 3.2: T moved out by t l emits with depth (1 - t) l; the prism under it is solid.
struct SplitEmitter {
  static constexpr std::string_view kName = "split";
  double decay = 6;      // k: more blends less, and follows the bone more
  double split = 0.5;    // t: 0 is the first emitter
  double cut_below = 0;  // an emission below this is none; 0: all count
};

// (k+1)/(2 pi) l^k * integral over T of h / |p - q|^(k+3) dq. Over an infinite plane the integral
// is 2 pi h^(-k) / (k+1), so coplanar triangles of one depth sum to (l/h)^k: their surface is flat,
// at exactly l, whatever the mesh.
//
// With the depth linear over T, l^k stands under the integral: no steps where depth changes from
// triangle to triangle. (The thesis's emitters know one depth per triangle.)
enum class EmitterDepth { kMean, kLinear };
constexpr auto EnumNames(EmitterDepth) {
  return std::to_array<std::string_view>({"mean", "linear"});
}

struct FlatEmitter {
  static constexpr std::string_view kName = "flat";
  double decay = 6;                          // k: more blends less, and follows the bone more
  EmitterDepth depth = EmitterDepth::kMean;  // the corners' mean, or linear between them
};

// What an emitter gives in a box: nowhere less than `least`, nowhere more than `most`.
struct EmissionBounds {
  double least = 0, most = 0;
  // Nowhere in the box does it give less than at one of the corners (within SumShare).
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
        "a triangle emits nothing where it would emit less than this; the thesis's boxes (3.2.2, "
        "m = 500), but round: 0.002. What is lost adds up where the mesh is dense; 0 cuts nothing"};
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
                  .doc = "of a triangle: the mean of its corners' (thesis 3.1), or linear between "
                         "them"},
        o.depth);
}

}  // namespace semblance
