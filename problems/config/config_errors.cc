// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/config/config_errors.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "surfaces/base/error.h"

namespace semblance {

void ConfigErrors::Add(const ConfigPlace& place, std::string_view path, std::string_view what) {
  const std::string_view separator = path.empty() ? "" : ": ";
  errors_.push_back({.order = place.source ? place.source->order : -1,
                     .line = place.line,
                     .column = place.column,
                     .text = fmt::format("{}: {}{}{}", ToText(place), path, separator, what)});
}

void ConfigErrors::ThrowIfAny() const {
  if (errors_.empty()) {
    return;
  }
  std::vector<OneError> sorted = errors_;
  std::stable_sort(sorted.begin(), sorted.end(), [](const OneError& a, const OneError& b) {
    return std::tie(a.order, a.line, a.column) < std::tie(b.order, b.line, b.column);
  });
  std::string lines;
  for (const OneError& error : sorted) {
    lines += (lines.empty() ? "" : "\n") + error.text;
  }
  throw ConfigError(lines);
}

}  // namespace semblance
