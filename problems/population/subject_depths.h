// SPDX-License-Identifier: GPL-3.0-or-later
// Measures the tissue depths of one subject: at its sites and over its whole skull.
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "problems/population/population_file.h"
#include "problems/subject/propose/mean_skull.h"
#include "problems/subject/propose/reference_head.h"

namespace semblance::problems {

struct SiteDepth {
  std::string site;
  double depth_mm = kNaN;    // NaN: not measured
  double confidence = kNaN;  // probability that a proposed landmark is within 3 mm; a person's: 1
  std::string why_not;       // the reason if there is no depth
};

// Depths on the grid of DenseOptions, cell i + columns j.
struct DenseDepths {
  int columns = 0, rows = 0;
  std::vector<Vec3> bone;        // in the frame of the average skull, mm; NaN without bone
  std::vector<double> depth_mm;  // NaN without a depth
};

struct SubjectDepths {
  std::string name;
  bool proposed = false;  // true if the program proposed the landmarks
  std::vector<SiteDepth> sites;
  DenseDepths dense;
  double thickness = kNaN;  // Phantom::thickness, of a phantom
  std::vector<std::string> notes;
};

// The heads from which the landmarks of a subject without landmarks are proposed.
struct LandmarkReferences {
  std::vector<ReferenceHead> heads;
  std::optional<MeanSkull> mean;  // used if there are no heads
};

// Measures a subject. Its landmarks, or proposed ones, are laid on the bone, and the depth there is
// measured to the skin that is visible from outside. `references` must not be empty if the subject
// has no landmarks. The skull of a volume is upright, because its header says how the person lay.
// If several proposed landmarks have the same point (landmark_mistakes.h), the one with the highest
// confidence counts; the others become sites without a depth. Throws InputError as LoadSubject,
// CheckSubject and ProposeLandmarks, for a subject with a fault, and for one without a skin; throws
// Cancelled. The messages do not contain the subject's name; the caller adds it.
SubjectDepths MeasureSubject(const PopulationSubject& subject, const MeasureOptions& options,
                             const LandmarkReferences& references, const RunContext& context);

nlohmann::ordered_json ToJson(const SubjectDepths& depths);

// Throws IoError if the tree is not one that ToJson writes.
SubjectDepths ParseSubjectDepths(const nlohmann::ordered_json& json);

}  // namespace semblance::problems
