// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/schemes/external_scheme.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "surfaces/base/error.h"

namespace semblance::interp {
namespace {

void CheckUsable(const ExternalScheme& scheme, const DepthInput& input) {
  if (!scheme.function) {
    throw InputError(fmt::format(
        "interp: the scheme '{}' is written in Python and is not loaded; give it to semblance.run "
        "or semblance.study",
        scheme.name));
  }
  if (scheme.function->needs_surface && input.skull.triangles.empty()) {
    throw InputError(
        fmt::format("{}: the skull has no triangles; the scheme needs them", scheme.name));
  }
  if (scheme.function->needs_network && input.network.areas.empty()) {
    throw InputError(
        fmt::format("{}: the dowel network has no area; the scheme needs one", scheme.name));
  }
}

void CheckCount(const ExternalScheme& scheme, const char* what, std::size_t count,
                std::size_t vertices) {
  if (count != vertices) {
    throw InputError(fmt::format("{}: the scheme returned {} {} for {} vertices; return one each",
                                 scheme.name, count, what, vertices));
  }
}

void CheckNumbers(const ExternalScheme& scheme, const ExternalDepths& found) {
  for (std::size_t v = 0; v < found.depth_mm.size(); ++v) {
    if (found.depth_mm[v] <= 0 || std::isinf(found.depth_mm[v])) {
      throw InputError(fmt::format(
          "{}: the depth of vertex {} is {} mm; return a finite number above 0, or nan for none",
          scheme.name, v, found.depth_mm[v]));
    }
  }
  for (std::size_t v = 0; v < found.sd_mm.size(); ++v) {
    if (found.sd_mm[v] < 0 || std::isinf(found.sd_mm[v])) {
      throw InputError(fmt::format(
          "{}: the standard deviation of vertex {} is {} mm; return a finite number from 0, or nan "
          "for none",
          scheme.name, v, found.sd_mm[v]));
    }
  }
}

}  // namespace

DepthField InterpolateDepth(const ExternalScheme& options, const DepthInput& input,
                            const RunContext& run) {
  CheckDepthInput(input);
  run.ThrowIfStopped();
  CheckUsable(options, input);
  const std::size_t vertices = input.skull.points.size();
  ExternalDepths found = options.function->interpolate(input, options.options);
  CheckCount(options, "depths", found.depth_mm.size(), vertices);
  if (!found.sd_mm.empty()) {
    CheckCount(options, "standard deviations", found.sd_mm.size(), vertices);
  }
  CheckNumbers(options, found);
  DepthField field = EmptyDepthField(vertices);
  field.depth_mm = std::move(found.depth_mm);
  for (std::size_t v = 0; v < vertices; ++v) {
    const bool is_known = !std::isnan(field.depth_mm[v]);
    field.status[v] = is_known ? DepthStatus::kAssigned : DepthStatus::kOutside;
    field.sd_mm[v] = is_known && !found.sd_mm.empty() ? found.sd_mm[v] : kNaN;
  }
  return field;
}

}  // namespace semblance::interp
