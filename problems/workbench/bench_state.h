// SPDX-License-Identifier: GPL-3.0-or-later
// What a person has decided at the workbench, as a plain value: all else follows from it and from
// the files that it began with.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "problems/edits/edit_script.h"
#include "problems/subject/landmarks.h"
#include "surfaces/base/fields.h"

namespace semblance {

// A landmark as Landmark (landmarks.h) has it, and whether a person has seen it.
struct BenchLandmark {
  std::string site;
  std::array<double, 3> point = {kNaN, kNaN, kNaN};  // mm, LPS
  std::optional<std::array<double, 3>> normal = {};
  std::optional<double> depth_along_normal_mm = {};
  std::optional<double> depth_closest_mm = {};
  Certainty certainty = Certainty::kMedium;
  std::string note = {};
  bool proposed = false;  // by the program, and no person has confirmed it
};

struct BenchAbsent {
  std::string site;
  std::string reason;
};

// An option that differs from the state's file of options.
struct BenchSetting {
  std::string path;   // "tissue.build", as --set takes it
  std::string value;  // in YAML, on one line
};

struct BenchState {
  std::string subject;  // whose skull it is
  std::vector<BenchLandmark> landmarks;
  std::vector<BenchAbsent> absent;
  std::string start = "start.yaml";    // file of the folder: the options that settings change
  std::vector<BenchSetting> settings;  // in the order in which they apply
  EditScript edits;                    // of the face that comes out
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
  visit(FieldInfo{.name = "note", .doc = "what the observer had to say"}, o.note);
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
  visit(FieldInfo{.name = "subject", .doc = "whose skull it is"}, o.subject);
  visit(FieldInfo{.name = "landmarks", .doc = "those that were placed"}, o.landmarks);
  visit(FieldInfo{.name = "absent", .doc = "those that cannot be placed"}, o.absent);
  visit(FieldInfo{.name = "start", .doc = "file of the folder: the options to start from"},
        o.start);
  visit(FieldInfo{.name = "settings", .doc = "options beside those of start"}, o.settings);
  visit(FieldInfo{.name = "edits", .doc = "made by hand on the face"}, o.edits);
}

// As the landmarks' file has them; `proposed` if one of them is.
LandmarkFile LandmarksOf(const BenchState& state);

}  // namespace semblance
