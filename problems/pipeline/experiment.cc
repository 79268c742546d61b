// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/pipeline/experiment.h"

#include <fmt/format.h>

#include <variant>

namespace semblance {
namespace {

class LevelCheck {
 public:
  explicit LevelCheck(int finest) : finest_(finest) {}

  void At(std::string path, int level) {
    if (level > finest_) {
      faults_.push_back({std::move(path),
                         fmt::format("level {} is finer than the generic face, whose finest level "
                                     "is {}; give a level up to that, or raise template.max_level",
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
  if (const auto* plan = std::get_if<CoarseToFinePlan>(&experiment.fit.plan)) {
    check.At("fit.plan.finest", plan->finest);
  } else {
    check.Steps("fit.schedule", experiment.fit.schedule);
  }
  check.At("seeds.direction_level", experiment.seeds.direction_level);
  return check.Take();
}

}  // namespace semblance
