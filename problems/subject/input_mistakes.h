// SPDX-License-Identifier: GPL-3.0-or-later
// Compares the inputs of one head with each other before anything runs: the skull with its skin, a
// face with another, points with a mesh. Finds the conversion that somebody forgot. Nothing is
// corrected here.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "problems/subject/landmarks.h"
#include "surfaces/mesh/mesh_query.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

struct InputMistakes {
  std::vector<std::string> errors;  // one line each; inputs with one cannot be used together
  std::vector<std::string> notes;   // findings that may be intended
};

// ---------------------------------------------------------------------------------------------
// Forgotten conversions
// ---------------------------------------------------------------------------------------------

// A conversion of points that people forget: p -> linear * p + shift.
struct FrameChange {
  std::string what;  // follows the name of the points: "x and y negated", "multiplied by 10"
  Mat3 linear = Mat3::Identity();
  Vec3 shift = Vec3::Zero();
  double factor = 1;      // by which it enlarges
  bool mirrored = false;  // exchanges left and right
  bool turned = false;    // exchanges or negates axes, without a mirror

  Vec3 operator()(const Vec3& p) const { return linear * p + shift; }
};

// Axes: the 23 turns that exchange and negate axes, first that between LPS and RAS. Units: cm, inch
// and metre, alone and with each turn. Mirror images along x, y and z, at 0 and at `middle`.
std::vector<FrameChange> ForgottenChanges(const Vec3& middle);

// The change that brings points nearest to a mesh, if their median distance is then at most
// within_mm. Only changes for which may_be is true are tried. middle: of the mesh.
struct FoundChange {
  FrameChange change;
  double median_mm = kNaN;
};
std::optional<FoundChange> FindForgottenChange(
    const std::vector<Vec3>& points, const MeshQuery& mesh, const Vec3& middle, double within_mm,
    const std::function<bool(const FrameChange&)>& may_be);

// Says in which frame a file is, and what to do. file_from_lps: its directions, e.g. x and y
// negated for RAS. The text follows the name of the file.
std::string DescribeFrame(const Mat3& file_from_lps);

// ---------------------------------------------------------------------------------------------
// Skull and skin
// ---------------------------------------------------------------------------------------------

// The distance by which the middle of an average triangle lies inside a head, in mm. Coarse meshes
// cannot tell smaller distances. It is a^2 / (6 R) for a triangle of side a on a ball of radius R,
// and R is 80 mm.
double SagittaOfTriangles_mm(const TriMesh& mesh);

// The cover of bone by skin along rays from all sides to the middle of the head. From below no ray
// counts, because skins end at the neck.
struct SkinCover {
  double met_share = 0;      // of the rays that meet bone, those that meet outer skin, too
  double bare_share = kNaN;  // of these, those that meet the bone more than 1 mm before the skin
  double median_mm = kNaN;   // depth of the bone under the skin; negative: outside
  double same_share = kNaN;  // bone and skin within 0.2 mm of each other
  double spread_mm = kNaN;   // median distance of the depths from their median
};

// Checks that the skin lies over the skull as skin does, and compares it with the depths that the
// landmark file states. Searches in this order, and a mistake ends the search:
//   same surface   More than half of the bone lies within 0.2 mm of the skin.
//   exchanged      The skin lies inside the skull, and the landmarks do not lie on the skull.
//   another frame  Bone lies outside the skin, or the skin is far away. Tries the forgotten
//                  conversions, a shift and a scale, and names the one that helps.
//   unusual cover  The skin lies over the bone, but thicker, thinner or more to one side than on
//                  any known head: a note.
//   depths         The depths of the landmark file are not those that skull and skin have there: a
//                  note; an error if they are those of the mirrored skin.
// Throws InputError if the skin has no triangle.
struct SkinInputs {
  const TriMesh& skin;
  const MeshQuery* skull = nullptr;  // null: only the landmarks on it are known
  Box3 extent = {};                  // of the skull
  const LandmarkFile& landmarks;
  bool landmarks_fit = true;  // false: they do not lie on the skull; only the first two are sought
};
InputMistakes FindSkinMistakes(const SkinInputs& inputs);

// ---------------------------------------------------------------------------------------------
// Two faces
// ---------------------------------------------------------------------------------------------

// Checks whether a face and the true skin lie on each other, as `evaluate` needs. An error if only
// a forgotten conversion brings them together; a note if they are far apart, with the scale, turn
// and shift that would help, and a note if they are one surface.
InputMistakes FindFaceMistakes(const TriMesh& face, const TriMesh& truth);

}  // namespace semblance::problems
