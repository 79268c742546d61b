// SPDX-License-Identifier: GPL-3.0-or-later
// What a study costs beyond its trials' own work: a thousand tiny trials, as a study and as bare
// calls that share the same cache.
#include <fmt/format.h>

#include <chrono>
#include <filesystem>

#include "problems/run.h"
#include "problems/study_report.h"
#include "problems/study_run.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;

constexpr int kTrials = 1000;
constexpr double kGoal_ms = 10;

std::string StudyText() {
  return fmt::format(
      "base: {}/configs/phantom.yaml\n"
      "set: {{subject.rings: 24, implicit.resolution: 8, seeds.level: 0, template.max_level: 0,\n"
      "      first_fit: [], fit.schedule: [{{level: 0, fraction: 1}}]}}\n"
      "sample: {{method: lhs, n: {}, random_seed: 1, ranges: {{seeds.weight: [0.5, 1.0]}}}}\n",
      SEMBLANCE_SOURCE_DIR, kTrials);
}

double Seconds(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void Measure(const fs::path& folder) {
  WriteFileAtomically(folder / "study.yaml", StudyText());
  const auto start = std::chrono::steady_clock::now();
  const StudyPlan plan = ReadStudy(folder / "study.yaml");
  RunStudy(plan, folder / "out", {}, {});
  OutputFolder output(folder / "out", WhenNotEmpty::kReplaceFiles);
  WriteStudyTables(output);
  const double study_s = Seconds(start);
  const auto bare = std::chrono::steady_clock::now();
  StageCache cache(8);
  for (const StudyTrial& trial : plan.trials) {
    Run(trial.experiment, {}, &cache);
  }
  const double own_s = Seconds(bare);
  const double more_ms = 1000 * (study_s - own_s) / kTrials;
  fmt::print(
      "{{\"name\": \"study_overhead_per_trial\", \"ours\": {:.3f}, \"peer\": {:.3f}, \"ratio\": "
      "{:.2f}, "
      "\"goal\": 1, \"met\": {}, \"unit\": \"ms\", \"command\": \"study_bench\"}}\n",
      more_ms, kGoal_ms, kGoal_ms / more_ms, more_ms < kGoal_ms);
}

}  // namespace
}  // namespace semblance

int main() {
  const auto folder = std::filesystem::temp_directory_path() / "semblance_study_bench";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  semblance::Measure(folder);
  std::filesystem::remove_all(folder);
}
