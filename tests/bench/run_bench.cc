// SPDX-License-Identifier: GPL-3.0-or-later
// Whole commands, files and pictures included, in CPU seconds, and how each step of a run grows
// with the triangles of the skull. There is no peer, so goals are seconds.
//   run_bench [NAME...]   only the groups named: run trial propose import study growth
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "surfaces/base/atomic_file.h"
#include "surfaces/decimate/decimate.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "tests/bench/entry.h"
#include "tests/bench/program_call.h"

namespace semblance::bench {
namespace {

namespace fs = std::filesystem;

const fs::path kSource = SEMBLANCE_SOURCE_DIR;
const fs::path kHeads = kSource / "../shared/data";

void PrintCost(const std::string& name, double figure, double goal, const std::string& unit = "s") {
  Print({.name = name, .ours = figure, .goal = goal, .unit = unit, .at_most = true}, "run_bench");
}

bool IsHeadHere(const std::string& head) {
  const bool is_here = fs::exists(kHeads / head / "skull.ply");
  if (!is_here) {
    fmt::print(stderr, "no {}: its entries are skipped\n", (kHeads / head).string());
  }
  return is_here;
}

// ---------------------------------------------------------------------------------------------
// Runs, proposals, imports
// ---------------------------------------------------------------------------------------------

void MeasureRun(const std::string& name, const fs::path& config, double goal_s,
                const fs::path& folder) {
  const CallCost cost =
      MedianCall({"run", config.string(), "--out", (folder / name).string(), "--force", "--quiet"});
  PrintCost("run." + name, cost.cpu_s, goal_s);
  PrintCost("run." + name + "_peak_mb", cost.peak_mb, 300, "MB");
}

void MeasureRuns(const fs::path& folder) {
  MeasureRun("demo", kSource / "configs/demo.yaml", 4, folder);
  for (const std::string head : {"vhm", "cthead"}) {
    if (IsHeadHere(head)) {
      MeasureRun(head, kSource / "configs/heads" / (head + ".yaml"), 10, folder);
    }
  }
}

void MeasureProposals(const fs::path& folder) {
  for (const std::string head : {"vhm", "cthead", "cranium"}) {
    if (IsHeadHere(head)) {
      const CallCost cost =
          MedianCall({"landmarks", "propose", (kHeads / head / "skull.ply").string(), "--out",
                      (folder / "proposed.yaml").string(), "--force", "--quiet"});
      PrintCost("propose." + head, cost.cpu_s, 10);
    }
  }
}

double Exponent(double small, double large, double times) {
  return std::log(large / small) / std::log(times);
}

// Phantoms of eight times the voxels: 1 mm, then 0.5 mm, which is about 512 x 512 x 300.
void MeasureImports(const fs::path& folder) {
  std::vector<CallCost> costs;
  for (const std::string pixel : {"1", "0.5"}) {
    const std::string out = (folder / ("phantom_" + pixel)).string();
    CallProgram({"phantom", "--head", "smooth", "--out", out, "--pixel-mm", pixel, "--slice-mm",
                 pixel, "--force"});
    costs.push_back(
        MedianCall({"import-ct", out + "/ct", "--out", out + "/import", "--force", "--quiet"}));
    fs::remove_all(out);
  }
  PrintCost("import.phantom_half_mm", costs[1].cpu_s, 35);
  PrintCost("import.phantom_half_mm_peak_mb", costs[1].peak_mb, 1000, "MB");
  PrintCost("import.growth", Exponent(costs[0].cpu_s, costs[1].cpu_s, 8), 1.15, "exponent");
}

// ---------------------------------------------------------------------------------------------
// Studies
// ---------------------------------------------------------------------------------------------

// The median of three; each from nothing, because a study goes on where it ended.
double StudyCpu_s(const fs::path& folder, const std::string& text) {
  WriteFileAtomically(folder / "study.yaml", text);
  std::array<double, 3> costs_s;
  for (double& cost_s : costs_s) {
    fs::remove_all(folder / "study");
    cost_s = CallProgram({"study", (folder / "study.yaml").string(), "--out",
                          (folder / "study").string(), "--quiet"})
                 .cpu_s;
  }
  std::ranges::sort(costs_s);
  return costs_s[1];
}

// What a study costs more with a second trial on the same skull.
void MeasureSecondTrial(const fs::path& folder) {
  if (!IsHeadHere("vhm")) {
    return;
  }
  const auto cost_s = [&](const std::string& grid) {
    return StudyCpu_s(folder, fmt::format("base: {}/configs/heads/vhm.yaml\ngrid: {{{}}}\n"
                                          "keep: summary\n",
                                          kSource.string(), grid));
  };
  const double one_s = cost_s("seeds.weight: [1]");
  PrintCost("run.second_trial", cost_s("implicit.resolution: [90, 91]") - one_s, 3);
  PrintCost("run.second_trial_of_depth", cost_s("interp: [population, harmonic]") - one_s, 1);
}

void MeasureStudy(const fs::path& folder) {
  PrintCost("study.small",
            StudyCpu_s(folder, fmt::format("base: {}/configs/phantom.yaml\n"
                                           "set: {{subject.rings: 30}}\n"
                                           "sample: {{method: lhs, n: 60, random_seed: 1, ranges: "
                                           "{{seeds.weight: [0.5, 1.0]}}}}\nkeep: summary\n",
                                           kSource.string())),
            40);
}

// ---------------------------------------------------------------------------------------------
// Growth
// ---------------------------------------------------------------------------------------------

// Each triangle in four.
TriMesh Subdivided(const TriMesh& mesh) {
  TriMesh fine{.points = mesh.points, .triangles = {}};
  std::map<std::pair<int, int>, std::int32_t> middles;
  const auto middle = [&](std::int32_t a, std::int32_t b) {
    const auto [it, is_new] = middles.try_emplace(std::minmax(a, b), std::ssize(fine.points));
    if (is_new) {
      fine.points.emplace_back(0.5 * (mesh.points[a] + mesh.points[b]));
    }
    return it->second;
  };
  for (const auto& [a, b, c] : mesh.triangles) {
    const std::int32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    fine.triangles.insert(fine.triangles.end(),
                          {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
  }
  return fine;
}

std::map<std::string, double> StepCpu_s(const fs::path& skull, const fs::path& out) {
  CallProgram({"run", (kSource / "configs/heads/vhm.yaml").string(), "--set",
               "subject.skull=" + skull.string(), "--out", out.string(), "--force", "--quiet"});
  std::map<std::string, double> steps;
  const auto timing = nlohmann::json::parse(ReadFileBytes(out / "timing.json"));
  for (const auto& step : timing.at("steps")) {
    steps[step.at("step")] = step.at("cpu_s");
  }
  steps["all"] = timing.at("cpu_s");
  return steps;
}

// The exponent of each step's time over the triangles, from 50,000 to 800,000. Steps under 0.1 s
// are left out, because they are noise.
void MeasureGrowth(const fs::path& folder) {
  if (!IsHeadHere("vhm")) {
    return;
  }
  constexpr double kLeast_s = 0.1;
  const TriMesh skull = ReadMesh(kHeads / "vhm/skull.ply");
  const TriMesh middle = Decimate(skull, {.target_triangles = 200000}).mesh;
  const TriMesh small_skull = Decimate(skull, {.target_triangles = 50000}).mesh;
  WriteFileAtomically(folder / "small.ply", EncodeMesh(small_skull, ".ply"));
  WriteFileAtomically(folder / "large.ply", EncodeMesh(Subdivided(middle), ".ply"));
  const auto small = StepCpu_s(folder / "small.ply", folder / "growth");
  for (const auto& [step, large_s] : StepCpu_s(folder / "large.ply", folder / "growth")) {
    if (small.at(step) >= kLeast_s) {
      std::string name = step;
      std::ranges::replace(name, ' ', '_');
      PrintCost("run.growth." + name, Exponent(small.at(step), large_s, 16), 1.15, "exponent");
    }
  }
}

}  // namespace

void Measure(const std::vector<std::string>& groups) {
  std::string folder = (fs::temp_directory_path() / "semblance_run_XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr) {
    return;
  }
  const std::vector<std::pair<std::string, void (*)(const fs::path&)>> all = {
      {"run", MeasureRuns},       {"trial", MeasureSecondTrial}, {"propose", MeasureProposals},
      {"import", MeasureImports}, {"study", MeasureStudy},       {"growth", MeasureGrowth}};
  for (const auto& [name, measure] : all) {
    if (groups.empty() || std::ranges::find(groups, name) != groups.end()) {
      measure(folder);
    }
  }
  fs::remove_all(folder);
}

}  // namespace semblance::bench

int main(int count, char** words) {
  semblance::bench::Measure(std::vector<std::string>(words + 1, words + count));
}
