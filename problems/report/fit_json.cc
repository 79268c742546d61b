// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/fit_json.h"

namespace semblance {
namespace {

using Json = nlohmann::ordered_json;

// A count; null for what was not counted.
Json Count(int value) { return value < 0 ? Json(nullptr) : Json(value); }

Json LevelJson(const LevelSummary& level) {
  Json json = {{"level", level.level},
               {"fraction", level.fraction},
               {"rms_before_mm", level.rms_before_mm},
               {"rms_after_mm", level.rms_after_mm},
               {"max_move_mm", level.max_move_mm},
               {"free_vertices", level.free_vertices},
               {"uncovered_vertices", Count(level.uncovered_vertices)},
               {"patches", Count(level.coverage.patches)},
               {"empty_patches", Count(level.coverage.empty_patches)},
               {"median_patch_points", level.coverage.median_patch_points},
               {"auto_weight", level.auto_weight},
               {"rank", Count(level.rank)},
               {"solver", level.solver},
               {"iterations", level.iterations},
               {"usable", level.usable},
               {"terms", Json::array()}};
  for (const TermCosts& term : level.terms) {
    json["terms"].push_back({{"term", term.term}, {"before", term.before}, {"after", term.after}});
  }
  return json;
}

Json RelaxationJson(const RelaxationSummary& step) {
  const auto penalties = [](const RelaxationPenalties& p) -> Json {
    return {{"distance", p.distance},
            {"bunching", p.bunching},
            {"distortion", p.distortion},
            {"crease", p.crease},
            {"standard", p.standard}};
  };
  return {{"before", penalties(step.before)},
          {"after", penalties(step.after)},
          {"max_move_mm", step.max_move_mm},
          {"flips_prevented", step.flips_prevented},
          {"steps_shortened", step.steps_shortened}};
}

}  // namespace

Json StepsToJson(const FitResult& fit) {
  Json json = {{"levels", Json::array()}};
  for (const LevelSummary& level : fit.levels) {
    json["levels"].push_back(LevelJson(level));
  }
  for (const RelaxationSummary& step : fit.relaxations) {
    json["relaxations"].push_back(RelaxationJson(step));
  }
  return json;
}

}  // namespace semblance
