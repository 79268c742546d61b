// SPDX-License-Identifier: GPL-3.0-or-later
// What a person does at the workbench: each action makes a new state of an old one, and nothing
// else. Throws InputError for what cannot be meant; the old state is a value and stays.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "problems/pipeline/experiment.h"
#include "problems/workbench/bench_state.h"
#include "surfaces/base/geometry.h"

namespace semblance {

// Places the site, or moves it there; it is then a person's, and no longer absent. What was
// measured and noted there stays, the normal goes: it was that of the former place.
BenchState PlaceLandmark(BenchState state, const std::string& site, const Vec3& point);

BenchState RemoveLandmark(BenchState state, const std::string& site);

// The name `site` becomes `name`; a landmark that bears that name already takes the other one.
BenchState RenameLandmark(BenchState state, const std::string& site, const std::string& name);

// The site cannot be placed; it is removed where it was.
BenchState CallAbsent(BenchState state, const std::string& site, const std::string& reason);

// What the observer knows beside the place. depth: measured along the normal; none: not measured.
inline constexpr std::size_t kLongestNote = 4000;
struct LandmarkRemarks {
  Certainty certainty = Certainty::kMedium;
  std::string note = {};  // at most kLongestNote bytes
  std::optional<double> depth_along_normal_mm = {};
};
BenchState RemarkLandmark(BenchState state, const std::string& site,
                          const LandmarkRemarks& remarks);

// A person has looked at it, or at all of them.
BenchState ConfirmLandmark(BenchState state, const std::string& site);
BenchState ConfirmAllLandmarks(BenchState state);

// All landmarks of a file in place of those that are there. Points that the file calls proposed
// are so.
BenchState TakeLandmarks(BenchState state, const LandmarkFile& file);

// Proposed points for the sites that a person has neither placed nor called absent.
BenchState TakeProposals(BenchState state, const LandmarkFile& file);

// A new type of a variant drops what was set of the old one. value: YAML on one line.
BenchState ChangeSetting(BenchState state, const std::string& path, const std::string& value);

// The option is again what it was in the file that the workbench began with, and all below it.
BenchState DropSetting(BenchState state, const std::string& path);

// Landmarks of these sites go along with the subject's files, which are read in another frame now.
BenchState InOtherFrame(BenchState state, const std::vector<std::string>& sites,
                        const FileSubject& before, const FileSubject& after);

BenchState TakeEdits(BenchState state, EditScript edits);

}  // namespace semblance
