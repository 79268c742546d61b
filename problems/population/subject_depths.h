// SPDX-License-Identifier: GPL-3.0-or-later
// The tissue depths of one subject: at its sites, and all over its skull.
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "problems/population/population_file.h"
#include "problems/propose/reference_head.h"

namespace semblance {

struct SiteDepth {
  std::string site;
  double depth_mm = kNaN;    // NaN: not measured
  double confidence = kNaN;  // of a proposed landmark: that it is within 3 mm; 1 of a person's
  std::string why_not;       // in words, where there is no depth
};

// On the grid of DenseOptions, i + columns j.
struct DenseDepths {
  int columns = 0, rows = 0;
  std::vector<Vec3> bone;        // in the frame of the average skull, mm; NaN where there is none
  std::vector<double> depth_mm;  // NaN where there is none
};

struct SubjectDepths {
  std::string name;
  bool proposed = false;  // its landmarks, by the program
  std::vector<SiteDepth> sites;
  DenseDepths dense;
  double thickness = kNaN;  // of a phantom
  std::vector<std::string> notes;
};

// Measures a subject: its landmarks (or proposed ones) are laid on the bone, and the depth there is
// taken to the skin that is seen from outside. references: not empty if the subject has no
// landmarks. Of proposed landmarks on one point (landmark_mistakes.h) the surest counts; the others
// are sites without a depth. Throws InputError as LoadSubject, CheckSubject and ProposeLandmarks,
// and for a subject without a skin; Cancelled. The words leave the subject's name to the caller.
SubjectDepths MeasureSubject(const PopulationSubject& subject, const MeasureOptions& options,
                             std::span<const ReferenceHead> references, const RunContext& context);

nlohmann::ordered_json ToJson(const SubjectDepths& depths);

// Throws IoError for what is not such a tree.
SubjectDepths SubjectDepthsOf(const nlohmann::ordered_json& json);

}  // namespace semblance
