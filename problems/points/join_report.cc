// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/join_report.h"

#include <fmt/format.h>

#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string_view>

#include "fitting/problem/fit_target.h"

namespace semblance {
namespace {

using Json = nlohmann::ordered_json;

std::string_view NameOf(JoinContinuity continuity) {
  return EnumNames(continuity)[static_cast<std::size_t>(continuity)];
}

// With its folder: every fit calls its surface alike.
std::string NameOf(const std::filesystem::path& file) {
  return (file.parent_path().filename() / file.filename()).string();
}

// What a join that does not hold exceeds, and the remedy.
std::string Excess(const JoinReport& report) {
  const bool gap = !(report.largest_gap_mm <= report.allowed_gap_mm);
  const std::string most = gap ? fmt::format("{:.3g} mm", report.allowed_gap_mm)
                               : fmt::format("{} degrees", kMostJoinAngle_deg);
  if (report.is_at_limit) {
    return fmt::format(
        "; that is more than {}, and less would need more than {} places: the given edge has too "
        "much detail for this surface; fit both with a lower fit.plan.finest, or smaller ones",
        most, kMostExactPoints);
  }
  return fmt::format(
      "; that is more than {}: take {} patches along it, or a larger fit.plan.finest", most,
      gap ? "the given edge's" : "more");
}

}  // namespace

bool JoinReport::Holds() const {
  return largest_gap_mm <= allowed_gap_mm &&
         (join.continuity == JoinContinuity::kPosition || largest_angle_deg <= kMostJoinAngle_deg);
}

std::vector<std::string> JoinLines(std::span<const JoinReport> joins) {
  std::vector<std::string> lines;
  for (const JoinReport& r : joins) {
    lines.push_back(fmt::format(
        "{} joined to {} of {} ({}, {} places): gap at most {:.3g} mm, tangent planes at most "
        "{:.3g} degrees apart{}",
        NameOf(r.join.edge), NameOf(r.join.its_edge), NameOf(r.join.surface),
        NameOf(r.join.continuity), r.places, r.largest_gap_mm, r.largest_angle_deg,
        r.Holds() ? "" : Excess(r)));
  }
  return lines;
}

Json JoinsJson(std::span<const JoinReport> joins) {
  Json json = Json::array();
  for (const JoinReport& r : joins) {
    json.push_back({{"edge", NameOf(r.join.edge)},
                    {"surface_file", NameOf(r.join.surface)},
                    {"surface_sha256", r.sha256},
                    {"its_edge", NameOf(r.join.its_edge)},
                    {"reversed", r.join.reversed},
                    {"continuity", NameOf(r.join.continuity)},
                    {"places", r.places},
                    {"largest_gap_mm", r.largest_gap_mm},
                    {"largest_angle_deg", r.largest_angle_deg},
                    {"holds", r.Holds()}});
  }
  return json;
}

}  // namespace semblance
