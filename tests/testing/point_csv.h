// SPDX-License-Identifier: GPL-3.0-or-later
// Writes points to fit as the text of a table.
#pragma once

#include <fmt/format.h>

#include <string>

#include "fitting/problem/fit_target.h"

namespace semblance::testing {

inline std::string PlainCsv(const FitTarget& target) {
  std::string csv = "x,y,z\n";
  for (const FitPoint& p : target.points) {
    csv += fmt::format("{},{},{}\n", p.position.x(), p.position.y(), p.position.z());
  }
  return csv;
}

inline std::string UvCsv(const FitTarget& target) {
  std::string csv = "x,y,z,u,v\n";
  for (const FitPoint& p : target.points) {
    csv += fmt::format("{},{},{},{},{}\n", p.position.x(), p.position.y(), p.position.z(), p.uv.x(),
                       p.uv.y());
  }
  return csv;
}

}  // namespace semblance::testing
