// SPDX-License-Identifier: GPL-3.0-or-later
// Rules of the literature for eyes, mouth and nose, which tissue depths do not determine. Each rule
// predicts a point of the face from the bone. The prior takes it as one weighted observation.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "problems/config/config_tree.h"
#include "problems/face/face_prior.h"
#include "problems/subject/dowel_placement.h"
#include "surfaces/base/fields.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {

struct RuleUse {
  std::optional<bool> use = std::nullopt;
  double sd_mm = kNaN;
};
template <class Visitor>
void Fields(Visitor& visit, RuleUse& o) {
  visit(
      FieldInfo{.name = "use",
                .doc = "true: the rule is requested, and a note states what it lacks if it cannot "
                       "apply; false: it is left out; null: it is on if its points are given"},
      o.use);
  visit(FieldInfo{.name = "sd_mm",
                  .unit = "mm",
                  .min = 0.01,
                  .max = 1000,
                  .doc = "standard deviation of the rule's prediction"},
        o.sd_mm);
}

// Some rules are missing because no accessible source states their coefficients: nasal width (Rynn
// et al. 2010), lip height and the oral regressions (Stephan & Henneberg 2003, Houlton et al.
// 2021). Krogman's rules and the mental foramina are missing because they measured worst on skulls
// (Stephan & Murphy 2008).
struct FeatureRules {
  std::map<std::string, std::array<double, 3>> points;  // of bone, mm, LPS, by RulePointCodes()
  RuleUse eye_height = {.sd_mm = 1.6};
  RuleUse eye_protrusion = {.use = false, .sd_mm = 2.9};
  RuleUse mouth_width = {.sd_mm = 3.8};
  RuleUse pronasale = {.use = false, .sd_mm = 3};
  RuleUse subnasale = {.use = false, .sd_mm = 3.5};
};
template <class Visitor>
void Fields(Visitor& visit, FeatureRules& o) {
  visit(FieldInfo{.name = "points",
                  .unit = "mm",
                  .doc = "points of the bone (LPS) that only rules need, by name: dlom_l, dlom_r "
                         "(deepest point of the lateral margin of the orbit), uc_l, uc_r (lateral "
                         "border of the upper canine's crown), ans (acanthion, tip of the nasal "
                         "spine), ss (subspinale); a rule is on if its points are given"},
        o.points);
  visit(FieldInfo{.name = "eye_height",
                  .doc = "the middle of the lids lies 44.1 % of the orbit's height (mso to mio) "
                         "below its upper margin (Guyomarc'h et al. 2012; standard error of 1.6 mm "
                         "on 58 CT: Humphrey et al. 2026)"},
        o.eye_height);
  visit(
      FieldInfo{.name = "eye_protrusion",
                .doc = "the lids' margins lie 16.2 mm in front of dlom, the mean exophthalmos "
                       "(standard error of 2.9 mm on 58 CT: Humphrey et al. 2026). Off, because it "
                       "made each of three heads worse"},
      o.eye_protrusion);
  visit(FieldInfo{.name = "mouth_width",
                  .doc = "the canines' width, uc_l to uc_r, is 75.8 % of the mouth's (Stephan & "
                         "Henneberg 2003, 93 adults; on 9 cadavers 2.4 mm too small: Stephan & "
                         "Murphy 2008; with a deviation of 3 mm for rules of this kind, 3.8 mm)"},
        o.mouth_width);
  visit(
      FieldInfo{.name = "pronasale",
                .doc = "the nose's tip lies 0.83 (rhi to ss) - 3.5 mm in front of the line from n "
                       "to pr and 0.9 (n to ans) - 2 mm down it (Rynn et al. 2010, 79 CT and 60 "
                       "cephalograms; on 86 Czechs off by at most 2.2 mm in the mean: Zednikova "
                       "Mala 2013, who give no deviation in their abstract: 3 mm is a guess). "
                       "Off, because on three heads it was 3 to 6 mm too far in front"},
      o.pronasale);
  visit(FieldInfo{.name = "subnasale",
                  .doc = "the base of the nose lies 13.5 mm in front of ss (T-Table 2023, ss-sn', "
                         "standard deviation of 3.5 mm: Hona & Stephan 2024). Off, because on "
                         "three heads it was between 5 mm too far behind and 1 mm too far in "
                         "front"},
        o.subnasale);
}

// The names that `points` may have.
const std::vector<std::string>& RulePointCodes();

// Unknown names under `points`, with the path "points.NAME".
std::vector<OptionFault> CheckRules(const FeatureRules& rules);

// True if a rule is requested (use: true), with or without its points.
bool RequestsRule(const FeatureRules& rules);

// The mistakes of `points` on a subject's skull, one line each: a point farther from the bone than
// a landmark may be (options.max_distance_mm), and a point on the other side of the head than its
// name states, as when _l and _r are exchanged. skull_from_average: as in ApplyRules; null if the
// pose is unknown, and then sides are not checked.
std::vector<std::string> CheckRulePoints(const FeatureRules& rules, const MeshQuery& skull,
                                         const Similarity* skull_from_average,
                                         const PlaceOptions& options);

// A rule that was applied. A rule that predicts two coordinates appears twice.
struct AppliedRule {
  std::string rule;        // as in FeatureRules
  std::string point;       // of the face: eye_l, ch_r, prn, sn
  std::string coordinate;  // height, front, side
  std::string source;      // author, year, population
  double sd_mm = kNaN;
  double residual_mm = kNaN;  // from the face to the prediction; > 0 up, in front, outwards
};

struct RuleMarks {
  std::vector<ShapeMark> marks;
  std::vector<AppliedRule> rules;  // one per mark
};

// The predictions of the rules that are on and whose points are given. landmarks: of the skull, by
// site, mm. skull_from_average: the pose of the skull (average_skull.h), which defines up, front
// and side. No rule applies unless the prior has 41 landmarks: those of nose, eyes and mouth, by
// their number in Multi-PIE (28 to 68). LoadPrior requires them for modes on a mesh, and `semblance
// prior` keeps them.
RuleMarks ApplyRules(const FeatureRules& rules, std::map<std::string, Vec3> landmarks,
                     const Similarity& skull_from_average, const FacePrior& prior);

// Explains why requested rules (use: true) do not apply, one line each, or why none does if the
// prior lacks landmarks. is_posed: whether the pose of the skull is known. prior: null if the face
// uses none.
std::vector<std::string> ExplainUnusedRules(const FeatureRules& rules,
                                            const std::map<std::string, Vec3>& landmarks,
                                            bool is_posed, const FacePrior* prior);

}  // namespace semblance::problems
