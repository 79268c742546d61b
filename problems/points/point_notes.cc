// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/point_notes.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "problems/points/file_parts.h"
#include "problems/report/plain_names.h"

namespace semblance::problems {
namespace {

std::string LeftOutText(const PointsOut& out) {
  constexpr std::size_t kMostNamed = 5;
  std::string named;
  for (std::size_t n = 0; n < std::min(out.strays.size(), kMostNamed); ++n) {
    named += fmt::format("{}{}", n > 0 ? ", " : "", out.strays[n] + 1);
  }
  return fmt::format(
      "{} far beyond all others {} left out: {} {}{}", Counted(std::ssize(out.strays), "point"),
      out.strays.size() == 1 ? "was" : "were", out.strays.size() == 1 ? "number" : "numbers", named,
      out.strays.size() > kMostNamed ? ", ..." : "");
}

// States that the points lie in two places, if there is a wide gap along u or v.
std::string GapText(std::vector<Vec2> uv) {
  constexpr double kWideGap = 0.4;     // of the domain
  constexpr std::size_t kOneIn = 100;  // points that lie beyond the gap at least
  for (const int c : {0, 1}) {
    std::ranges::sort(uv, {}, [&](const Vec2& p) { return p[c]; });
    for (std::size_t k = uv.size() / kOneIn; k + uv.size() / kOneIn < uv.size(); ++k) {
      if (k > 0 && uv[k][c] - uv[k - 1][c] > kWideGap) {
        return fmt::format(
            "the points lie in two places, with {:.0f} % of {} between them empty: nothing holds "
            "the surface there; fit each place by itself for its detail",
            100 * (uv[k][c] - uv[k - 1][c]), c == 0 ? "u" : "v");
      }
    }
  }
  return "";
}

}  // namespace

std::vector<std::string> FindNotes(const PointTable& table, const PointsOut& out,
                                   const PreparedPoints& placed, const PointFitOptions& options) {
  std::vector<std::string> notes = table.notes;
  if (out.not_finite > 0) {
    notes.push_back(fmt::format("{} without finite coordinates left out",
                                Counted(static_cast<long long>(out.not_finite), "point")));
  }
  if (!out.strays.empty()) {
    notes.push_back(LeftOutText(out));
  }
  if (const HSplineShape asked = ShapeFor(options);
      placed.shape.patches_u != asked.patches_u || placed.shape.patches_v != asked.patches_v) {
    notes.push_back(fmt::format(
        "level 0 has {} x {} patches in place of {} x {}, by the shape of "
        "the domain; patches_by_shape: false keeps them",
        placed.shape.patches_u, placed.shape.patches_v, asked.patches_u, asked.patches_v));
  }
  if (options.closure == Closure::kOpen) {
    if (std::string gap = GapText(placed.parameters.uv); !gap.empty()) {
      notes.push_back(std::move(gap));
    }
  }
  if (placed.parameters.is_graph) {
    for (std::string& note : FindHeightMistakes(table.positions, placed.parameters.uv)) {
      notes.push_back(std::move(note));
    }
  }
  return notes;
}

}  // namespace semblance::problems
