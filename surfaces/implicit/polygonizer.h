// SPDX-License-Identifier: GPL-3.0-or-later
// The ways to polygonise an implicit surface: the thesis's three and a faster one. They differ in
// what they evaluate, not in the mesh: the outermost surface is the same to the bit.
#pragma once

#include <span>
#include <string_view>
#include <variant>

#include "surfaces/emitters/implicit_surface.h"
#include "surfaces/marching/polygonize.h"

namespace semblance {

// The components of the surface that are followed: that which passes through the outermost
// surface's starts, or all in the grid, inner sheets and fragments too.
enum class FollowedComponents { kOutermost, kAll };
constexpr auto EnumNames(FollowedComponents) {
  return std::to_array<std::string_view>({"outermost", "all"});
}

// From cells on the surface on to their neighbours: PolygonizeThrough. To miss no component it also
// starts wherever bounds on the field do not prove that there is no surface. All threads.
struct NarrowBand {
  static constexpr std::string_view kName = "narrow_band";
  FollowedComponents components = FollowedComponents::kOutermost;
};
template <class Visitor>
void Fields(Visitor& visit, NarrowBand& o) {
  visit(
      FieldInfo{
          .name = "components",
          .doc = "outermost: of the surface only the component through its outermost points, or, "
                 "where cells are too coarse for these to hang together, also what shares cells "
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

// An octree over the grid whose nodes list the emitters whose box of influence they meet (thesis
// 3.2.2). Where what is not listed could change the sign, the field itself is asked. Meant for
// bisection, which needs but signs. One thread.
struct McOctree {
  static constexpr std::string_view kName = "mc_octree";
  double influence = 500;
};
template <class Visitor>
void Fields(Visitor& visit, McOctree& o) {
  visit(FieldInfo{.name = "influence",
                  .min = 1,
                  .max = 1e9,
                  .doc = "m: an emitter's box reaches to where m of it would just make a surface "
                         "(thesis 3.2.2)"},
        o.influence);
}

// An octree whose nodes list the emitters that give at least epsilon_min somewhere in them, and
// which goes no deeper where bounds prove that there is no surface (thesis 3.2.3). What the dropped
// emitters could add is carried along, and counts. One thread.
struct MinMaxOctree {
  static constexpr std::string_view kName = "minmax_octree";
  double least_emission = 1e-3;
};
template <class Visitor>
void Fields(Visitor& visit, MinMaxOctree& o) {
  visit(FieldInfo{.name = "least_emission",
                  .min = 0,
                  .max = 0.1,
                  .doc = "epsilon_min: an emitter that gives less than this everywhere in a box is "
                         "not listed there (thesis 3.2.3)"},
        o.least_emission);
}

using Polygonizer = std::variant<NarrowBand, BruteForce, McOctree, MinMaxOctree>;

// The surface Flattened = 0 in the grid. starts: where NarrowBand starts. Throws InputError for
// a grid that is none.
PolygonizeResult PolygonizeSurface(const Polygonizer& polygonizer, const ImplicitSurface& surface,
                                   const SampleGrid& grid, std::span<const StartCell> starts,
                                   const EdgeSearchOptions& options, const RunContext& context);

}  // namespace semblance
