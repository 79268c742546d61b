// SPDX-License-Identifier: GPL-3.0-or-later
// A study on disk: plan.json, and one folder per trial. A trial is whole if its trial.json is.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace semblance::problems {

std::filesystem::path TrialFolder(const std::filesystem::path& study, const std::string& id);

// The same folder, for writing. Throws IoError if it or trials/ is a link, which may lead out of
// the study.
std::filesystem::path WritableTrialFolder(const std::filesystem::path& study,
                                          const std::string& id);

// Reads the trial.json of a whole trial. Returns nothing if it is missing, cut short, or of another
// trial, or if its status or reason is not a text.
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

// Lists one entry {file, sha256} per name, for trial.json.
nlohmann::ordered_json ListHashes(const std::filesystem::path& trial,
                                  const std::vector<std::string>& names);

// Copies a whole trial to another study's folder, completely or not at all, trial.json last.
// Returns "", or the reason why it was not copied: a file that trial.json or manifest.json names is
// missing or has another hash, or the folder has links or devices, which may lead out of it. Throws
// IoError if a file cannot be read or written.
std::string CopyTrial(const std::filesystem::path& from, const std::filesystem::path& to,
                      const std::string& id);

// The parts of a trial.json that the tables of a study need. They are read from the text without a
// JSON tree, because a study has thousands of trials with hundreds of numbers each.
struct TrialNumbers {
  std::string id, status = "failed", reason;
  std::map<std::string, double> metrics;  // numbers of `result` by dotted path
  // The numbers in lists of `result`, in their order; a list of objects gives one list per member;
  // null becomes NaN.
  std::map<std::string, std::vector<double>> lists;
};

// Returns nothing if the text is not a JSON object, is nested deeper than kDeepestJson, or has an
// id, status or reason that is not a text.
std::optional<TrialNumbers> ReadTrialNumbers(std::string_view text);

}  // namespace semblance::problems
