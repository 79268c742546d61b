// SPDX-License-Identifier: GPL-3.0-or-later
// What a study has on disk: plan.json, and a folder per trial, which is whole once its trial.json
// is.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace semblance {

std::filesystem::path TrialFolder(const std::filesystem::path& study, const std::string& id);

// trial.json of a trial that is whole; nothing if it is not there, cut short, of another trial, or
// if its status or reason are no texts.
std::optional<nlohmann::ordered_json> ReadTrialFile(const std::filesystem::path& study,
                                                    const std::string& id);

// What a study's plan.json says.
struct PlanThere {
  std::string hash;              // empty: there is no plan
  std::vector<std::string> ids;  // of its trials
};
// Throws IoError if the file is there and not the plan of a study.
PlanThere ReadPlanThere(const std::filesystem::path& study);

// The hash alone.
std::string PlanHashOf(const std::filesystem::path& study);

// One entry {file, sha256} per name, for trial.json.
nlohmann::ordered_json HashesOf(const std::filesystem::path& trial,
                                const std::vector<std::string>& names);

// Copies a trial that is whole to another study's folder: all of it or nothing, trial.json last.
// Returns why it is not taken: a file that trial.json or manifest.json names is missing or has
// another hash, or the folder holds links or devices, which may lead out of it. Empty if it was
// taken. Throws IoError if it cannot be read or written.
std::string CopyTrial(const std::filesystem::path& from, const std::filesystem::path& to,
                      const std::string& id);

struct TrialNumbers {
  std::string id, status = "failed", reason;
  std::map<std::string, double> metrics;             // numbers of `result` by dotted path
  std::map<std::string, std::vector<double>> lists;  // numbers in lists of it, in their order, a
                                                     // list of objects as one list per member;
                                                     // NaN for null
};

// Nothing for what is no JSON, no object, nested deeper than kDeepestJson, or where id, status or
// reason is no text.
std::optional<TrialNumbers> ReadTrialNumbers(std::string_view text);

}  // namespace semblance
