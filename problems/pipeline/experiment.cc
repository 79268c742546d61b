// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/pipeline/experiment.h"

#include <fmt/format.h>

#include <utility>

#include "fitting/plan/fit_check.h"

namespace semblance {
namespace {

class LevelCheck {
 public:
  explicit LevelCheck(int finest) : finest_(finest) {}

  void At(std::string path, int level) {
    if (level > finest_) {
      faults_.push_back(
          {std::move(path), fmt::format("level {} is finer than the surface, whose finest level is "
                                        "{}; give a level up to that, or raise template.max_level",
                                        level, finest_)});
    }
  }
  void Steps(const std::string& path, const std::vector<ScheduleStep>& steps) {
    for (std::size_t n = 0; n < steps.size(); ++n) {
      At(fmt::format("{}[{}].level", path, n), steps[n].level);
    }
  }
  std::vector<OptionFault> Take() { return std::move(faults_); }

 private:
  int finest_;
  std::vector<OptionFault> faults_;
};

}  // namespace

std::vector<OptionFault> FaultsBetween(const Experiment& experiment) {
  LevelCheck check(experiment.face_template.max_level);
  check.Steps("first_fit", experiment.first_fit);
  check.At("seeds.direction_level", experiment.seeds.direction_level);
  std::vector<OptionFault> faults = check.Take();
  for (const FitFault& fault : FaultsOf(experiment.fit, experiment.face_template.max_level)) {
    faults.push_back({"fit." + fault.path,
                      fault.too_fine ? fault.what + ", or raise template.max_level" : fault.what});
  }
  return faults;
}

}  // namespace semblance
