// SPDX-License-Identifier: GPL-3.0-or-later
// The ways to polygonise an implicit surface: the thesis's three and a faster one. They differ in
// what they evaluate, not in the mesh: the outermost surface is the same to the bit.
#pragma once

#include <array>
#include <span>
#include <string_view>
#include <variant>

#include "surfaces/emitters/implicit_surface.h"
#include "surfaces/marching/polygonize.h"

namespace semblance {

// The components of the surface that are followed: that which passes through the outermost
// start cells, or all in the grid, inner sheets and fragments too.
enum class FollowedComponents { kOutermost, kAll };
constexpr auto EnumNames(FollowedComponents) {
  return std::to_array<std::string_view>({"outermost", "all"});
}

// From cells on the surface on to their neighbours: PolygonizeThrough. To miss no component it also
// starts wherever bounds on the field do not prove that there is no surface. All threads.
struct NarrowBand {
  static constexpr std::string_view kName = "narrow_band";
  FollowedComponents components = FollowedComponents::kOutermost;  // all: at many times the cost
};
template <class Visitor>
void Fields(Visitor& visit, NarrowBand& o) {
  visit(
      FieldInfo{
          .name = "components",
          .doc = "outermost: of the surface only the component through its outermost points, or, "
                 "where cells are too coarse to connect these, also what shares cells "
                 "with it; "
                 "all: no component of it in the grid is missed, at many times the cost, so "
                 "that sheets and fragments that are dropped are counted"},
      o.components);
}

// Every corner of the grid: PolygonizeAll (thesis 3.2.1). At each, emitters too far to count are
// left out as in NarrowBand. All threads.
struct BruteForce {
  static constexpr std::string_view kName = "brute_force";
};
template <class Visitor>
void Fields(Visitor&, BruteForce&) {}

// How an octree sums the emitters that a leaf lists: one after the other, as the thesis does, or
// several at once, with their neighbours in the same lanes.
enum class ListSums { kOneByOne, kLanes };
constexpr auto EnumNames(ListSums) {
  return std::to_array<std::string_view>({"one_by_one", "lanes"});
}
inline constexpr FieldInfo kListSums{
    .name = "sums",
    .doc = "of the emitters that a leaf lists: one_by_one, or lanes, 4 or 8 at once"};

// An octree over the grid whose nodes list the emitters whose box of influence they meet (thesis
// 3.2.2). Where what is not listed could change the sign, the field itself is asked. Meant for
// bisection, which needs but signs. One thread.
struct McOctree {
  static constexpr std::string_view kName = "mc_octree";
  double influence = 500;               // m of a triangle's box
  ListSums sums = ListSums::kOneByOne;  // one by one as in the thesis, or in lanes
};
template <class Visitor>
void Fields(Visitor& visit, McOctree& o) {
  visit(FieldInfo{.name = "influence",
                  .min = 1,
                  .max = 1e9,
                  .doc = "m: an emitter's box reaches to where m of it would just make a surface "
                         "(thesis 3.2.2)"},
        o.influence);
  visit(kListSums, o.sums);
}

// How the least that an emitter gives in a node is bounded: from the distance of the node's ball;
// by the least of its values at the node's corners, where that holds (in front of the triangle); or
// the same with each emitter's value at a corner kept for all nodes around the slice at hand, the
// thesis's cache (3.2.3).
enum class EmitterMinimum { kBall, kCorners, kCachedCorners };
constexpr auto EnumNames(EmitterMinimum) {
  return std::to_array<std::string_view>({"ball", "corners", "cached_corners"});
}

// An octree whose nodes list the emitters that give at least epsilon_min somewhere in them, and
// which goes no deeper where bounds prove that there is no surface (thesis 3.2.3). What the dropped
// emitters could add is carried along, and counts. One thread.
struct MinMaxOctree {
  static constexpr std::string_view kName = "minmax_octree";
  double least_emission = 1e-3;                    // less is not listed in a box
  EmitterMinimum minimum = EmitterMinimum::kBall;  // how the least in a box is found
  ListSums sums = ListSums::kOneByOne;             // one by one as in the thesis, or in lanes
};
template <class Visitor>
void Fields(Visitor& visit, MinMaxOctree& o) {
  visit(FieldInfo{.name = "least_emission",
                  .min = 0,
                  .max = 0.1,
                  .doc = "epsilon_min: an emitter that gives less than this everywhere in a box is "
                         "not listed there (thesis 3.2.3)"},
        o.least_emission);
  visit(FieldInfo{.name = "minimum",
                  .doc = "the least that an emitter gives in a box: ball, from the distance of the "
                         "box's ball; corners, the least of its values at the box's corners; "
                         "cached_corners, the same, each value computed once and kept for all "
                         "levels of the octree around the slice at hand (thesis 3.2.3)"},
        o.minimum);
  visit(kListSums, o.sums);
}

using Polygonizer = std::variant<NarrowBand, BruteForce, McOctree, MinMaxOctree>;

// The surface Flattened = 0 in the grid. starts: where NarrowBand starts. Throws InputError for a
// grid that is not usable.
PolygonizeResult PolygonizeSurface(const Polygonizer& polygonizer, const ImplicitSurface& surface,
                                   const SampleGrid& grid, std::span<const StartCell> starts,
                                   const EdgeSearchOptions& options, const RunContext& context);

}  // namespace semblance
