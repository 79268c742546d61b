// SPDX-License-Identifier: GPL-3.0-or-later
// The search of a study, ready to run: its axes, and the trials that a point of them stands for.
#pragma once

#include <string>
#include <vector>

#include "problems/search/search_ask.h"
#include "problems/study/study_trial.h"

namespace semblance {

struct SearchPlan {
  StudySearch options;
  SearchSpace space;                            // ranges, then choices
  std::vector<std::string> axes;                // their paths; with short runs also kRungAxis
  std::vector<SubjectTree> subjects, held_out;  // that are left
  ConfigNode defaults;
};

// Says of a short run which rung it is on ("1 of 3"); of a run in full it says nothing.
inline constexpr const char* kRungAxis = "rung";

// Without subjects. What is wrong with the axes goes to `errors`, at its location in the file.
SearchPlan MakeSearchPlan(const StudySearch& options, const ConfigNode& tree, ConfigErrors& errors);

// Rows that have every end and every choice of each axis with those of each other one: what is
// wrong with two of them is found before anything runs.
std::vector<StudyRow> RowsToCheck(const SearchPlan& plan);

// Why a run cannot be made short as the search asks for; empty if it can.
std::string ComplaintAboutShortRuns(const SearchPlan& plan, StudyJob job,
                                    const Experiment& experiment);

// One trial for each of `subjects`, without ids.
std::vector<StudyTrial> TrialsAt(const SearchPlan& plan, const SearchAsk& ask,
                                 const std::vector<SubjectTree>& subjects, TrialFaults& faults);

}  // namespace semblance
