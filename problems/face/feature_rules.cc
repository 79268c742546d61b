// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/feature_rules.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <span>
#include <utility>

#include "interp/dowels/dowel.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

constexpr int kFirstFeature = 28, kRuleFeatures = 41;  // of Multi-PIE
// The sources of these values are stated with the options.
constexpr double kEyeBelowMargin = 0.441;  // of the orbit's height
constexpr double kExophthalmosMm = 16.2;   // mean
constexpr double kCanineShare = 0.758;     // of the mouth's width
constexpr double kSubnasaleMm = 13.5;      // in front of ss

// Landmarks of Multi-PIE, by side.
struct EyeLandmarks {
  const char* side;
  std::array<int, 6> all;      // both corners and four points of the lids
  std::array<int, 4> margins;  // of the lids, clear of the corners
};
constexpr EyeLandmarks kEyes[] = {{"r", {37, 38, 39, 40, 41, 42}, {38, 39, 41, 42}},
                                  {"l", {43, 44, 45, 46, 47, 48}, {44, 45, 47, 48}}};
struct MouthCorner {
  const char* side;
  int landmark;
  double sign;  // of the lateral axis
};
constexpr MouthCorner kCorners[] = {{"r", 49, -1}, {"l", 55, 1}};
constexpr int kPronasale = 31, kSubnasale = 34;

class RuleBook {
 public:
  RuleBook(std::map<std::string, Vec3> bone, const Similarity& pose, const FacePrior& prior)
      : bone_(std::move(bone)), prior_(prior), query_(prior.model.mean) {
    left_ = pose.rotation * Vec3::UnitX();
    front_ = pose.rotation * -Vec3::UnitY();
    up_ = pose.rotation * Vec3::UnitZ();
  }

  void EyeHeight(const RuleUse& rule);
  void EyeProtrusion(const RuleUse& rule);
  void MouthWidth(const RuleUse& rule);
  void Pronasale(const RuleUse& rule);
  void Subnasale(const RuleUse& rule);
  RuleMarks Take() { return std::move(result_); }

 private:
  const Vec3* Bone(const std::string& code) const {
    const auto found = bone_.find(code);
    return found == bone_.end() ? nullptr : &found->second;
  }

  std::vector<ModelPoint> FacePoints(std::span<const int> landmarks) const {
    std::vector<ModelPoint> points;
    for (const int n : landmarks) {
      const MeshPoint at = query_.Closest(prior_.features.at(n - kFirstFeature).position);
      points.push_back({at.triangle, at.weights});
    }
    return points;
  }

  void Add(AppliedRule rule, std::span<const int> landmarks, const Vec3& position,
           const Vec3& direction) {
    result_.marks.push_back({.label = rule.rule + " of " + rule.point,
                             .at = FacePoints(landmarks),
                             .position = position,
                             .direction = direction,
                             .sd_mm = rule.sd_mm});
    result_.rules.push_back(std::move(rule));
  }

  std::map<std::string, Vec3> bone_;
  const FacePrior& prior_;
  MeshQuery query_;
  Vec3 left_, front_, up_;
  RuleMarks result_;
};

void RuleBook::EyeHeight(const RuleUse& rule) {
  for (const EyeLandmarks& eye : kEyes) {
    const Vec3* const upper = Bone(fmt::format("mso_{}", eye.side));
    const Vec3* const lower = Bone(fmt::format("mio_{}", eye.side));
    if (upper != nullptr && lower != nullptr) {
      Add({.rule = "eye_height",
           .point = fmt::format("eye_{}", eye.side),
           .coordinate = "height",
           .source = "Guyomarc'h et al. 2012; error: Humphrey et al. 2026, 58 CT",
           .sd_mm = rule.sd_mm},
          eye.all, *upper + kEyeBelowMargin * (*lower - *upper), up_);
    }
  }
}

void RuleBook::EyeProtrusion(const RuleUse& rule) {
  for (const EyeLandmarks& eye : kEyes) {
    if (const Vec3* const margin = Bone(fmt::format("dlom_{}", eye.side))) {
      Add({.rule = "eye_protrusion",
           .point = fmt::format("eye_{}", eye.side),
           .coordinate = "front",
           .source = "mean exophthalmos: Humphrey et al. 2026, 58 CT",
           .sd_mm = rule.sd_mm},
          eye.margins, *margin + kExophthalmosMm * front_, front_);
    }
  }
}

void RuleBook::MouthWidth(const RuleUse& rule) {
  const Vec3 *const right = Bone("uc_r"), *const left = Bone("uc_l");
  if (right == nullptr || left == nullptr) {
    return;
  }
  const double half_mm = (*left - *right).dot(left_) / kCanineShare / 2;
  for (const MouthCorner& corner : kCorners) {
    // Independent errors of this size at both corners add up to one of sd_mm in the width.
    Add({.rule = "mouth_width",
         .point = fmt::format("ch_{}", corner.side),
         .coordinate = "side",
         .source = "Stephan & Henneberg 2003, 93 adults; error: Stephan & Murphy 2008, 9 cadavers",
         .sd_mm = rule.sd_mm / std::sqrt(2)},
        std::array{corner.landmark}, (*left + *right) / 2 + corner.sign * half_mm * left_,
        corner.sign * left_);
  }
}

void RuleBook::Pronasale(const RuleUse& rule) {
  const Vec3 *const n = Bone("n"), *const pr = Bone("pr"), *const rhi = Bone("rhi"),
                    *const ans = Bone("ans"), *const ss = Bone("ss");
  if (n == nullptr || pr == nullptr || rhi == nullptr || ans == nullptr || ss == nullptr) {
    return;
  }
  const Vec3 down = (*pr - *n).normalized(),
             front = left_.cross(down).normalized() * (left_.cross(down).dot(front_) > 0 ? 1 : -1);
  const Vec3 tip =
      *n + (0.83 * (*rhi - *ss).norm() - 3.5) * front + (0.9 * (*n - *ans).norm() - 2) * down;
  const char* const source =
      "Rynn et al. 2010, 79 CT and 60 cephalograms; error: Zednikova Mala 2013, 86 Czechs";
  Add({"pronasale", "prn", "front", source, rule.sd_mm}, std::array{kPronasale}, tip, front);
  Add({"pronasale", "prn", "height", source, rule.sd_mm}, std::array{kPronasale}, tip, -down);
}

void RuleBook::Subnasale(const RuleUse& rule) {
  if (const Vec3* const ss = Bone("ss")) {
    Add({.rule = "subnasale",
         .point = "sn",
         .coordinate = "front",
         .source = "T-Table 2023: Hona & Stephan 2024",
         .sd_mm = rule.sd_mm},
        std::array{kSubnasale}, *ss + kSubnasaleMm * front_, front_);
  }
}

// The distance of a point to the left of the middle of an average skull, mm of the subject.
double LeftOfMiddle_mm(const Vec3& p, const Similarity& skull_from_average) {
  return (skull_from_average.rotation * Vec3::UnitX()).dot(p - skull_from_average * Vec3::Zero());
}

// Empty if the point lies on the side that its name states, or near the middle, whose place is not
// known well enough.
std::string DescribeWrongSide(const std::string& code, const Vec3& p, const Similarity& pose) {
  constexpr double kMiddle_mm = 5;  // closer points are accepted on either side
  const Side side = SideOfSite(code);
  if (side == Side::kMidline) {
    return "";
  }
  const bool left = side == Side::kLeft;
  const double left_mm = LeftOfMiddle_mm(p, pose), own_mm = left ? left_mm : -left_mm;
  return own_mm >= -kMiddle_mm
             ? ""
             : fmt::format(
                   "rules.points.{}: it lies {:.0f} mm to the {} of the skull's middle; exchange "
                   "_l and _r, or correct the point (LPS: +x is the subject's left)",
                   code, -own_mm, left ? "right" : "left");
}

bool HasMultiPie(const FacePrior& prior) { return prior.features.size() == kRuleFeatures; }

struct RuleEntry {
  const char* name;
  const RuleUse& use;
  void (RuleBook::*apply)(const RuleUse&);
  std::vector<std::string> points;     // of bone that the rule needs
  std::vector<std::string> or_points;  // of the other side, if the rule applies to each side alone
};

std::vector<RuleEntry> ListRules(const FeatureRules& rules) {
  return {
      {"eye_height",
       rules.eye_height,
       &RuleBook::EyeHeight,
       {"mso_r", "mio_r"},
       {"mso_l", "mio_l"}},
      {"eye_protrusion", rules.eye_protrusion, &RuleBook::EyeProtrusion, {"dlom_r"}, {"dlom_l"}},
      {"mouth_width", rules.mouth_width, &RuleBook::MouthWidth, {"uc_l", "uc_r"}, {}},
      {"pronasale", rules.pronasale, &RuleBook::Pronasale, {"n", "pr", "rhi", "ans", "ss"}, {}},
      {"subnasale", rules.subnasale, &RuleBook::Subnasale, {"ss"}, {}}};
}

bool IsOn(const RuleUse& rule) { return rule.use.value_or(/*default_value=*/true); }
bool IsRequested(const RuleUse& rule) { return rule.use.value_or(/*default_value=*/false); }

bool IsRulePoint(const std::string& code) {
  return std::ranges::find(RulePointCodes(), code) != RulePointCodes().end();
}

// The points of `needed` that are neither among the landmarks nor under rules.points.
std::vector<std::string> FindMissing(const std::vector<std::string>& needed,
                                     const FeatureRules& rules,
                                     const std::map<std::string, Vec3>& landmarks) {
  std::vector<std::string> lacking;
  std::ranges::copy_if(needed, std::back_inserter(lacking), [&](const std::string& code) {
    return !landmarks.contains(code) && !rules.points.contains(code);
  });
  return lacking;
}

// Names the missing points and the place to give them.
std::string DescribeMissing(std::vector<std::string> lacking) {
  const auto marked = std::ranges::stable_partition(lacking, &IsRulePoint);
  const std::span<const std::string> given(lacking.begin(), marked.begin());
  std::vector<std::string> words;
  if (!given.empty()) {
    words.push_back(fmt::format("{} under rules.points", fmt::join(given, ", ")));
  }
  if (!marked.empty()) {
    words.push_back(fmt::format("{} among the landmarks", fmt::join(marked, ", ")));
  }
  return fmt::format("{}", fmt::join(words, " and "));
}

// The reason why a rule does not apply, or not on both sides. Empty if it does.
std::string ExplainRule(const RuleEntry& rule, const FeatureRules& rules,
                        const std::map<std::string, Vec3>& landmarks) {
  std::vector<std::string> lacking = FindMissing(rule.points, rules, landmarks);
  const std::vector<std::string> other = FindMissing(rule.or_points, rules, landmarks);
  const bool applies = lacking.empty() || (!rule.or_points.empty() && other.empty());
  lacking.insert(lacking.end(), other.begin(), other.end());
  return lacking.empty() ? ""
                         : fmt::format("it lacks {}: it {}", DescribeMissing(std::move(lacking)),
                                       applies ? "applies to one side alone" : "does not apply");
}

std::string NoteOnPrior(const FacePrior& prior) {
  return fmt::format(
      "rules: the prior has {} landmarks, and rules need {}, nose, eyes and mouth of Multi-PIE (28 "
      "to 68): none applies; make the prior again with all of them",
      prior.features.size(), kRuleFeatures);
}

}  // namespace

const std::vector<std::string>& RulePointCodes() {
  static const std::vector<std::string> codes = {"dlom_l", "dlom_r", "uc_l", "uc_r", "ans", "ss"};
  return codes;
}

std::vector<OptionFault> CheckRules(const FeatureRules& rules) {
  std::vector<OptionFault> faults;
  for (const auto& [code, point] : rules.points) {
    if (std::ranges::find(RulePointCodes(), code) == RulePointCodes().end()) {
      faults.push_back({"points." + code, fmt::format("no rule needs '{}'; known: {}", code,
                                                      fmt::join(RulePointCodes(), ", "))});
    }
  }
  return faults;
}

bool RequestsRule(const FeatureRules& rules) {
  return std::ranges::any_of(ListRules(rules),
                             [](const RuleEntry& rule) { return IsRequested(rule.use); });
}

std::vector<std::string> CheckRulePoints(const FeatureRules& rules, const MeshQuery& skull,
                                         const Similarity* skull_from_average,
                                         const PlaceOptions& options) {
  std::vector<std::string> mistakes;
  for (const auto& [code, point] : rules.points) {
    const Vec3 p(point[0], point[1], point[2]);
    const double off_mm = skull.Closest(p).distance_mm;
    std::string side =
        skull_from_average == nullptr ? "" : DescribeWrongSide(code, p, *skull_from_average);
    if (!(off_mm <= options.max_distance_mm)) {
      mistakes.push_back(
          fmt::format("rules.points.{}: it is {:.1f} mm from the skull, and at most {} mm are "
                      "allowed (landmarks.max_distance_mm); correct the point (mm, LPS)",
                      code, off_mm, options.max_distance_mm));
    } else if (!side.empty()) {
      mistakes.push_back(std::move(side));
    }
  }
  return mistakes;
}

RuleMarks ApplyRules(const FeatureRules& rules, std::map<std::string, Vec3> landmarks,
                     const Similarity& skull_from_average, const FacePrior& prior) {
  if (!HasMultiPie(prior)) {
    return {};
  }
  for (const auto& [code, p] : rules.points) {
    landmarks[code] = {p[0], p[1], p[2]};
  }
  RuleBook book(std::move(landmarks), skull_from_average, prior);
  for (const RuleEntry& rule : ListRules(rules)) {
    if (IsOn(rule.use)) {
      (book.*rule.apply)(rule.use);
    }
  }
  return book.Take();
}

std::vector<std::string> ExplainUnusedRules(const FeatureRules& rules,
                                            const std::map<std::string, Vec3>& landmarks,
                                            bool is_posed, const FacePrior* prior) {
  const std::vector<RuleEntry> entries = ListRules(rules);
  if (prior != nullptr && !HasMultiPie(*prior)) {
    const bool any = std::ranges::any_of(entries, [](const RuleEntry& r) { return IsOn(r.use); });
    return any ? std::vector{NoteOnPrior(*prior)} : std::vector<std::string>();
  }
  const std::string apart = prior == nullptr ? "the face uses no prior: it does not apply"
                            : !is_posed      ? "the skull's pose is not known: it does not apply"
                                             : "";
  std::vector<std::string> notes;
  for (const RuleEntry& rule : entries) {
    const std::string why = apart.empty() ? ExplainRule(rule, rules, landmarks) : apart;
    if (IsRequested(rule.use) && !why.empty()) {
      notes.push_back(fmt::format("rules.{} is on, and {}", rule.name, why));
    }
  }
  return notes;
}

}  // namespace semblance::problems
