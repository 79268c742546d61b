// SPDX-License-Identifier: GPL-3.0-or-later
// The states that a person has gone through: undo and redo are steps along a list.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "problems/workbench/bench_state.h"

namespace semblance {

struct BenchStep {
  std::string what;  // for people: what led here
  BenchState state;
};

struct BenchHistory {
  std::vector<BenchStep> steps;  // one at least; the oldest first
  int now = 0;                   // the step that counts; those after it can be done again
};

inline constexpr int kMostSteps = 100;  // older ones are forgotten

inline const BenchState& Now(const BenchHistory& history) {
  return history.steps[static_cast<std::size_t>(history.now)].state;
}

BenchHistory BeginHistory(BenchState state);

// A new step after the present one; what was undone before it is forgotten.
BenchHistory Done(BenchHistory history, std::string what, BenchState state);

bool CanUndo(const BenchHistory& history);
bool CanRedo(const BenchHistory& history);
BenchHistory Undone(BenchHistory history);  // as it is where there is nothing to undo
BenchHistory Redone(BenchHistory history);

// As YAML, and back: of each step but the first, the edits are what differs from the step before.
// Throws ConfigError for a text that is none.
std::string HistoryText(const BenchHistory& history);
BenchHistory HistoryFromText(std::string_view text, const std::string& name);

}  // namespace semblance
