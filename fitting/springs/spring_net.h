// SPDX-License-Identifier: GPL-3.0-or-later
// A face as a network of springs over the skull (thesis 5.3).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "fitting/solve/level_summary.h"
#include "surfaces/base/fields.h"
#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::fitting {

struct SpringOptions {
  double stretch = 0.3;
  double bend = 0.3;
  double reach_mm = 15;
  double max_angle_deg = 60;
  double clearance_mm = 1;
  int rounds = 10;
};
template <class Visitor>
void Fields(Visitor& visit, SpringOptions& o) {
  visit(FieldInfo{.name = "stretch",
                  .min = 1e-6,
                  .max = 1e6,
                  .doc = "stiffness of the springs between neighbours, along and across the "
                         "squares of the net, against the pull to the depth (1)"},
        o.stretch);
  visit(FieldInfo{.name = "bend",
                  .min = 0,
                  .max = 1e6,
                  .doc = "stiffness of the springs over one vertex, which resist folds and creases "
                         "(Provot 1995)"},
        o.bend);
  visit(FieldInfo{.name = "reach_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 200,
                  .doc = "a vertex farther than this from the implicit face is not held to it"},
        o.reach_mm);
  visit(FieldInfo{.name = "max_angle_deg",
                  .unit = "deg",
                  .min = 0,
                  .max = 180,
                  .doc = "a vertex is held only where net and implicit face face the same way, "
                         "within this angle"},
        o.max_angle_deg);
  visit(FieldInfo{.name = "clearance_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 100,
                  .doc = "least distance of a vertex outside the bone"},
        o.clearance_mm);
  visit(FieldInfo{.name = "rounds",
                  .min = 1,
                  .max = 1000,
                  .doc = "most rounds; each finds the points of implicit face and bone that are "
                         "closest to the vertices, and relaxes the springs"},
        o.rounds);
}

// The treatment of a vertex of the net.
enum class SpringHold {
  kHeld,   // drawn to the implicit face: it keeps the depth of the tissue
  kFree,   // moved by springs alone, as at eyes, nose and mouth, which no bone determines
  kLocked  // stays where it is, as at a depth marker or the edge of a feature
};

// columns x rows vertices in squares, u fastest. The normals du x dv point outward.
struct SpringNet {
  int columns = 0, rows = 0;
  std::vector<Vec3> vertices;  // mm; the start
  std::vector<Vec3> at_rest;   // mm; a net whose distances are the lengths of the springs at rest
  std::vector<SpringHold> holds;  // one per vertex
};

struct SpringSummary {
  std::vector<TermCosts> terms =
      {};  // springs, depth and bone, mm^2: before, and in the last round
  int rounds = -1;
  int iterations = -1;         // of Ceres in all rounds
  int held = -1;               // vertices that were drawn to the implicit face in the last round
  int locked = -1;             // vertices
  int pushed_out = -1;         // vertices that the last step moved out of the bone
  double last_move_mm = kNaN;  // largest move of a vertex in the last round
  double max_move_mm = kNaN;   // largest move of a vertex in all
  std::string termination = "not run";
  bool usable = false;  // false: a solve failed and the net is as it was before it
};

// Relaxes the net. In each round one ceres::Problem, whose blocks are the vertices that are not
// locked, makes least
//   sum over springs k (|a - b| - rest)^2 + sum over held vertices (n . (x - c))^2
//     + 100 sum over vertices max(0, clearance - m . (x - f))^2,
// where c is the point of `depth_mesh` closest to the vertex x at the start of the round, and n its
// normal there; f and m are those of `bone`. Springs run along the sides and diagonals of squares
// (stretch), and from each vertex to the second next along u and v (bend). The rounds end when no
// vertex moves by 0.01 mm. In the end vertices that still lie in the bone move to `clearance_mm`
// outside it. depth_mesh and bone: outward; either may lack triangles and is then left out.
//
// A net at rest in which nothing pulls stays as it is. A rigid motion of all inputs moves the
// result. One thread; the same input gives the same bytes. Throws InputError if the sizes of the
// net do not agree or it has fewer than two columns or rows; Cancelled.
SpringSummary RelaxSprings(const TriMesh& depth_mesh, const TriMesh& bone,
                           const SpringOptions& options, SpringNet& net, const RunContext& context);

}  // namespace semblance::fitting
