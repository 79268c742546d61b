// SPDX-License-Identifier: GPL-3.0-or-later
// Rules of the literature for what no tissue depth reaches: eyes, mouth, nose. Each predicts a
// point of the face from the bone, and is one weighted observation of the prior.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "problems/config/config_errors.h"
#include "problems/prior/face_prior.h"
#include "problems/subject/dowel_placement.h"
#include "surfaces/base/fields.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance {

struct RuleUse {
  // true: asked for; false: left out; none: on where its points are there.
  std::optional<bool> use = std::nullopt;
  double sd_mm = kNaN;  // of what the rule predicts
};
template <class Visitor>
void Fields(Visitor& visit, RuleUse& o) {
  visit(FieldInfo{.name = "use",
                  .doc = "true asks for the rule, and a note says what it lacks where it cannot "
                         "apply; false leaves it out; null: it is on where its points are there"},
        o.use);
  visit(FieldInfo{.name = "sd_mm",
                  .unit = "mm",
                  .min = 0.01,
                  .max = 1000,
                  .doc = "standard deviation of what the rule predicts"},
        o.sd_mm);
}

// Left out, for no source states their coefficients in reach: nasal width (Rynn et al. 2010), lip
// height and the oral regressions (Stephan & Henneberg 2003, Houlton et al. 2021). Left out as
// measured worst on skulls: Krogman's rules, mental foramina (Stephan & Murphy 2008).
struct FeatureRules {
  std::map<std::string, std::array<double, 3>> points;    // of bone, mm, LPS, by RulePointCodes()
  RuleUse eye_height = {.sd_mm = 1.6};                    // of the middle of the lids, in the orbit
  RuleUse eye_protrusion = {.use = false, .sd_mm = 2.9};  // of the lids, out of it
  RuleUse mouth_width = {.sd_mm = 3.8};                   // between the mouth's corners
  RuleUse pronasale = {.use = false, .sd_mm = 3};         // the tip of the nose
  RuleUse subnasale = {.use = false, .sd_mm = 3.5};       // where nose and upper lip meet
};
template <class Visitor>
void Fields(Visitor& visit, FeatureRules& o) {
  visit(
      FieldInfo{.name = "points",
                .unit = "mm",
                .doc = "points of the bone (LPS) that only rules ask for, by name: dlom_l, dlom_r "
                       "(deepest point of the lateral margin of the orbit), uc_l, uc_r (lateral "
                       "border of the upper canine's crown), ans (acanthion, tip of the nasal "
                       "spine), ss (subspinale); a rule is on when its points are there"},
      o.points);
  visit(FieldInfo{.name = "eye_height",
                  .doc = "the middle of the lids lies 44.1 % of the orbit's height (mso to mio) "
                         "below its upper margin (Guyomarc'h et al. 2012; standard error of 1.6 mm "
                         "on 58 CT: Humphrey et al. 2026)"},
        o.eye_height);
  visit(
      FieldInfo{
          .name = "eye_protrusion",
          .doc = "the lids' margins lie 16.2 mm in front of dlom, the mean exophthalmos "
                 "(standard error of 2.9 mm on 58 CT: Humphrey et al. 2026). Off, for with it each "
                 "of three heads was worse"},
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
                       "Off, for on three heads it was 3 to 6 mm too far in front"},
      o.pronasale);
  visit(FieldInfo{.name = "subnasale",
                  .doc = "the base of the nose lies 13.5 mm in front of ss (T-Table 2023, ss-sn', "
                         "standard deviation of 3.5 mm: Hona & Stephan 2024). Off, for on three "
                         "heads it was 5 mm too far behind to 1 mm in front"},
        o.subnasale);
}

// What rules may be given in `points`.
const std::vector<std::string>& RulePointCodes();

// An unknown name under `points`, as "points.NAME".
std::vector<OptionFault> FaultsOfRules(const FeatureRules& rules);

// Whether a rule is asked for (use: true), wherever its points are.
bool AsksForRule(const FeatureRules& rules);

// What is wrong with `points` on a subject's skull, a line each: one that is further from the bone
// than a landmark may be (options.max_distance_mm), and one on the other side of the head than its
// name says, as when _l and _r are exchanged. skull_from_average: as MarksOfRules; null where the
// pose is not known, and with it no side.
std::vector<std::string> MistakesOfRulePoints(const FeatureRules& rules, const MeshQuery& skull,
                                              const Similarity* skull_from_average,
                                              const PlaceOptions& options);

// A rule at work. One that predicts two coordinates appears twice.
struct AppliedRule {
  std::string rule;        // as in FeatureRules
  std::string point;       // of the face: eye_l, ch_r, prn, sn
  std::string coordinate;  // height, front, side
  std::string source;      // author, year, population
  double sd_mm = kNaN;
  double residual_mm = kNaN;  // from the face to what was predicted; > 0 up, in front, outwards
};

struct RuleMarks {
  std::vector<ShapeMark> marks;
  std::vector<AppliedRule> rules;  // one per mark
};

// The rules that are on and whose points are there. landmarks: of the skull, by site, mm.
// skull_from_average: the pose of the skull (average_skull.h), whose axes are up, front and side.
// None where the prior does not have 41 landmarks: those of nose, eyes and mouth by their number in
// Multi-PIE (28 to 68), which LoadPrior sees to for modes on a mesh, and `semblance prior` keeps.
RuleMarks MarksOfRules(const FeatureRules& rules, std::map<std::string, Vec3> landmarks,
                       const Similarity& skull_from_average, const FacePrior& prior);

// What keeps rules that are asked for (use: true) from applying, a line each; and what keeps all
// from it where the prior lacks landmarks. is_posed: whether the pose of the skull is known. prior:
// null where the face asks none.
std::vector<std::string> NotesOnRules(const FeatureRules& rules,
                                      const std::map<std::string, Vec3>& landmarks, bool is_posed,
                                      const FacePrior* prior);

}  // namespace semblance
