// SPDX-License-Identifier: GPL-3.0-or-later
// What a study costs beyond its trials' own work, planning and tables included: a thousand tiny
// trials, less the time of their steps.
#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "problems/study/report/study_report.h"
#include "problems/study/study_run.h"
#include "surfaces/base/atomic_file.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

constexpr int kTrials = 1000;
constexpr double kGoal_ms = 10;

std::string StudyText() {
  return fmt::format(
      "base: {}/configs/phantom.yaml\n"
      "set: {{subject.rings: 24, implicit.resolution: 8, seeds.level: 0, template.max_level: 0,\n"
      "      first_fit: [], fit.solver: fastest, fit.plan.schedule: [{{level: 0, fraction: 1}}]}}\n"
      "sample: {{method: lhs, n: {}, random_seed: 1, ranges: {{seeds.weight: [0.5, 1.0]}}}}\n",
      SEMBLANCE_SOURCE_DIR, kTrials);
}

double Seconds(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// What the trials' steps took, by their timing.json; all else is the study's.
double OwnWork_s(const fs::path& folder, const StudyPlan& plan) {
  double sum_s = 0;
  for (const StudyTrial& trial : plan.trials) {
    const auto timing =
        nlohmann::json::parse(ReadFileBytes(folder / "trials" / trial.id / "timing.json"));
    sum_s += timing.at("total_wall_s").get<double>();
  }
  return sum_s;
}

void Measure(const fs::path& folder) {
  WriteFileAtomically(folder / "study.yaml", StudyText());
  const auto start = std::chrono::steady_clock::now();
  const StudyPlan plan = ReadStudy(folder / "study.yaml");
  RunStudy(plan, folder / "out", {}, {});
  OutputFolder output(folder / "out", WhenNotEmpty::kReplaceFiles);
  WriteStudyTables(output);
  const double study_s = Seconds(start), own_s = OwnWork_s(folder / "out", plan);
  const double more_ms = 1000 * (study_s - own_s) / kTrials;
  fmt::print(
      "{{\"name\": \"study_overhead_per_trial\", \"ours\": {:.3f}, \"peer\": {:.3f}, \"ratio\": "
      "{:.2f}, "
      "\"goal\": 1, \"met\": {}, \"unit\": \"ms\", \"command\": \"study_bench\"}}\n",
      more_ms, kGoal_ms, kGoal_ms / more_ms, more_ms < kGoal_ms);
}

}  // namespace
}  // namespace semblance::problems

int main() {
  const auto folder = std::filesystem::temp_directory_path() / "semblance_study_bench";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  semblance::problems::Measure(folder);
  std::filesystem::remove_all(folder);
}
