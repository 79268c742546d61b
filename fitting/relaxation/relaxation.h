// SPDX-License-Identifier: GPL-3.0-or-later
// Relaxation: moves the (u,v) of a fit's points over the surface, so that nobody has to place them
// by hand (thesis 4.4). relaxation.cc shows the states of a step of the schedule, and the
// invariants of moves.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "fitting/problem/fit_target.h"
#include "surfaces/base/fields.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance::fitting {

class DowelMesh;  // dowel_mesh.h

// The options of every mode: the moves of a round and their limits.
struct PointMoves {
  int rounds = 3;
  double damping = 0.1;
  double max_move_mm = 5;
  double standard = 0;
  bool barrier = true;
  // Labels of points that keep their (u,v); all points at the same place stay with them. This is
  // not an option: the caller lists the points that were placed by hand.
  std::vector<std::string> kept = {};
};
template <class Visitor>
void Fields(Visitor& visit, PointMoves& o) {
  visit(FieldInfo{.name = "rounds",
                  .min = 1,
                  .max = 100,
                  .doc = "number of moves of all points after each step of the schedule"},
        o.rounds);
  visit(FieldInfo{.name = "damping",
                  .min = 0,
                  .max = 100,
                  .doc = "resistance to moves, relative to the weights; 0: whole Gauss-Newton "
                         "steps"},
        o.damping);
  visit(FieldInfo{.name = "max_move_mm",
                  .unit = "mm",
                  .min = 1e-3,
                  .max = 100,
                  .doc = "longest move of a point on the surface per round"},
        o.max_move_mm);
  visit(FieldInfo{.name = "standard",
                  .min = 0,
                  .max = 1e6,
                  .doc = "weight that holds the standard landmarks (all points but seeds) at the "
                         "template's (u,v)"},
        o.standard);
  visit(FieldInfo{.name = "barrier",
                  .doc = "true: no triangle of the points' network in (u,v) may turn over; false: "
                         "for points so dense that errors of (u,v) have changed their order"},
        o.barrier);
}

// PointMoves with penalties between neighbours in the network. A point's distance from the surface
// has weight 1. All penalties are in mm^2 on the surface, so that a weight means the same for every
// domain.
struct NetworkMoves : PointMoves {
  double bunching = 0.005;
  double distortion = 0.005;
  double crease = 0;
};
template <class Visitor>
void Fields(Visitor& visit, NetworkMoves& o) {
  Fields(visit, static_cast<PointMoves&>(o));
  visit(FieldInfo{.name = "bunching",
                  .min = 0,
                  .max = 1e3,
                  .doc = "weight of the change of (u,v) between neighbours against the template; a "
                         "point's distance from the surface has weight 1"},
        o.bunching);
  visit(FieldInfo{.name = "distortion",
                  .min = 0,
                  .max = 1e3,
                  .doc = "weight of the change of distances between neighbours against the "
                         "template"},
        o.distortion);
  visit(FieldInfo{.name = "crease",
                  .min = 0,
                  .max = 1e3,
                  .doc = "weight of the difference of normals between neighbours, times their "
                         "distance"},
        o.crease);
}

// The points keep their (u,v).
struct NoRelaxation {
  static constexpr std::string_view kName = "none";
};
template <class Visitor>
void Fields(Visitor&, NoRelaxation&) {}

// After each step of the schedule the points move towards their nearest points of the surface.
struct FootpointRelaxation : PointMoves {
  static constexpr std::string_view kName = "footpoint";
};

// All penalties count, and a fit of the level follows each round of moves.
struct AlternatingRelaxation : NetworkMoves {
  static constexpr std::string_view kName = "alternating";
};

// Alternating rounds, and then fits in which the points may slide along the surface
// (TangentPointTerm), each followed by a round of moves.
struct TangentDistanceRelaxation : NetworkMoves {
  static constexpr std::string_view kName = "tangent_distance";
  int tangent_rounds = 3;
  double tangential = 0.1;
};
template <class Visitor>
void Fields(Visitor& visit, TangentDistanceRelaxation& o) {
  Fields(visit, static_cast<NetworkMoves&>(o));
  visit(FieldInfo{.name = "tangent_rounds",
                  .min = 1,
                  .max = 100,
                  .doc = "number of sliding fits after the alternating rounds"},
        o.tangent_rounds);
  visit(
      FieldInfo{.name = "tangential",
                .min = 0,
                .max = 1,
                .doc = "cost of a misfit along the surface in a sliding fit, relative to one along "
                       "its normal"},
      o.tangential);
}

// Each round moves (u,v) and vertices in one problem (joint_relaxation.h); a fit of the level
// follows.
struct JointRelaxation : NetworkMoves {
  static constexpr std::string_view kName = "joint";
};

using Relaxation = std::variant<NoRelaxation, FootpointRelaxation, AlternatingRelaxation,
                                TangentDistanceRelaxation, JointRelaxation>;

// The moves of a relaxation, with zero weights for penalties that its mode ignores; nothing for
// NoRelaxation.
std::optional<NetworkMoves> EffectiveMoves(const Relaxation& relaxation);

// Makes the network of the points in the template. It has links only if the barrier or a weight
// needs them.
DowelMesh MakeNetwork(const HSplineSurface& rest, const FitTarget& target,
                      const NetworkMoves& moves);

// Mean penalties without their weights, mm^2. a and b are neighbours, and d is their distance in
// the template.
struct RelaxationPenalties {
  double distance = kNaN;    // mean of |S(u,v) - p|^2 over the points
  double bunching = kNaN;    // mean squared change of the (u,v) between a and b, in mm
  double distortion = kNaN;  // mean of (|S_a - S_b| - d)^2
  double crease = kNaN;      // mean of |n_a - n_b|^2 d^2
  double standard = kNaN;    // mean squared way of standard landmarks from the template's (u,v)
};

struct RelaxationSummary {
  RelaxationPenalties before, after;
  double max_move_mm = 0;   // of a point between two fits
  int flips_prevented = 0;  // triangles that whole steps would have turned over
  int steps_shortened = 0;  // steps of single points that were shortened for this reason
};

// The penalties that Relax measures; the others are NaN.
struct MeasuredPenalties {
  bool before = true, after = true;
};

// Moves the (u,v) of the target's points on a fixed surface. In each round every corner takes a
// damped Gauss-Newton step of its penalties, shortened until the penalties fall and no triangle
// turns over. `mesh` was made from the points in the template `rest`, in their order. Without links
// a point may cross u = 0 of a closed surface.
RelaxationSummary Relax(const HSplineSurface& surface, const HSplineSurface& rest,
                        const DowelMesh& mesh, const NetworkMoves& moves, FitTarget& target,
                        const MeasuredPenalties& measured = {});

}  // namespace semblance::fitting
