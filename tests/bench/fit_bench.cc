// SPDX-License-Identifier: GPL-3.0-or-later
// The fit against its peers: many points on one level, the adaptive fit of a head-like surface,
// points that were held out, and relaxation.
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>

#include "tests/bench/fit_parts.h"

// One BLAS thread for every case; OpenBLAS looks at the variable only when it is loaded.
// fit_bench files FOLDER: each NAME.csv.gz of a folder that has a NAME.truth.npz.
// fit_bench [head] [command] [untuned] [peers] [feet] [heldout] [coverage] [relax] [linear]: parts;
// none: all of them.
int main(int argc, char** argv) {
  if (std::getenv("OPENBLAS_NUM_THREADS") == nullptr) {
    setenv("OPENBLAS_NUM_THREADS", "1", 1);
    execv("/proc/self/exe", argv);
  }
  if (argc == 3 && std::strcmp(argv[1], "files") == 0) {
    semblance::bench::RunFiles(argv[2]);
    return 0;
  }
  const auto wanted = [&](const char* part) {
    return argc == 1 || std::any_of(argv + 1, argv + argc,
                                    [&](const char* name) { return std::strcmp(name, part) == 0; });
  };
  if (wanted("head")) {
    semblance::bench::RunHead();
  }
  if (wanted("command")) {
    semblance::bench::RunCommand();
  }
  if (wanted("untuned")) {
    semblance::bench::RunUntuned();
  }
  if (wanted("peers")) {
    semblance::bench::RunPeers();
  }
  if (wanted("feet")) {
    semblance::bench::RunFeet();
  }
  if (wanted("heldout")) {
    semblance::bench::RunHeldOut();
  }
  if (wanted("coverage")) {
    semblance::bench::RunCoverage();
  }
  if (wanted("relax")) {
    semblance::bench::RunRelaxation();
  }
  if (wanted("linear")) {
    semblance::bench::RunLinear();
  }
  return 0;
}
