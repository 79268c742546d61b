// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/fit_report.h"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <utility>

#include "fitting/plan/alone_fit.h"
#include "fitting/plan/fit_check.h"
#include "problems/config/config.h"
#include "problems/config/terminal_text.h"
#include "problems/points/fit_files.h"
#include "problems/points/fit_page.h"
#include "problems/report/plain_names.h"
#include "problems/report/result_json.h"
#include "surfaces/base/quantile.h"
#include "surfaces/hspline_files/hspline_json.h"

namespace semblance::problems {
namespace {

using Json = nlohmann::ordered_json;

// The verdict that the residuals still contain detail: the residuals of neighbours correlate by
// more than the first number, or the noise between neighbours is a smaller share of the noise than
// the second. A lower first or a higher second number gives the verdict more often, also for noise
// alone.
constexpr double kMostCorrelation = 0.1, kLeastNoiseShare = 0.85;

Json RoundJson(const NestedRound& round) {
  return {{"finest", round.finest},
          {"vertices", round.vertices},
          {"weight", round.weight},
          {"stretch", round.stretch},
          {"direction_deg", round.direction_deg},
          {"degrees_of_freedom", round.degrees_of_freedom},
          {"rms_mm", round.rms_mm},
          {"held_out_rms_mm", round.held_out_rms_mm},
          {"steps", round.steps},
          {"outliers", round.outliers}};
}

bool LeavesDetail(const AutoReport& r) {
  return r.neighbour_correlation > kMostCorrelation ||
         r.neighbour_noise_mm < kLeastNoiseShare * r.noise_mm;
}

// Returns whether points count clearly less than independent ones would.
bool SharesErrors(const AutoReport& r) {
  constexpr double kShare = 0.7;
  return r.effective_share < kShare;
}

std::string Verdict(const AutoReport& r) {
  if (r.met_to_rounding) {
    return "points are met to a hundred-millionth of their extent: what is left is rounding";
  }
  if (r.limited_by_density) {
    return "detail, or errors that neighbours share, goes down to the points' spacing: denser "
           "points "
           "would show which";
  }
  if (r.outliers_together) {
    return "outliers stand together, as on a feature that is narrower than the points' spacing: "
           "look "
           "at them before you leave them out (fit.plan.outliers: keep)";
  }
  if (r.has_long_tail) {
    return "residuals have a long tail: they are more than noise";
  }
  if (SharesErrors(r)) {
    return "residuals are correlated, as errors that neighbours share: sd and intervals allow for "
           "it";
  }
  return LeavesDetail(r) ? "residuals are still correlated: part of what counts as noise is detail"
                         : "residuals look like noise: these points show no more detail";
}

std::string CopiesText(const AutoReport& r) {
  const auto were = [](std::size_t count) {
    return count == 1 ? std::string("1 point was") : fmt::format("{} points were", count);
  };
  const auto near = static_cast<std::size_t>(r.near_copies);
  std::string text;
  if (r.repeated.size() > near) {
    text += fmt::format("{} given before, at the same place: each counts once\n",
                        were(r.repeated.size() - near));
  }
  if (near > 0) {
    text += fmt::format(
        "{} given before, at nearly the same place, as by a second export: each counts once\n",
        were(near));
  }
  return text;
}

}  // namespace

nlohmann::ordered_json AutoJson(const AutoReport& r) {
  Json json = {{"noise_mm", r.noise_mm},
               {"neighbour_noise_mm", r.neighbour_noise_mm},
               {"closer_noise_mm", r.closer_noise_mm},
               {"held_out_rms_mm", r.held_out_rms_mm},
               {"weight", r.weight},
               {"length_mm", r.length_mm},
               {"stretch", r.stretch},
               {"direction_deg", r.direction_deg},
               {"neighbour_correlation", r.neighbour_correlation},
               {"effective_share", r.effective_share},
               {"lattice_mm", r.lattice_mm},
               {"runs_with_offsets", r.runs},
               {"run_offset_mm", r.run_offset_mm},
               {"outliers_together", r.outliers_together},
               {"met_to_rounding", r.met_to_rounding},
               {"limited_by_density", r.limited_by_density},
               {"verdict", Verdict(r)},
               {"chosen_round", r.chosen_round},
               {"repeated_count", r.repeated.size()},
               {"near_copy_count", r.near_copies},
               {"outlier_count", r.outliers.size()},
               {"outliers", r.outliers},
               {"rounds", Json::array()}};
  for (const NestedRound& round : r.rounds) {
    json["rounds"].push_back(RoundJson(round));
  }
  return json;
}

std::string AutoText(const AutoReport& r, std::string_view unit) {
  std::string text = fmt::format("noise {} per coordinate{}", LengthText(r.noise_mm, unit, 3),
                                 r.weighted ? " of a point of mean weight" : "");
  if (std::isfinite(r.neighbour_noise_mm)) {  // few points have no neighbours to compare
    text += fmt::format(" (between neighbours {:.3g})", r.neighbour_noise_mm);
  }
  if (std::isfinite(r.held_out_rms_mm)) {
    text += fmt::format("; held out {:.3g}", r.held_out_rms_mm);
  }
  text += '\n';
  if (r.stretch > 1) {
    text += fmt::format(
        "the surface bends less along {:.0f} deg from u towards v than across: smoothness is "
        "stretched by {:.2g}\n",
        r.direction_deg, r.stretch);
  }
  text += CopiesText(r);
  if (r.lattice_mm > 0) {
    text +=
        fmt::format("heights are whole multiples of {}: the surface does not follow the rounding\n",
                    LengthText(r.lattice_mm, unit, 3));
  }
  if (r.runs > 0) {
    text += fmt::format(
        "{} runs of the file, as lines of a scan, are {} (standard deviation) off each other and "
        "were levelled; shuffle the rows to fit them as they are\n",
        r.runs, LengthText(r.run_offset_mm, unit, 3));
  }
  if (SharesErrors(r)) {
    text +=
        fmt::format("points count as {:.2g} % as many independent ones\n", 100 * r.effective_share);
  }
  if (!r.outliers.empty()) {
    text += fmt::format("{} left out; residuals and result.json list {}\n",
                        Counted(std::ssize(r.outliers), "outlier"),
                        r.outliers.size() == 1 ? "it" : "them");
  }
  return text + Verdict(r) + "\n";
}

std::string MovesText(const FootMoves& moves, std::string_view unit) {
  if (moves.rounds == 0) {
    return "(u,v) stay as they are: moving them brings the points no nearer to a coarse surface";
  }
  std::string text = fmt::format(
      "(u,v) moved in {}: RMS {}, at most {}; the points' RMS distance from a coarse surface fell "
      "from {} to {}",
      moves.rounds == 1 ? "1 round" : fmt::format("{} rounds", moves.rounds),
      LengthText(moves.rms_move_mm, unit), LengthText(moves.max_move_mm, unit),
      LengthText(moves.rms_before_mm, unit), LengthText(moves.rms_after_mm, unit));
  if (moves.folds_prevented > 0) {
    text += fmt::format("; {} of the triangles were kept from turning over", moves.folds_prevented);
  }
  return text;
}

namespace {

Json VerticesJson(const HSplineSurface& surface) {
  const int coarsest = surface.Columns(0) * surface.Rows(0);
  Json json = {{"total", coarsest + surface.Offsets().size()},
               {"by_level", Json::array({coarsest})}};
  for (int level = 1; level <= surface.shape().max_level; ++level) {
    json["by_level"].push_back(surface.Offsets(level).size());
  }
  return json;
}

Json MovesJson(const FootMoves& moves) {
  return {{"rounds", moves.rounds},
          {"rms_move_mm", moves.rms_move_mm},
          {"max_move_mm", moves.max_move_mm},
          {"coarse_rms_before_mm", moves.rms_before_mm},
          {"coarse_rms_after_mm", moves.rms_after_mm},
          {"folds_prevented", moves.folds_prevented}};
}

// The map of (u,v) that were not given.
Json MapJson(const PointFit& result) {
  return {{"how", result.how},
          {"folded_share", result.map_faults.folded},
          {"collapsed_share", result.map_faults.collapsed}};
}

Json AttributesJson(const PointFit& result) {
  Json json = Json::array();
  for (std::size_t k = 0; k < result.attributes.size(); ++k) {
    const AttributeColumn& column = result.attribute_fit.columns[k];
    json.push_back({{"name", result.attributes[k].name},
                    {"rms", column.rms},
                    {"weight", column.weight},
                    {"degrees_of_freedom", column.degrees_of_freedom},
                    {"vertices", column.vertices}});
  }
  return json;
}

Json SigmaJson(const PointFit& result) {
  std::vector<double> at_points = result.sigma_mm;
  return {{"median_mm", Quantile(at_points, 0.5)},
          {"degrees_of_freedom", result.sigma->degrees_of_freedom()}};
}

Json ToleranceJson(const ToleranceReport& tolerance) {
  Json json = {{"tolerance_mm", tolerance.tolerance_mm},
               {"met", tolerance.Met()},
               {"points_beyond", tolerance.beyond},
               {"cells", tolerance.cells},
               {"cells_on_finest_level", tolerance.at_finest}};
  if (tolerance.regions > 0) {
    json["regions"] = tolerance.regions;
  }
  return json;
}

// The entries that every fit has.
Json FiguresJson(const PointFitOptions& options, const PointSource& source,
                 const PointFit& result) {
  return {{"title", options.title},
          {"version", SEMBLANCE_VERSION},
          {"points_file", source.name},
          {"points_sha256", source.sha256},
          {"points", result.fit.residual_mm.size()},
          {"parameters", result.parameters},
          {"unit", result.unit.empty() ? Json(nullptr) : Json(result.unit)},
          {"heights_over_xy", result.is_graph},
          {"height_factor", result.height_factor},
          {"rms_mm", result.fit.point_rms_mm},
          {"rms_of_all_mm", result.rms_of_all_mm},
          {"median_mm", result.distance.median_mm},
          {"p95_mm", result.distance.p95_mm},
          {"max_mm", result.distance.max_mm},
          {"control_vertices", VerticesJson(result.fit.surface)},
          {"usable", result.Faults().empty()},
          {"faults", result.Faults()},
          {"notes", result.notes},
          {"not_finite_count", result.not_finite},
          {"strays", result.strays}};
}

Json FitResultJson(const PointFitOptions& options, const PointSource& source,
                   const PointFit& result) {
  Json json = FiguresJson(options, source, result);
  if (std::isfinite(result.weighted_rms_mm)) {
    json["weighted_rms_mm"] = result.weighted_rms_mm;
  }
  if (!result.how.empty()) {
    json["map"] = MapJson(result);
  }
  if (result.moves) {
    json["moves"] = MovesJson(*result.moves);
  }
  if (!result.attributes.empty()) {
    json["attributes"] = AttributesJson(result);
  }
  if (std::isfinite(result.sigma_factor)) {
    json["sigma_factor"] = result.sigma_factor;
  }
  if (result.sigma) {
    json["sigma"] = SigmaJson(result);
  }
  if (result.fit.automatic) {
    json["automatic"] = AutoJson(*result.fit.automatic);
    if (IsAlone(options.fit)) {
      json["automatic"]["energy_weight"] = result.energy_weight;
    }
  }
  if (const auto tolerance = CompareWithTolerance(options, result)) {
    json["tolerance"] = ToleranceJson(*tolerance);
  }
  json.update(StepsToJson(result.fit));
  return json;
}

void WriteResiduals(ResidualFile kind, const PointFit& result, OutputFolder& folder) {
  constexpr std::size_t kMostAsText = 100'000;  // documented with the option `residuals`
  const ResidualColumns columns{result.fit, result.attributes, result.attribute_at, result.sigma_mm,
                                result.weights};
  if (kind == ResidualFile::kAuto) {
    kind = result.fit.residual_mm.size() <= kMostAsText ? ResidualFile::kCsv : ResidualFile::kPly;
  }
  if (kind == ResidualFile::kCsv) {
    folder.Write("residuals.csv", ResidualsCsv(columns));
  } else if (kind == ResidualFile::kPly) {
    folder.Write("residuals.ply", ResidualsPly(columns));
  }
}

// Each file holds one attribute, as x.
void WriteAttributes(const PointFit& result, OutputFolder& folder) {
  for (std::size_t k = 0; k < result.attribute_fit.surfaces.size(); ++k) {
    folder.Write(fmt::format("attributes_{}.hspline.json", k + 1),
                 HSplineToJson(result.attribute_fit.surfaces[k]));
  }
}

// Lines for the terminal, besides the figures.
std::vector<std::string> TerminalNotes(const PointFitOptions& options, const PointFit& result,
                                       double chord_mm) {
  std::vector<std::string> notes;
  for (const std::string& note : result.notes) {
    notes.push_back("note: " + note);
  }
  if (std::isfinite(result.weighted_rms_mm)) {
    notes.push_back(fmt::format(
        "weighted RMS {}: points count by their weights, as in the fit; in the RMS they "
        "all count alike",
        LengthText(result.weighted_rms_mm, result.unit)));
  }
  if (!result.how.empty()) {
    notes.push_back(fmt::format("(u,v) by {}", result.how));
  }
  if (result.moves) {
    notes.push_back(MovesText(*result.moves, result.unit));
  }
  for (std::size_t k = 0; k < result.attributes.size(); ++k) {
    const AttributeColumn& column = result.attribute_fit.columns[k];
    notes.push_back(fmt::format("{}: RMS {:.4g}, {} control vertices", result.attributes[k].name,
                                column.rms, column.vertices));
  }
  if (std::isfinite(result.sigma_factor)) {
    notes.push_back(
        fmt::format("the points are off by {:.3g} times the given sigma", result.sigma_factor));
  }
  for (const std::string& unused : UnusedOptions(options.fit)) {
    notes.push_back("fit." + unused);
  }
  if (!options.chord_mm.automatic && chord_mm > options.chord_mm.value) {
    notes.push_back(fmt::format(
        "surface.ply is within {} of the surface; {} would need too many triangles",
        LengthText(chord_mm, result.unit, 3), LengthText(options.chord_mm.value, result.unit)));
  }
  return notes;
}

}  // namespace

std::vector<std::string> WritePointFit(const PointFitOptions& options, const PointSource& source,
                                       const PointFit& result, OutputFolder& folder,
                                       const RunContext& context) {
  context.Report("write");
  // The mesh comes first, because it can still be refused.
  const double chord_mm = ChooseChord(result, options.chord_mm);
  const std::string ply = SurfacePly(result, chord_mm, context.threads);
  folder.Write("resolved.yaml", WriteConfig(options));
  folder.Write("surface.hspline.json", HSplineToJson(result.fit.surface));
  folder.Write("surface.ply", ply);
  WriteResiduals(options.residuals, result, folder);
  WriteAttributes(result, folder);
  if (options.report && result.Faults().empty()) {
    folder.Write("report.html", FitPageHtml(options, source, result, context.threads));
  }
  folder.Write("timing.json", TimingJson(result.times));
  folder.Write("result.json",
               WithPlainTexts(FitResultJson(options, source, result)).dump(2) + "\n");
  return TerminalNotes(options, result, chord_mm);
}

}  // namespace semblance::problems
