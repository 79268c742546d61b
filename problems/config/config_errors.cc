// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/config/config_errors.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "surfaces/base/error.h"

namespace semblance {

namespace {

// Defaults, which stand in no source, come first.
std::tuple<int, int, int> OrderOf(const ConfigFault& fault) {
  const ConfigLocation& at = fault.location;
  return {at.source ? at.source->order : -1, at.line, at.column};
}

}  // namespace

void ConfigErrors::Add(const ConfigLocation& location, std::string_view path,
                       std::string_view what) {
  faults_.push_back({location, std::string(path), std::string(what)});
}

void ConfigErrors::ThrowIfAny() const {
  if (faults_.empty()) {
    return;
  }
  std::vector<ConfigFault> sorted = faults_;
  std::ranges::stable_sort(sorted, {}, OrderOf);
  std::string lines;
  for (const ConfigFault& fault : sorted) {
    lines += fmt::format("{}{}: {}{}{}", lines.empty() ? "" : "\n", ToText(fault.location),
                         fault.path, fault.path.empty() ? "" : ": ", fault.what);
  }
  throw ConfigError(lines);
}

}  // namespace semblance
