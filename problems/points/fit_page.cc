// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/fit_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>

#include "problems/config/config.h"
#include "problems/plots/histogram.h"
#include "problems/points/fit_maps.h"
#include "problems/points/fit_picture.h"
#include "problems/points/fit_report.h"
#include "problems/report/plain_names.h"
#include "problems/report/report.h"

namespace semblance {
namespace {

// What several parts of the page tell of; none where no plan had one.
using Tolerance = std::optional<ToleranceReport>;

std::string Figure(double value) {
  return std::isfinite(value) ? fmt::format("{:.3g}", value) : "";
}

std::size_t VerticesOf(const HSplineSurface& surface) {
  return surface.Net(0).vertices.size() + surface.Offsets().size();
}

std::vector<std::string> Notes(const PointFit& result, const Tolerance& tolerance) {
  std::vector<std::string> notes;
  for (const std::string& fault : result.Faults()) {
    notes.push_back("The result is not usable: " + fault);
  }
  if (tolerance) {
    notes.push_back(ToleranceText(*tolerance));
  }
  if (result.moves) {
    notes.push_back(MovesText(*result.moves));
  }
  if (result.fit.automatic) {
    std::istringstream lines(AutoText(*result.fit.automatic));
    for (std::string line; std::getline(lines, line);) {
      notes.push_back(line);
    }
  }
  return notes;
}

std::vector<ReportTile> Tiles(const PointFit& result, const Tolerance& tolerance) {
  std::vector<ReportTile> tiles = {
      {"points", std::to_string(result.fit.residual_mm.size()), "", "(u,v): " + result.parameters},
      {"RMS distance", Figure(result.fit.point_rms_mm), "mm", "of the points from the surface"},
      {"median", Figure(result.distance.median_mm), "mm", ""},
      {"95th percentile", Figure(result.distance.p95_mm), "mm", ""},
      {"largest", Figure(result.distance.max_mm), "mm", ""},
      {"control vertices", std::to_string(VerticesOf(result.fit.surface)), "", ""}};
  if (std::isfinite(result.weighted_rms_mm)) {
    tiles.insert(tiles.begin() + 2, {"weighted RMS", Figure(result.weighted_rms_mm), "mm",
                                     "points count by their weights, as in the fit"});
  }
  if (tolerance) {
    tiles.push_back({"tolerance", tolerance->Met() ? "met" : "missed", "",
                     fmt::format("{:.4g} mm; {} beyond it", tolerance->tolerance_mm,
                                 Counted(tolerance->beyond, "point"))});
  }
  if (result.fit.automatic) {
    tiles.push_back(
        {"noise", Figure(result.fit.automatic->noise_mm), "mm",
         fmt::format(
             "a coordinate{}, as found; {} left out",
             result.fit.automatic->weighted ? " of a point of mean weight" : "",
             Counted(static_cast<long long>(result.fit.automatic->outliers.size()), "outlier"))});
  }
  return tiles;
}

ReportSection DistanceSection(const PointFit& result, const Tolerance& tolerance) {
  std::vector<HistogramMark> marks = {{result.fit.point_rms_mm, "RMS"},
                                      {result.distance.p95_mm, "95 %"}};
  if (tolerance) {
    marks.push_back({tolerance->tolerance_mm, "tolerance"});
  }
  return {.heading = "How far the points are off",
          .images = {{HistogramSvg(result.fit.residual_mm, marks, "distance (mm)"),
                      "All points by their distance from the surface at their (u,v), outliers too.",
                      "histogram of the points' distances"}}};
}

ReportTable CellsTable(const std::vector<FitCell>& cells) {
  struct Level {
    int cells = 0, points = 0;
    double area = 0, squares = 0, largest = 0;
  };
  std::map<int, Level> levels;
  for (const FitCell& cell : cells) {
    Level& level = levels[cell.level];
    ++level.cells;
    level.points += cell.points;
    level.area += cell.width * cell.height;
    level.squares += cell.sum_squares_mm2;
    level.largest = std::max(level.largest, cell.largest_mm);
  }
  ReportTable table{"Cells of the surface by level, each a polynomial of its own; outliers apart",
                    {"level", "cells", "of the domain (%)", "points", "RMS (mm)", "largest (mm)"},
                    {}};
  for (const auto& [number, level] : levels) {
    table.rows.push_back({std::to_string(number), std::to_string(level.cells),
                          fmt::format("{:.1f}", 100 * level.area), std::to_string(level.points),
                          level.points > 0 ? Figure(std::sqrt(level.squares / level.points)) : "",
                          level.points > 0 ? Figure(level.largest) : ""});
  }
  return table;
}

// The cells with the farthest points.
ReportTable WorstTable(std::vector<FitCell> cells) {
  constexpr std::size_t kMost = 20;
  std::erase_if(cells, [](const FitCell& cell) { return cell.points == 0; });
  std::ranges::stable_sort(cells, std::ranges::greater(), &FitCell::largest_mm);
  cells.resize(std::min(cells.size(), kMost));
  ReportTable table{"The cells with the farthest points",
                    {"u", "v", "level", "points", "RMS (mm)", "largest (mm)"},
                    {}};
  for (const FitCell& cell : cells) {
    table.rows.push_back({fmt::format("{:.4g} to {:.4g}", cell.u, cell.u + cell.width),
                          fmt::format("{:.4g} to {:.4g}", cell.v, cell.v + cell.height),
                          std::to_string(cell.level), std::to_string(cell.points),
                          Figure(std::sqrt(cell.sum_squares_mm2 / cell.points)),
                          Figure(cell.largest_mm)});
  }
  return table;
}

ReportTable RoundsTable(const FitResult& fit, std::string_view weighted) {
  ReportTable table{fmt::format("Round by round{}", weighted),
                    {"round", "finest level", "RMS before (mm)", "RMS after (mm)", "vertices free",
                     "weight of smoothness", "steps of the solver", "solver"},
                    {}};
  for (const LevelSummary& level : fit.levels) {
    table.rows.push_back({std::to_string(table.rows.size() + 1), std::to_string(level.level),
                          Figure(level.rms_before_mm), Figure(level.rms_after_mm),
                          level.free_vertices < 0 ? "" : std::to_string(level.free_vertices),
                          Figure(level.auto_weight),
                          level.iterations < 0 ? "" : std::to_string(level.iterations),
                          level.solver});
  }
  return table;
}

ReportTable AutoTable(const AutoReport& report, std::string_view weighted) {
  ReportTable table{
      fmt::format("What was tried, and what it would have predicted of the points held out{}",
                  weighted),
      {"round", "finest level", "vertices", "degrees of freedom", "weight", "RMS (mm)",
       "held out (mm)", "outliers"},
      {}};
  for (const NestedRound& round : report.rounds) {
    const bool chosen = static_cast<int>(table.rows.size()) == report.chosen_round;
    table.rows.push_back({fmt::format("{}{}", table.rows.size() + 1, chosen ? " (taken)" : ""),
                          fmt::format("{}", round.finest), fmt::format("{}", round.vertices),
                          Figure(round.degrees_of_freedom), Figure(round.weight),
                          Figure(round.rms_mm), Figure(round.held_out_rms_mm),
                          fmt::format("{}", round.outliers)});
  }
  return table;
}

ReportSection RoundsSection(const FitResult& fit, bool is_weighted) {
  const std::string_view weighted = is_weighted ? "; RMS with the points' weights" : "";
  ReportSection section{.heading = "The fit, round by round", .folded = true};
  if (fit.automatic) {
    section.tables.push_back(AutoTable(*fit.automatic, weighted));
  }
  if (!fit.levels.empty()) {
    section.tables.push_back(RoundsTable(fit, weighted));
  }
  return section;
}

}  // namespace

std::string FitPageHtml(const PointFitOptions& options, const PointSource& source,
                        const PointFit& result, int threads) {
  const Tolerance tolerance = ToleranceOf(options, result);
  const FitGrid grid = GridOf(result.fit, threads);
  const std::vector<FitCell> cells = CellsOf(result.fit);
  Report report;
  report.title = options.title == PointFitOptions().title ? source.name : options.title;
  report.subtitle = fmt::format(
      "An H-spline surface through {} of {}",
      Counted(static_cast<long long>(result.fit.residual_mm.size()), "point"), source.name);
  report.notes = Notes(result, tolerance);
  report.scenes = FitScene(grid);
  report.scenes_note = "Thinned out for looking; surface.hspline.json is exact.";
  report.main_images = {
      {SurfacePng(grid, threads), "", "the surface, and the points' distances in colours on it"}};
  report.tiles = Tiles(result, tolerance);
  report.sections = {
      DistanceSection(result, tolerance),
      {.heading = "Where it was refined",
       .images = {{DomainPng(grid, cells),
                   "The domain: u to the right, v upwards. Grey: no point there.",
                   "points' distances and levels of the cells over the domain"}},
       .tables = {CellsTable(cells), WorstTable(cells)}},
      RoundsSection(result.fit, std::isfinite(result.weighted_rms_mm)),
      {.heading = "All options", .preformatted = WriteConfig(options), .folded = true}};
  report.footer =
      fmt::format("semblance {}; {}: SHA-256 {}", SEMBLANCE_VERSION, source.name, source.sha256);
  return ReportHtml(report);
}

}  // namespace semblance
