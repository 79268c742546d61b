// SPDX-License-Identifier: GPL-3.0-or-later
// A person's decisions at the workbench as a plain value, and the history of such values. All else
// (the faces, the folder's other files) follows from the state and from the files that the
// workbench began with.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "problems/face/edit_script.h"
#include "problems/subject/landmarks.h"
#include "surfaces/base/fields.h"

namespace semblance::problems {

// A landmark with the fields of Landmark (landmarks.h).
struct BenchLandmark {
  std::string site;
  std::array<double, 3> point = {kNaN, kNaN, kNaN};  // mm, LPS
  std::optional<std::array<double, 3>> normal = {};
  std::optional<double> depth_along_normal_mm = {};
  std::optional<double> depth_closest_mm = {};
  Certainty certainty = Certainty::kMedium;
  std::optional<double> doubt_mm = {};  // expected error of a proposed point
  std::string note = {};
  bool proposed = false;  // by the program, and no person has confirmed it

  // True if a person has to confirm this point by itself: 5 mm is twice the error of the other
  // proposed points, and moves the face by about a millimetre. A point without a doubt is doubtful
  // if its certainty is low.
  bool IsDoubtful() const {
    constexpr double kDoubtful_mm = 5;
    return proposed && (doubt_mm ? *doubt_mm > kDoubtful_mm : certainty == Certainty::kLow);
  }
};

struct BenchAbsent {
  std::string site;
  std::string reason;
};

// One option whose value differs from the file `BenchState::start`.
struct BenchSetting {
  std::string path;   // "tissue.build", as --set takes it
  std::string value;  // in YAML, on one line
};

struct BenchState {
  std::string subject;  // name of the head
  std::vector<BenchLandmark> landmarks;
  std::vector<BenchAbsent> absent;
  std::string start = "start.yaml";    // file of the folder: the options that settings change
  std::vector<BenchSetting> settings;  // in the order in which they apply
  EditScript edits;                    // of the recovered face
};

template <class Visitor>
void Fields(Visitor& visit, BenchLandmark& o) {
  visit(FieldInfo{.name = "site", .doc = "code of the site"}, o.site);
  visit(FieldInfo{.name = "point", .unit = "mm", .doc = "on the bone, LPS"}, o.point);
  visit(FieldInfo{.name = "normal", .doc = "unit, out of the bone"}, o.normal);
  visit(FieldInfo{.name = "depth_along_normal_mm", .unit = "mm", .min = 0.01, .max = 100},
        o.depth_along_normal_mm);
  visit(FieldInfo{.name = "depth_closest_mm", .unit = "mm", .min = 0.01, .max = 100},
        o.depth_closest_mm);
  visit(FieldInfo{.name = "certainty", .doc = "of the position"}, o.certainty);
  visit(FieldInfo{.name = "doubt_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 1000,
                  .doc = "expected error of a proposed point"},
        o.doubt_mm);
  visit(FieldInfo{.name = "note", .doc = "remark of the observer"}, o.note);
  visit(FieldInfo{.name = "proposed", .doc = "by the program, not confirmed"}, o.proposed);
}

template <class Visitor>
void Fields(Visitor& visit, BenchAbsent& o) {
  visit(FieldInfo{.name = "site", .doc = "code of the site"}, o.site);
  visit(FieldInfo{.name = "reason", .doc = "why it cannot be placed"}, o.reason);
}

template <class Visitor>
void Fields(Visitor& visit, BenchSetting& o) {
  visit(FieldInfo{.name = "path", .doc = "of the option"}, o.path);
  visit(FieldInfo{.name = "value", .doc = "in YAML"}, o.value);
}

template <class Visitor>
void Fields(Visitor& visit, BenchState& o) {
  visit(FieldInfo{.name = "subject", .doc = "name of the head"}, o.subject);
  visit(FieldInfo{.name = "landmarks", .doc = "the placed landmarks"}, o.landmarks);
  visit(FieldInfo{.name = "absent", .doc = "sites that cannot be placed"}, o.absent);
  visit(FieldInfo{.name = "start", .doc = "file of the folder with the options to start from"},
        o.start);
  visit(FieldInfo{.name = "settings", .doc = "options that differ from start"}, o.settings);
  visit(FieldInfo{.name = "edits", .doc = "made by hand on the face"}, o.edits);
}

// The standard sites that a person has placed or confirmed.
std::vector<SitePoint> ConfirmedSites(const BenchState& state);

// The landmarks in the form of a landmark file. The file is marked `proposed` if any landmark is.
LandmarkFile ToLandmarkFile(const BenchState& state);

// The name that EnumNames gives to the value.
template <class Enum>
std::string_view EnumWord(Enum value) {
  constexpr auto kNames = EnumNames(Enum{});
  return kNames.at(static_cast<std::size_t>(value));
}

struct BenchStep {
  std::string what;  // description of the action, for people
  BenchState state;  // after the action
};

// A list of states with a cursor. Undo and redo move the cursor and change nothing else.
struct BenchHistory {
  std::vector<BenchStep> steps;  // never empty; the oldest first
  int now = 0;                   // index of the current step; redo reaches the later ones
};

// Longer histories drop their oldest steps. The value bounds the size of workbench.yaml.
inline constexpr int kMaxHistorySteps = 100;

inline const BenchState& CurrentState(const BenchHistory& history) {
  return history.steps[static_cast<std::size_t>(history.now)].state;
}

BenchHistory BeginHistory(BenchState state);

// Adds a step after the current one and makes it the current step. The steps that redo could reach
// are dropped.
BenchHistory AddStep(BenchHistory history, std::string what, BenchState state);

bool CanUndo(const BenchHistory& history);
bool CanRedo(const BenchHistory& history);

// Return the history unchanged if there is nothing to undo or to redo.
BenchHistory Undone(BenchHistory history);
BenchHistory Redone(BenchHistory history);

// Convert to YAML and back. Each step but the first stores only the edits that differ from the
// step before. HistoryFromText throws ConfigError for a text that is no history.
std::string HistoryText(const BenchHistory& history);
BenchHistory HistoryFromText(std::string_view text, const std::string& name);

}  // namespace semblance::problems
