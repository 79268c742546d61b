// SPDX-License-Identifier: GPL-3.0-or-later
// Schemes and metrics of the caller, such as functions of Python, for one study.
#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "problems/experiment/external_schemes.h"

namespace semblance::problems {

struct RunResult;    // run.h
struct DepthResult;  // depth_study.h

// The results of a trial. One of `run` and `depth` is set, by the job of the study.
struct MeasuredTrial {
  const RunResult* run = nullptr;
  const DepthResult* depth = nullptr;
  const nlohmann::ordered_json& numbers;  // result.json
};

struct OwnMetric {
  std::string name;         // of its number in result.json and in the tables
  std::string source_hash;  // of its source: part of the id of a trial
  // NaN: the trial has no such number. Threads may call it at the same time. Throws ExternalFailure
  // if the caller's function fails.
  std::function<double(const MeasuredTrial&)> measure;
};

struct StudyPlugins {
  std::vector<NamedScheme> schemes = {};
  std::vector<OwnMetric> metrics = {};
  // The caller has loaded the files that the study names under `plugins`.
  bool are_files_loaded = false;
};

}  // namespace semblance::problems
