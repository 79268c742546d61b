// SPDX-License-Identifier: GPL-3.0-or-later
// A study on disk: plan.json, and one folder per trial. A trial is sound if its trial.json is what
// was written, which its own hash shows, and if its other files have the hashes that trial.json
// lists.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "problems/study/trial_numbers.h"

namespace semblance::problems {

std::filesystem::path TrialFolder(const std::filesystem::path& study, const std::string& id);

// The same folder, for writing. Throws IoError if it or trials/ is a link, which may lead out of
// the study.
std::filesystem::path WritableTrialFolder(const std::filesystem::path& study,
                                          const std::string& id);

// Writes a trial.json: the members, then `trial_sha256`, the hash of all before it, and then
// `version`, `program` and `libraries`. These three are not hashed, because a trial of another
// version is sound; it is reported. kThisProgram sets them, kAsBefore keeps those of `json`.
enum class Maker { kThisProgram, kAsBefore };
std::string TrialText(nlohmann::ordered_json json, Maker maker);

// Reads the trial.json of a trial. Returns nothing if it is missing, not what was written, or of
// another trial.
std::optional<nlohmann::ordered_json> ReadTrialFile(const std::filesystem::path& study,
                                                    const std::string& id);

// The content of a study's plan.json that a later call needs.
struct StoredPlan {
  std::string hash;              // empty if there is no plan.json
  std::vector<std::string> ids;  // ids of its trials
};
// Throws IoError if plan.json exists and is not the plan of a study.
StoredPlan ReadStoredPlan(const std::filesystem::path& study);

// Reads the hash alone.
std::string ReadPlanHash(const std::filesystem::path& study);

// Lists one entry {file, bytes, sha256} per name, for trial.json.
nlohmann::ordered_json ListHashes(const std::filesystem::path& trial,
                                  const std::vector<std::string>& names);

// Returns true if this version and this build of the program made the trial.
bool IsOfThisProgram(const TrialNumbers& trial);

// The files of a trial of which the bytes are compared with trial.json's hashes: none, only their
// sizes; those that a report shows; all.
enum class TrialCheck { kSizes, kShown, kAll };

// A trial on disk. If there is no trial.json, both members are empty.
struct StoredTrial {
  std::optional<TrialNumbers> numbers;  // of a sound trial
  std::string fault;                    // the reason why it is not sound
};
// `names` keeps or drops numbers and serves all trials of the study.
StoredTrial ReadTrial(const std::filesystem::path& study, const std::string& id, TrialCheck check,
                      SharedNames& names);

// Copies a sound trial to another study's folder, completely or not at all, trial.json last.
// Returns "", or the reason why it was not copied: a fault of ReadTrial, a file that manifest.json
// names is missing or has another hash, or the folder has links or devices, which may lead out of
// it. Throws IoError if a file cannot be read or written.
std::string CopyTrial(const std::filesystem::path& from, const std::filesystem::path& to,
                      const std::string& id);

}  // namespace semblance::problems
