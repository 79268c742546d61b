// SPDX-License-Identifier: GPL-3.0-or-later
// Moves the (u,v) of a fit's points over the surface, so that no hand has to (thesis 4.4).
#pragma once

#include <array>
#include <span>
#include <string_view>
#include <vector>

#include "fitting/problem/fit_target.h"
#include "surfaces/base/fields.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

enum class RelaxationMode { kNone, kFootpoint, kAlternating, kTangentDistance, kJoint };
constexpr auto EnumNames(RelaxationMode) {
  return std::to_array<std::string_view>(
      {"none", "footpoint", "alternating", "tangent_distance", "joint"});
}

// What a point's move in (u,v) weighs against each other; all in mm on the surface, so that a
// weight means the same for every domain.
struct RelaxationOptions {
  RelaxationMode mode = RelaxationMode::kNone;
  int rounds = 3;
  double damping = 0.1;
  double max_move_mm = 5;
  double distance = 1;
  double bunching = 0.005;
  double distortion = 0.005;
  double crease = 0;
  double standard = 0;
  int tangent_rounds = 3;
  double tangential = 0.1;
  bool barrier = true;
};
template <class Visitor>
void Fields(Visitor& visit, RelaxationOptions& o) {
  visit(FieldInfo{.name = "mode",
                  .doc = "none: dowels keep their (u,v); footpoint: after each step of the "
                         "schedule they move towards the nearest point of the surface, and of the "
                         "other weights only `standard` counts; alternating: all weights count, "
                         "and each round of moves is followed by another fit of the level; "
                         "tangent_distance: alternating, then `tangent_rounds` fits in which the "
                         "points may slide along the surface, each followed by a move; joint: each "
                         "round moves (u,v) and vertices in one problem, then fits the level"},
        o.mode);
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
  visit(FieldInfo{.name = "distance",
                  .min = 0,
                  .max = 1e3,
                  .doc = "weight of the distance of a point from the surface at its (u,v)"},
        o.distance);
  visit(FieldInfo{.name = "bunching",
                  .min = 0,
                  .max = 1e3,
                  .doc = "weight of the change of the (u,v) spacing between neighbours from the "
                         "template's"},
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
  visit(FieldInfo{.name = "standard",
                  .min = 0,
                  .max = 1e6,
                  .doc = "weight that holds points which are not seeded (the standard landmarks) "
                         "at the template's (u,v)"},
        o.standard);
  visit(FieldInfo{.name = "tangent_rounds",
                  .min = 1,
                  .max = 100,
                  .doc = "of tangent_distance: sliding fits after the alternating rounds"},
        o.tangent_rounds);
  visit(FieldInfo{.name = "tangential",
                  .min = 0,
                  .max = 1,
                  .doc = "of tangent_distance: what a misfit along the surface counts in a sliding "
                         "fit against one along its normal"},
        o.tangential);
  visit(FieldInfo{.name = "barrier",
                  .doc = "no triangle of the points' network in (u,v) may turn over; false for "
                         "points so dense that errors of (u,v) have changed their order"},
        o.barrier);
}

// Mean penalties, mm^2, before their weights.
struct RelaxationPenalties {
  double distance = kNaN;  // |S(u,v) - p|^2
  double bunching = kNaN;  // of neighbours: change of the (u,v) between them, in mm of the surface
  double distortion =
      kNaN;                // of neighbours: change of the vector between them in the tangent plane
  double crease = kNaN;    // of neighbours: |n_a - n_b|^2 d^2; d: the template's distance
  double standard = kNaN;  // of the standard landmarks: way from the template's (u,v)
};

struct RelaxationSummary {
  RelaxationPenalties before, after;
  double max_move_mm = 0;   // of a point between two fits
  int flips_prevented = 0;  // triangles that steps would have turned over
  int steps_shortened = 0;  // of single points in one round, for that
};

enum class DowelLinks { kDelaunay, kNone };

// The triangles of the points' (u,v), Delaunay in mm of the template; they never turn over. Points
// of the same (u,v) share a corner. With a periodic u the network is cut at u = 0, which no point
// passes. Without links it is the points alone, each its own corner.
class DowelMesh {
 public:
  // template_surface: where `uv` are the points' places before any move. Needs no particular count
  // of points: fewer than three, or all on a line, have no triangles.
  DowelMesh(const HSplineSurface& template_surface, std::span<const Vec2> uv,
            DowelLinks links = DowelLinks::kDelaunay);
  const std::vector<std::array<int, 3>>& triangles() const { return triangles_; }
  const std::vector<std::array<int, 2>>& edges() const { return edges_; }
  // Point that stands for each; itself, or the first of the same (u,v).
  const std::vector<int>& corner() const { return corner_; }
  const std::vector<Vec2>& rest_uv() const { return rest_uv_; }
  const Vec2& lengths_mm() const { return lengths_mm_; }  // of the template along u and v
  // Triangles that are turned over, or have lost nearly all of their area.
  int Flips(std::span<const Vec2> uv) const;
  bool Turned(const std::array<int, 3>& triangle, std::span<const Vec2> uv) const;

 private:
  void Link(std::span<const Vec2> uv);

  std::vector<Vec2> rest_uv_;
  std::vector<int> corner_;
  std::vector<std::array<int, 3>> triangles_;
  std::vector<std::array<int, 2>> edges_;
  Vec2 lengths_mm_;
};

// The network of the points in the template; without links where no option needs one.
DowelMesh MeshOf(const HSplineSurface& rest, const FitTarget& target,
                 const RelaxationOptions& options);

// The largest angle between the surface's normals at two neighbours of the network, whose points
// are at uv; 0 without neighbours.
double SharpestCrease_deg(const HSplineSurface& surface, const DowelMesh& mesh,
                          std::span<const Vec2> uv);

// Moves the (u,v) of the points of `target` on the surface as it stands, each by a damped
// Gauss-Newton step of its penalties a round, shortened until they fall and no triangle turns over.
// `mesh` was made of the points in the template `rest`, in their order. The options' mode says
// which weights count, their rounds are the caller's. Without links a closed surface is passed
// round.
RelaxationSummary Relax(const HSplineSurface& surface, const HSplineSurface& rest,
                        const DowelMesh& mesh, const RelaxationOptions& options, int rounds,
                        FitTarget& target);

}  // namespace semblance
