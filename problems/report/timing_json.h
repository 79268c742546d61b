// SPDX-License-Identifier: GPL-3.0-or-later
// How long the steps of a job took.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "problems/pipeline/step_clock.h"

namespace semblance {

// timing.json of a run, a measured depth, a fit of points and a trial alike:
//   {"total_wall_s": sum of the steps, "cpu_s": processor time or null, "steps": [{"step": name,
//   "wall_s": seconds}, ...] in the order in which they ran}
// cpu_s: of the whole job where it was taken; work that other jobs did for this one is not in it.
std::string TimingJson(const std::vector<StepTime>& times,
                       std::optional<double> cpu_s = std::nullopt);

}  // namespace semblance
