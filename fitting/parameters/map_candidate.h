// SPDX-License-Identifier: GPL-3.0-or-later
// A map of the points to the plane that may become their (u,v): whether it folds, which of several
// is taken, and its places brought to 0..1.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "fitting/parameters/one_to_one.h"
#include "fitting/parameters/parametrisation.h"
#include "surfaces/base/fields.h"
#include "surfaces/base/geometry.h"

namespace semblance {

// What becomes of a plane or cylinder over which the points fold.
enum class FoldRule { kRefuse, kAccept };
constexpr auto EnumNames(FoldRule) { return std::to_array<std::string_view>({"refuse", "accept"}); }
template <class Visitor>
void FoldField(Visitor& visit, FoldRule& folds) {
  visit(FieldInfo{.name = "folds",
                  .doc = "what becomes of points that fold over it, more than 2 % of them: refuse "
                         "them; or accept it: the surface then goes between the sheets"},
        folds);
}

struct MapCandidate {
  std::string how;       // in words
  std::vector<Vec2> at;  // mm
  Vec2 period_mm = Vec2::Zero();
  MapFaults faults = {};
  int number = 0;  // among those that may be taken
};

inline constexpr double kMostFaults = 0.02;  // share of the points, of what may be taken

// From the points, and from the triangles if there are any: of each fault the larger share.
MapFaults MapFaultsOf(const Scan& points, const MapCandidate& candidate);

bool MayBeTaken(const MapCandidate& candidate, FoldRule folds);

// The first that is next to faultless, else that with the least faults; all that were looked at
// come back, the chosen one last, the others without their places. make(k): the k-th of `count`.
std::vector<MapCandidate> ChooseCandidate(const Scan& points, int count,
                                          const std::function<MapCandidate(int)>& make);

// The faults of all that were looked at, for a message.
std::string FaultsText(const std::vector<MapCandidate>& tried);
std::string PercentText(double share);

// Throws an InputError that says that it is about the parameters.
[[noreturn]] void FailParameters(const std::string& what);

// One coordinate to 0..1. Throws InputError if the points have no extent along it.
//   what: of the coordinate, for the message.
void Normalise(int coordinate, const std::string& what, std::vector<Vec2>& uv);

// Turns a coordinate round where the triangles are mirrored, so that du x dv looks where they look.
void TurnToTriangles(const MapFaults& faults, int coordinate, std::vector<Vec2>& at);

}  // namespace semblance
