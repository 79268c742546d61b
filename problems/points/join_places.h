// SPDX-License-Identifier: GPL-3.0-or-later
// The places at which a joined edge is held, so that it is held between them too.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "fitting/problem/fit_target.h"
#include "problems/points/surface_join.h"

namespace semblance {

// The new surface's edge as it is to be: its spans from t = 0 to 1.
using EdgeSpans = std::vector<EdgeSpan>;

// What the new surface may become.
struct NewShape {
  HSplineShape level0;
  int finest = 0;  // level
};

// Halves spans of an edge until none is longer than those of the given edge beside it. Where both
// have the same patches but for a power of two, the given curve is then one that the new edge can
// take. Throws InputError, naming the join, if that would need levels that the plan does not allow.
//   name: "joins[0]" and so on.
EdgeSpans AsFineAsItsEdge(const EdgeSpans& spans, const OpenedJoin& join, std::string_view name,
                          const NewShape& shape);

// The finer spans of two partitions by halves of the same edge.
EdgeSpans FinerOf(const EdgeSpans& a, const EdgeSpans& b, int patches);

// What a surface has that was asked to be as fine as `asked` along an edge: the vertices over a
// patch reach into those beside it.
EdgeSpans Reached(const EdgeSpans& asked, int patches);

// An edge of the new surface while it is fitted.
struct HeldEdge {
  EdgeSpans asked;  // it is to be at least as fine
  EdgeSpans spans;  // as it is, as far as that is known
  bool operator==(const HeldEdge&) const = default;
};

// All of the finest level among them.
EdgeSpans Levelled(const EdgeSpans& spans);

// Asks for spans that are `levels` finer than they are, or the finest, wherever an `at` is.
HeldEdge Halved(const HeldEdge& edge, std::span<const double> at, int levels, int patches,
                int finest);

// Where two joined edges have a corner of the new surface in common.
struct JoinCorner {
  std::size_t first = 0, second = 0;  // joins
  double first_t = kNaN, second_t = kNaN;
};
std::vector<JoinCorner> CornersOf(std::span<const OpenedJoin> joins);

// Throws InputError if the given surfaces are farther apart at a corner than a millionth of
// extent_mm, or a curve leaves the other's tangent plane, where that is joined, by more than 0.1
// degrees: nothing could meet both.
void CheckCorners(std::span<const OpenedJoin> joins, double extent_mm);

// Of each edge the ends of its spans and the middles of the first and the last: two curves of these
// spans that agree there are one (Schoenberg & Whitney 1953). A closed edge has no ends. The
// normals are the given surface's at the same places, but for corners that two joins share: there
// the curves give both tangents, and of the two middles beside it the first join's gives the mixed
// derivative. Throws InputError for a given surface without a normal at a place.
//   edges: one per join.
std::vector<ExactPoint> ExactPointsOf(std::span<const OpenedJoin> joins,
                                      std::span<const HeldEdge> edges, const HSplineShape& shape);
// How many of them are on the edge of one join, corners that an earlier one has counted too.
int PlacesAlong(const EdgeSpans& spans, bool closed);

}  // namespace semblance
