// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/config/config_errors.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "surfaces/base/error.h"

namespace semblance {

void ConfigErrors::Add(const ConfigLocation& location, std::string_view path,
                       std::string_view what) {
  const std::string_view separator = path.empty() ? "" : ": ";
  errors_.push_back({.order = location.source ? location.source->order : -1,
                     .line = location.line,
                     .column = location.column,
                     .text = fmt::format("{}: {}{}{}", ToText(location), path, separator, what)});
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
