// SPDX-License-Identifier: GPL-3.0-or-later
// The actions of a person at the workbench. Each takes a state by value and returns the new state;
// none has another effect. Each throws InputError for arguments that make no sense.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "problems/app/workbench/bench_state.h"
#include "problems/experiment/experiment.h"
#include "surfaces/base/geometry.h"

namespace semblance::problems {

// Names the case. The name has 1 to kMaxName_bytes bytes.
inline constexpr std::size_t kMaxName_bytes = 400;
BenchState NameCase(BenchState state, const std::string& name);

// Places the site or moves it. The site is then neither proposed nor absent. Its measurements and
// a person's note stay. Its normal is dropped because the normal belonged to the former place.
BenchState PlaceLandmark(BenchState state, const std::string& site, const Vec3& point);

// Gives the landmark's dowel a direction out of the bone, or the bone's own one again. The point
// and its proposal stay as they are. Throws for a direction without length.
BenchState TurnLandmark(BenchState state, const std::string& site,
                        const std::optional<Vec3>& direction);

BenchState RemoveLandmark(BenchState state, const std::string& site);

// Renames the landmark at `site` to `name`. If `name` is placed already, the two exchange names.
BenchState RenameLandmark(BenchState state, const std::string& site, const std::string& name);

// Marks a site that cannot be placed. Its landmark is removed.
BenchState MarkAbsent(BenchState state, const std::string& site, const std::string& reason);

// An observer's remarks on a landmark.
inline constexpr std::size_t kMaxNote_bytes = 4000;
struct LandmarkRemarks {
  Certainty certainty = Certainty::kMedium;
  std::string note = {};                             // at most kMaxNote_bytes
  std::optional<double> depth_along_normal_mm = {};  // none: not measured
};
BenchState RemarkLandmark(BenchState state, const std::string& site,
                          const LandmarkRemarks& remarks);

// Record that a person has checked one proposed landmark, or all of them. The latter throws as long
// as there are doubtful ones (BenchLandmark::IsDoubtful), which are confirmed one by one.
BenchState ConfirmLandmark(BenchState state, const std::string& site);
BenchState ConfirmAllLandmarks(BenchState state);

// Marks the doubtful proposed landmarks as absent and confirms the others. A site without a depth
// marker costs the face less than a marker at a wrong place.
BenchState LeaveOutDoubtfulLandmarks(BenchState state);

// Replaces all landmarks by those of a file. If it is marked as proposed, those with a doubt count
// as proposed, or all of them if none has a doubt.
BenchState ReplaceLandmarks(BenchState state, const LandmarkFile& file);

// Adds proposed points for the sites that a person has neither placed nor marked absent. Earlier
// proposals are replaced.
BenchState AddProposals(BenchState state, const LandmarkFile& file);

// Sets an option. value: YAML on one line. A new `type` of a variant drops the settings of the
// former type.
BenchState ChangeSetting(BenchState state, const std::string& path, const std::string& value);

// Drops the settings of the option and of all options below it. Their values are then those of the
// file `state.start`.
BenchState DropSetting(BenchState state, const std::string& path);

// Moves the landmarks of these sites from the frame `before` to the frame `after` of the subject's
// files, so that they stay on the bone when axes or unit are corrected.
BenchState ChangeFrame(BenchState state, const std::vector<std::string>& sites,
                       const FileSubject& before, const FileSubject& after);

BenchState ReplaceEdits(BenchState state, EditScript edits);

}  // namespace semblance::problems
