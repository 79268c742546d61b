// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/step_clock.h"

#include <fmt/format.h>

#include <array>
#include <string_view>

#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

struct Remedy {
  std::string_view step, what;
};

// Remedies that reduce the memory of a step.
constexpr std::array kRemedies = {
    Remedy{"load subject", "give meshes or a volume with fewer elements"},
    Remedy{"fill skull", "give a skull with fewer triangles"},
    Remedy{"interpolate depth", "give a skull with fewer triangles"},
    Remedy{"implicit face", "lower implicit.resolution"},
    Remedy{"fit", "lower the finest level of fit.plan, or seeds.level"},
    Remedy{"uncertainty", "lower uncertainty.samples, or the finest level of fit.plan"},
};

}  // namespace

void ThrowOutOfMemory(const char* step) {
  std::string_view remedy = "give smaller meshes";
  for (const Remedy& known : kRemedies) {
    remedy = known.step == step ? known.what : remedy;
  }
  throw OutOfMemory(fmt::format(
      "not enough memory for the step '{}'; {}, or run fewer trials at a time", step, remedy));
}

}  // namespace semblance::problems
