// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/fit_report.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace semblance {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kHangTogether = 0.1;  // correlation of neighbours' residuals
constexpr double kSmaller = 0.85;      // of the noise that the neighbours show

Json RoundJson(const NestedRound& round) {
  return {{"finest", round.finest}, {"vertices", round.vertices},
          {"weight", round.weight}, {"degrees_of_freedom", round.degrees_of_freedom},
          {"rms_mm", round.rms_mm}, {"held_out_rms_mm", round.held_out_rms_mm},
          {"steps", round.steps},   {"outliers", round.outliers}};
}

bool LeavesDetail(const AutoReport& r) {
  return r.neighbour_correlation > kHangTogether || r.neighbour_noise_mm < kSmaller * r.noise_mm;
}

std::string Verdict(const AutoReport& r) {
  if (r.met_to_rounding) {
    return "points are met to a hundred-millionth of their extent: what is left is rounding";
  }
  if (r.limited_by_density) {
    return "detail goes down to the points' spacing: denser points would show more";
  }
  return LeavesDetail(r) ? "residuals are still correlated: part of what counts as noise is detail"
                         : "residuals look like noise: these points show no more detail";
}

}  // namespace

nlohmann::ordered_json AutoJson(const AutoReport& r) {
  Json json = {{"noise_mm", r.noise_mm},
               {"neighbour_noise_mm", r.neighbour_noise_mm},
               {"closer_noise_mm", r.closer_noise_mm},
               {"held_out_rms_mm", r.held_out_rms_mm},
               {"weight", r.weight},
               {"neighbour_correlation", r.neighbour_correlation},
               {"met_to_rounding", r.met_to_rounding},
               {"limited_by_density", r.limited_by_density},
               {"verdict", Verdict(r)},
               {"chosen_round", r.chosen_round},
               {"outlier_count", r.outliers.size()},
               {"outliers", r.outliers},
               {"rounds", Json::array()}};
  for (const NestedRound& round : r.rounds) {
    json["rounds"].push_back(RoundJson(round));
  }
  return json;
}

std::string AutoText(const AutoReport& r) {
  std::string text = fmt::format("noise {:.3g} mm per coordinate", r.noise_mm);
  if (std::isfinite(r.neighbour_noise_mm)) {  // few points have no neighbours to compare
    text += fmt::format(" (between neighbours {:.3g})", r.neighbour_noise_mm);
  }
  if (std::isfinite(r.held_out_rms_mm)) {
    text += fmt::format("; held out {:.3g}", r.held_out_rms_mm);
  }
  text += '\n';
  if (!r.outliers.empty()) {
    text += fmt::format("{} outliers left out; residuals and result.json list them\n",
                        r.outliers.size());
  }
  return text + Verdict(r) + "\n";
}

nlohmann::ordered_json MovesJson(const FootMoves& moves) {
  return {{"rounds", moves.rounds},
          {"rms_move_mm", moves.rms_move_mm},
          {"max_move_mm", moves.max_move_mm},
          {"coarse_rms_before_mm", moves.rms_before_mm},
          {"coarse_rms_after_mm", moves.rms_after_mm},
          {"folds_prevented", moves.folds_prevented}};
}

std::string MovesText(const FootMoves& moves) {
  if (moves.rounds == 0) {
    return "(u,v) stay as they are: moving them brings the points no nearer to a coarse surface";
  }
  std::string text = fmt::format(
      "(u,v) moved in {}: RMS {:.4g} mm, at most {:.4g} mm; the points' RMS distance from a coarse "
      "surface fell from {:.4g} to {:.4g} mm",
      moves.rounds == 1 ? "1 round" : fmt::format("{} rounds", moves.rounds), moves.rms_move_mm,
      moves.max_move_mm, moves.rms_before_mm, moves.rms_after_mm);
  if (moves.folds_prevented > 0) {
    text += fmt::format("; {} of the triangles were kept from turning over", moves.folds_prevented);
  }
  return text;
}

}  // namespace semblance
