// SPDX-License-Identifier: GPL-3.0-or-later
// Four methods to polygonise an implicit surface: the thesis's three and a faster one. They
// evaluate the field at different points, but their mesh of the outermost surface is the same to
// the bit.
#pragma once

#include <array>
#include <span>
#include <string_view>
#include <variant>

#include "surfaces/emitters/implicit_surface.h"
#include "surfaces/marching/polygonize.h"

namespace semblance::surfaces {

// The components of the surface that are followed: the one through the outermost start cells, or
// all in the grid, including inner sheets and fragments.
enum class FollowedComponents { kOutermost, kAll };
constexpr auto EnumNames(FollowedComponents) {
  return std::to_array<std::string_view>({"outermost", "all"});
}

// Follows the surface from cell to neighbouring cell (PolygonizeThrough). To miss no component,
// kAll also starts at all cells for which bounds on the field do not exclude the surface. Uses all
// threads.
struct NarrowBand {
  static constexpr std::string_view kName = "narrow_band";
  FollowedComponents components = FollowedComponents::kOutermost;
};
template <class Visitor>
void Fields(Visitor& visit, NarrowBand& o) {
  visit(FieldInfo{.name = "components",
                  .doc = "outermost: only the component through the surface's outermost points "
                         "and, if the cells are too coarse to connect these, components that share "
                         "cells with it; all: every component in the grid, at many times the cost, "
                         "so that dropped sheets and fragments are counted"},
        o.components);
}

// Evaluates every corner of the grid (PolygonizeAll, thesis 3.2.1). Distant emitters are left out
// as in NarrowBand. Uses all threads.
struct BruteForce {
  static constexpr std::string_view kName = "brute_force";
};
template <class Visitor>
void Fields(Visitor&, BruteForce&) {}

// The summation of a leaf's emitters: one after the other, as in the thesis, or several at once
// together with their neighbours in the same lanes.
enum class ListSums { kOneByOne, kLanes };
constexpr auto EnumNames(ListSums) {
  return std::to_array<std::string_view>({"one_by_one", "lanes"});
}
inline constexpr FieldInfo kListSums{
    .name = "sums",
    .doc =
        "summation of a leaf's emitters: one_by_one (as in the thesis), or lanes, 4 or 8 at once"};

// An octree over the grid. A node lists the emitters whose box of influence it meets (thesis
// 3.2.2). If emitters that are not listed could change the sign, the full field is evaluated.
// Suited to bisection, which needs only signs. Uses one thread.
struct McOctree {
  static constexpr std::string_view kName = "mc_octree";
  double influence = 500;
  ListSums sums = ListSums::kOneByOne;
};
template <class Visitor>
void Fields(Visitor& visit, McOctree& o) {
  visit(FieldInfo{.name = "influence",
                  .min = 1,
                  .max = 1e9,
                  .doc = "m: an emitter's box extends to the distance at which m copies of the "
                         "emitter would just make a surface (thesis 3.2.2)"},
        o.influence);
  visit(kListSums, o.sums);
}

// The lower bound of an emission in a node: from the distance of the node's ball; by the smallest
// value at the node's corners, where this is valid (in front of the triangle); or the same with
// cached corner values (thesis 3.2.3).
enum class EmitterMinimum { kBall, kCorners, kCachedCorners };
constexpr auto EnumNames(EmitterMinimum) {
  return std::to_array<std::string_view>({"ball", "corners", "cached_corners"});
}

// An octree whose nodes list the emitters that give at least epsilon_min somewhere in the node. It
// is not divided where bounds exclude the surface (thesis 3.2.3). The bound of the dropped emitters
// is passed down and counted. Uses one thread.
struct MinMaxOctree {
  static constexpr std::string_view kName = "minmax_octree";
  double least_emission = 1e-3;
  EmitterMinimum minimum = EmitterMinimum::kBall;
  ListSums sums = ListSums::kOneByOne;
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
                  .doc = "lower bound of an emission in a box: ball, from the distance of the "
                         "box's ball; corners, the smallest value at the box's corners; "
                         "cached_corners, the same, with each value computed once and kept for all "
                         "levels of the octree around the current slice (thesis 3.2.3)"},
        o.minimum);
  visit(kListSums, o.sums);
}

using Polygonizer = std::variant<NarrowBand, BruteForce, McOctree, MinMaxOctree>;

// Polygonises the surface Flattened = 0 in the grid. starts: the start cells of NarrowBand. Throws
// InputError for a grid that is not usable.
PolygonizeResult PolygonizeSurface(const Polygonizer& polygonizer, const ImplicitSurface& surface,
                                   const SampleGrid& grid, std::span<const StartCell> starts,
                                   const EdgeSearchOptions& options, const RunContext& context);

}  // namespace semblance::surfaces
