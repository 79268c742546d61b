// SPDX-License-Identifier: GPL-3.0-or-later
// `semblance fit` as a user calls it, on a table of the head with nothing chosen but that it
// closes.
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "tests/bench/fit_parts.h"
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

double Seconds(const timeval& t) {
  return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
}

// NaN where the command fails.
Measured Call(const fs::path& table, const fs::path& out) {
  const pid_t child = fork();
  if (child == 0) {
    execl(SEMBLANCE_PROGRAM, "semblance", "fit", table.c_str(), "--set", "closure=periodic_u",
          "--out", out.c_str(), "--force", "--quiet", static_cast<char*>(nullptr));
    _exit(127);
  }
  int status = -1;
  rusage usage{};
  wait4(child, &status, 0, &usage);
  if (status != 0) {
    return {};
  }
  Measured measured;
  measured.seconds = Seconds(usage.ru_utime) + Seconds(usage.ru_stime);
  measured.peak_mb = static_cast<double>(usage.ru_maxrss) / 1024;
  return measured;
}

// The run with the median of processor seconds.
Measured MedianCall(const fs::path& folder, int count) {
  const fs::path table = folder / fmt::format("head_{}.csv", count);
  WriteHead(table, count);
  std::array<Measured, 3> calls;
  for (Measured& call : calls) {
    call = Call(table, folder / "out");
  }
  std::sort(calls.begin(), calls.end(),
            [](const Measured& a, const Measured& b) { return a.seconds < b.seconds; });
  fs::remove(table);
  return calls[1];
}

}  // namespace

// Goals: those of the issue; peak memory at 1e7 is to be the points and little else.
void RunCommand() {
  std::string name = (fs::temp_directory_path() / "semblance_fit_XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) {
    return;
  }
  const Measured million = MedianCall(name, 1000000);
  Print("fit.head_1e6_command_cpu_s", million.seconds, kNaN, 1.3, "s");
  Print("fit.head_1e6_command_peak_mb", million.peak_mb, kNaN, kNaN, "MB");
  const Measured ten = MedianCall(name, 10000000);
  fs::remove_all(name);
  Print("fit.head_1e7_command_cpu_s", ten.seconds, kNaN, 12, "s");
  Print("fit.head_1e7_peak_mb", ten.peak_mb, kNaN, 600, "MB");
}

}  // namespace semblance::bench
