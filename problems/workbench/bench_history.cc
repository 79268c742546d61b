// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/workbench/bench_history.h"

#include <utility>

#include "problems/config/config.h"

namespace semblance {

BenchHistory BeginHistory(BenchState state) {
  return {.steps = {{"began", std::move(state)}}, .now = 0};
}

BenchHistory Done(BenchHistory history, std::string what, BenchState state) {
  history.steps.resize(static_cast<std::size_t>(history.now) + 1);
  history.steps.push_back({std::move(what), std::move(state)});
  if (history.steps.size() > kMostSteps) {
    history.steps.erase(history.steps.begin());
  }
  history.now = static_cast<int>(history.steps.size()) - 1;
  return history;
}

bool CanUndo(const BenchHistory& history) { return history.now > 0; }

bool CanRedo(const BenchHistory& history) {
  return history.now + 1 < static_cast<int>(history.steps.size());
}

BenchHistory Undone(BenchHistory history) {
  history.now -= CanUndo(history) ? 1 : 0;
  return history;
}

BenchHistory Redone(BenchHistory history) {
  history.now += CanRedo(history) ? 1 : 0;
  return history;
}

std::string HistoryText(const BenchHistory& history) { return WriteConfig(history); }

BenchHistory HistoryFromText(std::string_view text, const std::string& name) {
  return ReadConfigText<BenchHistory>(text, name);
}

}  // namespace semblance
