// SPDX-License-Identifier: GPL-3.0-or-later
// A face from a synthetic skull, and its distance from the true face:
//   example_face_from_skull configs/phantom.yaml
#include <iostream>

#include "problems/config/config.h"
#include "problems/experiment/experiment_config.h"
#include "problems/run.h"

using namespace semblance::problems;

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: example_face_from_skull CONFIG\n";
    return 2;
  }
  // Any option of the configuration can be overridden, as with `semblance run --set`.
  const std::vector<std::string> quick = {"subject.rings=30", "implicit.resolution=24"};
  const RunResult result = Run(ReadConfig<Experiment>(argv[1], quick), {});
  for (const std::string& fault : result.Faults()) {
    std::cout << "not usable: " << fault << '\n';
  }
  const auto& error = result.truth->face.truth_to_face;
  std::cout << "mean distance " << error.mean_abs_mm << " mm, RMS " << error.rms_mm << " mm\n";
  return result.usable() ? 0 : 1;
}
