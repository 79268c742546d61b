// SPDX-License-Identifier: GPL-3.0-or-later
// `semblance fit` as a user calls it, on a table of the head with nothing chosen but that it
// closes.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "tests/bench/fit_parts.h"
#include "tests/bench/program_call.h"
#include "tests/testing/scattered_data.h"

namespace semblance::bench {
using namespace problems;
namespace {

namespace fs = std::filesystem;

// Block by block, so that ten million points need no memory here.
void WriteHead(const fs::path& path, int count) {
  constexpr int kAtOnce = 100000;
  std::FILE* const file = std::fopen(path.c_str(), "w");
  fmt::print(file, "x,y,z,u,v\n");
  for (int begin = 0; begin < count; begin += kAtOnce) {
    const FitTarget target =
        testing::Scattered(testing::HeadPoint, std::min(kAtOnce, count - begin), 1e-4, 206 + begin);
    for (const FitPoint& p : target.points) {
      fmt::print(file, "{},{},{},{},{}\n", p.position.x(), p.position.y(), p.position.z(), p.uv.x(),
                 p.uv.y());
    }
  }
  std::fclose(file);
}

CallCost CostOfHead(const fs::path& folder, int count) {
  const fs::path table = folder / fmt::format("head_{}.csv", count);
  WriteHead(table, count);
  const CallCost cost = MedianCall({"fit", table.string(), "--set", "closure=periodic_u", "--out",
                                    (folder / "out").string(), "--force", "--quiet"});
  fs::remove(table);
  return cost;
}

}  // namespace

// Goals: those of the issue; peak memory at 1e7 is to be the points and little else.
void RunCommand() {
  std::string name = (fs::temp_directory_path() / "semblance_fit_XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) {
    return;
  }
  const CallCost million = CostOfHead(name, 1000000);
  Print("fit.head_1e6_command_cpu_s", million.cpu_s, kNaN, 1.3, "s");
  Print("fit.head_1e6_command_peak_mb", million.peak_mb, kNaN, kNaN, "MB");
  const CallCost ten = CostOfHead(name, 10000000);
  fs::remove_all(name);
  Print("fit.head_1e7_command_cpu_s", ten.cpu_s, kNaN, 12, "s");
  Print("fit.head_1e7_peak_mb", ten.peak_mb, kNaN, 600, "MB");
}

}  // namespace semblance::bench
