// SPDX-License-Identifier: GPL-3.0-or-later
// Moves the (u,v) of a fit's points over the surface, so that no hand has to (thesis 4.4).
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "fitting/problem/fit_target.h"
#include "surfaces/base/fields.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

class DowelMesh;  // dowel_mesh.h

// How points move in a round, and what stops them; of every mode.
struct PointMoves {
  int rounds = 3;          // after each step of the schedule
  double damping = 0.1;    // 0 takes whole Gauss-Newton steps
  double max_move_mm = 5;  // of a point, in a round
  double standard = 0;     // weight of standard landmarks' own (u,v)
  bool barrier = true;     // no triangle of the points' network turns over
  // Labels of points that stay at their (u,v), with all points at the same place. Not among the
  // options: a caller knows of its points which were placed by hand.
  std::vector<std::string> kept = {};
};
template <class Visitor>
void Fields(Visitor& visit, PointMoves& o) {
  visit(FieldInfo{.name = "rounds",
                  .min = 1,
                  .max = 100,
                  .doc = "moves of all points after each step of the schedule"},
        o.rounds);
  visit(FieldInfo{.name = "damping",
                  .min = 0,
                  .max = 100,
                  .doc = "resistance to any move, relative to the weights; 0 takes whole "
                         "Gauss-Newton steps"},
        o.damping);
  visit(FieldInfo{.name = "max_move_mm",
                  .unit = "mm",
                  .min = 1e-3,
                  .max = 100,
                  .doc = "longest move of a point on the surface in one round"},
        o.max_move_mm);
  visit(FieldInfo{.name = "standard",
                  .min = 0,
                  .max = 1e6,
                  .doc = "weight that holds points which are not seeded (the standard landmarks) "
                         "at the template's (u,v)"},
        o.standard);
  visit(FieldInfo{.name = "barrier",
                  .doc = "no triangle of the points' network in (u,v) may turn over; false for "
                         "points so dense that errors of (u,v) have changed their order"},
        o.barrier);
}

// The same, and what a point's neighbours in the network weigh against its distance from the
// surface, whose weight is 1. All penalties are in mm^2 of the surface, so that a weight means the
// same for every domain.
struct NetworkMoves : PointMoves {
  double bunching = 0.005;    // weight of the spacing in (u,v)
  double distortion = 0.005;  // weight of distances between neighbours
  double crease = 0;          // weight of bends between neighbours
};
template <class Visitor>
void Fields(Visitor& visit, NetworkMoves& o) {
  Fields(visit, static_cast<PointMoves&>(o));
  visit(FieldInfo{.name = "bunching",
                  .min = 0,
                  .max = 1e3,
                  .doc = "weight of the change of the (u,v) spacing between neighbours from the "
                         "template's; a point's distance from the surface has the weight 1"},
        o.bunching);
  visit(FieldInfo{.name = "distortion",
                  .min = 0,
                  .max = 1e3,
                  .doc = "weight of the change of distances on the surface between neighbours from "
                         "the template's"},
        o.distortion);
  visit(FieldInfo{.name = "crease",
                  .min = 0,
                  .max = 1e3,
                  .doc = "weight of the change of normal, times the distance, between neighbours"},
        o.crease);
}

// The points keep their (u,v).
struct NoRelaxation {
  static constexpr std::string_view kName = "none";
};
template <class Visitor>
void Fields(Visitor&, NoRelaxation&) {}

// After each step of the schedule the points move towards the nearest point of the surface.
struct FootpointRelaxation : PointMoves {
  static constexpr std::string_view kName = "footpoint";
};

// All weights count, and each round of moves is followed by another fit of the level.
struct AlternatingRelaxation : NetworkMoves {
  static constexpr std::string_view kName = "alternating";
};

// Alternating, then fits in which the points may slide along the surface, each followed by a move.
struct TangentDistanceRelaxation : NetworkMoves {
  static constexpr std::string_view kName = "tangent_distance";
  int tangent_rounds = 3;   // sliding fits, after the alternating rounds
  double tangential = 0.1;  // weight along the surface, against its normal
};
template <class Visitor>
void Fields(Visitor& visit, TangentDistanceRelaxation& o) {
  Fields(visit, static_cast<NetworkMoves&>(o));
  visit(FieldInfo{.name = "tangent_rounds",
                  .min = 1,
                  .max = 100,
                  .doc = "sliding fits after the alternating rounds"},
        o.tangent_rounds);
  visit(FieldInfo{.name = "tangential",
                  .min = 0,
                  .max = 1,
                  .doc = "what a misfit along the surface counts in a sliding fit, relative to one "
                         "along its normal"},
        o.tangential);
}

// Each round moves (u,v) and vertices in one problem (joint_relaxation.h), then fits the level.
struct JointRelaxation : NetworkMoves {
  static constexpr std::string_view kName = "joint";
};

using Relaxation = std::variant<NoRelaxation, FootpointRelaxation, AlternatingRelaxation,
                                TangentDistanceRelaxation, JointRelaxation>;

// The moves of one round or more, with the weights that count; nothing for NoRelaxation.
std::optional<NetworkMoves> MovesOf(const Relaxation& relaxation);

// The network of the points in the template; without links where no weight and no barrier needs it.
DowelMesh NetworkOf(const HSplineSurface& rest, const FitTarget& target, const NetworkMoves& moves);

// Mean penalties, mm^2, before their weights.
struct RelaxationPenalties {
  double distance = kNaN;  // |S(u,v) - p|^2
  double bunching = kNaN;  // of neighbours: change of the (u,v) between them, in mm of the surface
  double distortion = kNaN;  // of neighbours: change of the distance between them
  double crease = kNaN;      // of neighbours: |n_a - n_b|^2 d^2; d: the template's distance
  double standard = kNaN;    // of the standard landmarks: way from the template's (u,v)
};

struct RelaxationSummary {
  RelaxationPenalties before, after;
  double max_move_mm = 0;   // of a point between two fits
  int flips_prevented = 0;  // triangles that steps would have turned over
  int steps_shortened = 0;  // of single points in one round, for that
};

// Which penalties Relax measures; those it does not are NaN.
struct MeasuredPenalties {
  bool before = true, after = true;
};

// Moves the (u,v) of the points of `target` on the surface as it stands, each by a damped
// Gauss-Newton step of its penalties per round, shortened until they fall and no triangle turns
// over. `mesh` was made of the points in the template `rest`, in their order. Without links a point
// may pass u = 0 of a closed surface.
RelaxationSummary Relax(const HSplineSurface& surface, const HSplineSurface& rest,
                        const DowelMesh& mesh, const NetworkMoves& moves, FitTarget& target,
                        const MeasuredPenalties& measured = {});

}  // namespace semblance
