// SPDX-License-Identifier: GPL-3.0-or-later
// Judges a recovered face: a face that breaks a stated limit is not usable. Every face that the
// program makes is judged by JudgeFace, whatever way led to it.
#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "fitting/fit.h"
#include "interp/dowels/dowel.h"
#include "problems/subject/average_skull.h"
#include "problems/subject/mirror.h"
#include "surfaces/base/fields.h"
#include "surfaces/base/run_context.h"
#include "surfaces/hspline_query/tessellate.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

// The limits. docs/explanation/plausibility.md lists the values of correct faces from which each
// limit was chosen. A tighter limit finds smaller faults and refuses more correct faces.
struct PlausibilityLimits {
  double bone_depth_mm = 0.5;
  double bone_share = 0.1;
  double bone_most_mm = 4;
  double marker_mm = 10;
  double facing_share = 0.1;
  double template_factor = 1.6;
  double skull_factor = 2.2;
  double crease_share = 0.001;
  double crossing_share = 0.002;
  double unsolved_share = 0;
  double undetermined_share = 0.9;
  double direction_deg = 100;
  double depth_sds = 5;
  double depth_factor = 2.5;
  double depth_scatter = 1.7;
};
template <class Visitor>
void Fields(Visitor& visit, PlausibilityLimits& o) {
  visit(FieldInfo{.name = "bone_depth_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 100,
                  .doc = "bone counts as outside the face if it lies farther outside than this"},
        o.bone_depth_mm);
  visit(FieldInfo{.name = "bone_share",
                  .min = 0,
                  .max = 1,
                  .doc = "largest share of the outer bone under the face that may lie outside"},
        o.bone_share);
  visit(FieldInfo{.name = "bone_most_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 1000,
                  .doc = "greatest distance of bone outside the face; 50 mm2 of bone must lie that "
                         "far outside, so that a spike of metal near the teeth does not count"},
        o.bone_most_mm);
  visit(FieldInfo{.name = "marker_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 1000,
                  .doc = "greatest median distance from the depth markers' tips to the places of "
                         "the face that belong to them"},
        o.marker_mm);
  visit(FieldInfo{.name = "facing_share",
                  .min = 0,
                  .max = 1,
                  .doc = "largest share of depth markers at which the face shows its inner side to "
                         "the outside, as a mirrored or turned face does"},
        o.facing_share);
  visit(FieldInfo{.name = "template_factor",
                  .min = 1,
                  .max = 1000,
                  .doc = "greatest factor by which the face may be larger or smaller than the "
                         "placed generic face along an axis of the head"},
        o.template_factor);
  visit(FieldInfo{.name = "skull_factor",
                  .min = 1,
                  .max = 1000,
                  .doc = "greatest length of the face along an axis of the head, in parts of the "
                         "skull's greatest length"},
        o.skull_factor);
  visit(FieldInfo{.name = "crease_share",
                  .min = 0,
                  .max = 1,
                  .doc = "largest share of the face's area that is folded by more than 60 degrees "
                         "at an edge of the mesh, or turned by more than 75 degrees against the "
                         "generic face"},
        o.crease_share);
  visit(FieldInfo{.name = "crossing_share",
                  .min = 0,
                  .max = 1,
                  .doc = "largest share of the face's area in triangles that cut through another "
                         "part of it, less the generic face's own share"},
        o.crossing_share);
  visit(FieldInfo{.name = "unsolved_share",
                  .min = 0,
                  .max = 1,
                  .doc = "largest share of the fit's steps that may stop at the limit of "
                         "iterations"},
        o.unsolved_share);
  visit(FieldInfo{.name = "undetermined_share",
                  .min = 0,
                  .max = 1,
                  .doc = "largest share of the coarsest fitted level's control vertices that no "
                         "data determines"},
        o.undetermined_share);
  visit(FieldInfo{.name = "direction_deg",
                  .unit = "deg",
                  .min = 0,
                  .max = 180,
                  .doc = "greatest angle between a depth marker and the outward direction of the "
                         "skull around its base"},
        o.direction_deg);
  visit(FieldInfo{.name = "depth_sds",
                  .min = 0,
                  .max = 1000,
                  .doc = "greatest distance of a depth from the mean of the T-Table 2023, in its "
                         "standard deviations"},
        o.depth_sds);
  visit(FieldInfo{.name = "depth_factor",
                  .min = 1,
                  .max = 1000,
                  .doc = "greatest median factor between the depths and the means of that table, "
                         "either way; a factor of 10 or 25.4 means another unit"},
        o.depth_factor);
  visit(
      FieldInfo{.name = "depth_scatter",
                .min = 1,
                .max = 1000,
                .doc = "greatest scatter, as a factor, of these factors around their median: rows "
                       "in another order scatter by more"},
      o.depth_scatter);
}

struct PlausibilityCheck {
  std::string_view name;       // of its limit
  std::string_view unit = {};  // mm, deg or empty
  double value = kNaN;         // NaN: there is nothing to judge, or it was not judged
  double limit = kNaN;
  bool passed = false;
  std::string sentence = "the face was not judged";  // what was found, for people
  std::string remedy = {};                           // what to do if it has not passed
  Vec3 worst = Vec3::Constant(kNaN);  // the place where the value is worst; NaN: it has none
};

// Results start as failures: without JudgeFace no check has passed.
struct Plausibility {
  std::vector<PlausibilityCheck> checks = Unjudged({});

  static std::vector<PlausibilityCheck> Unjudged(const PlausibilityLimits& limits);
  // One line for each check that has not passed: the sentence, the limit and the remedy.
  std::vector<std::string> Faults() const;
};

// The input of JudgeFace, which must outlive the call. All meshes are in the subject's frame.
struct FaceToJudge {
  const HSplineSurface& surface;
  const Tessellation& face;       // of the surface
  const HSplineSurface& generic;  // the generic face, placed; of any shape
  const TriMesh& skull;
  std::span<const BoneOrigin> origin;  // of the skull's triangles; empty: all observed
  const TriMesh& shell;                // the outer shell of the skull
  std::span<const Dowel> dowels;       // on the bone
  const std::optional<SkullSites>& pose;
  const FitTarget& target;
  const FitResult& fit;
  bool is_person = true;  // the depths of a phantom are not compared with those of people
};

// Judges a face. A check without anything to judge passes, for example the depths if no marker is
// at a site of the table. Throws Cancelled.
Plausibility JudgeFace(const FaceToJudge& in, const PlausibilityLimits& limits,
                       const RunContext& context);

// {bone_share: {value, limit, unit, passed, sentence, fault, worst_mm}, ...}. fault: as in Faults,
// empty if the check has passed.
nlohmann::ordered_json PlausibilityToJson(const Plausibility& plausibility);

// The faults as marks of the 3-D view: [{text, fault, place}]; place: null if the fault has none.
// plausibility: as PlausibilityToJson makes it, or null for a face of an older version.
nlohmann::ordered_json FaultMarks(const nlohmann::ordered_json& plausibility);

}  // namespace semblance::problems
