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
#include "problems/points/fit_maps.h"
#include "problems/points/fit_picture.h"
#include "problems/points/fit_report.h"
#include "problems/points/height_field.h"
#include "problems/report/plain_names.h"
#include "problems/report/plots/svg_plot.h"
#include "problems/report/report_kit.h"

namespace semblance::problems {
namespace {

// Used by several parts of the page. None if no plan has a tolerance.
using Tolerance = std::optional<ToleranceReport>;

std::size_t CountVertices(const HSplineSurface& surface) {
  return surface.Net(0).vertices.size() + surface.Offsets().size();
}

// A heading with the unit of its lengths, if that is known.
std::string Heading(std::string_view name, const std::string& unit) {
  return unit.empty() ? std::string(name) : fmt::format("{} ({})", name, unit);
}

std::vector<std::string> Notes(const PointFit& result, const Tolerance& tolerance) {
  std::vector<std::string> notes = result.notes;
  if (tolerance) {
    notes.push_back(ToleranceText(*tolerance, result.unit));
  }
  if (result.moves) {
    notes.push_back(MovesText(*result.moves, result.unit));
  }
  if (result.fit.automatic) {
    std::istringstream lines(AutoText(*result.fit.automatic, result.unit));
    for (std::string line; std::getline(lines, line);) {
      notes.push_back(line);
    }
  }
  return notes;
}

std::vector<ReportTile> Tiles(const PointFit& result, const Tolerance& tolerance) {
  std::vector<ReportTile> tiles = {
      {"points", std::to_string(result.fit.residual_mm.size()), "", "(u,v): " + result.parameters},
      {"RMS distance", TableFigures(result.fit.point_rms_mm), result.unit,
       "of the points from the surface"},
      {"median", TableFigures(result.distance.median_mm), result.unit, ""},
      {"95th percentile", TableFigures(result.distance.p95_mm), result.unit, ""},
      {"largest", TableFigures(result.distance.max_mm), result.unit, ""},
      {"control vertices", std::to_string(CountVertices(result.fit.surface)), "", ""}};
  if (std::isfinite(result.weighted_rms_mm)) {
    tiles.insert(tiles.begin() + 2, {"weighted RMS", TableFigures(result.weighted_rms_mm),
                                     result.unit, "points count by their weights, as in the fit"});
  }
  if (tolerance) {
    tiles.push_back(
        {"tolerance", tolerance->Met() ? "met" : "missed", "",
         fmt::format("{}; {} beyond it", LengthText(tolerance->tolerance_mm, result.unit),
                     Counted(tolerance->beyond, "point"))});
  }
  if (result.fit.automatic) {
    tiles.push_back(
        {"noise", TableFigures(result.fit.automatic->noise_mm), result.unit,
         fmt::format(
             "a coordinate{}, as found; {} left out",
             result.fit.automatic->weighted ? " of a point of mean weight" : "",
             Counted(static_cast<long long>(result.fit.automatic->outliers.size()), "outlier"))});
  }
  return tiles;
}

// The distances of the points that took part in the fit.
std::vector<double> KnownDistances(const FitResult& fit) {
  std::vector<double> known = fit.residual_mm;
  std::erase_if(known, [](double distance) { return !std::isfinite(distance); });
  return known;
}

ReportSection DistanceSection(const PointFit& result, const Tolerance& tolerance) {
  std::vector<HistogramMark> marks = {{result.fit.point_rms_mm, "RMS"},
                                      {result.distance.p95_mm, "95 %"}};
  if (tolerance) {
    marks.push_back({tolerance->tolerance_mm, "tolerance"});
  }
  return {.heading = "Distances of the points",
          .images = {
              {HistogramSvg(KnownDistances(result.fit), marks, Heading("distance", result.unit)),
               "All points, including outliers, by their distance from the surface at their (u,v).",
               "histogram of the points' distances"}}};
}

ReportTable CellsTable(const std::vector<FitCell>& cells, const std::string& unit) {
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
  ReportTable table{
      "Cells of the surface by level, without outliers; each cell is one polynomial patch",
      {"level", "cells", "of the domain (%)", "points", Heading("RMS", unit),
       Heading("largest", unit)}};
  for (const auto& [number, level] : levels) {
    table.AddRow(number, level.cells, TablePercent(level.area), level.points,
                 level.points > 0 ? TableFigures(std::sqrt(level.squares / level.points)) : "",
                 level.points > 0 ? TableFigures(level.largest) : "");
  }
  return table;
}

// The cells with the farthest points.
ReportTable WorstTable(std::vector<FitCell> cells, const std::string& unit) {
  constexpr std::size_t kMost = 20;
  std::erase_if(cells, [](const FitCell& cell) { return cell.points == 0; });
  std::ranges::stable_sort(cells, std::ranges::greater(), &FitCell::largest_mm);
  cells.resize(std::min(cells.size(), kMost));
  ReportTable table{"The cells with the farthest points",
                    {"u", "v", "level", "points", Heading("RMS", unit), Heading("largest", unit)}};
  for (const FitCell& cell : cells) {
    table.AddRow(fmt::format("{:.4g} to {:.4g}", cell.u, cell.u + cell.width),
                 fmt::format("{:.4g} to {:.4g}", cell.v, cell.v + cell.height), cell.level,
                 cell.points, TableFigures(std::sqrt(cell.sum_squares_mm2 / cell.points)),
                 TableFigures(cell.largest_mm));
  }
  return table;
}

ReportTable RoundsTable(const FitResult& fit, std::string_view weighted, const std::string& unit) {
  ReportTable table{
      fmt::format("Round by round{}", weighted),
      {"round", "finest level", Heading("RMS before", unit), Heading("RMS after", unit),
       "vertices free", "weight of smoothness", "steps of the solver", "solver"}};
  for (const LevelSummary& level : fit.levels) {
    table.AddRow(table.rows.size() + 1, level.level, TableFigures(level.rms_before_mm),
                 TableFigures(level.rms_after_mm),
                 level.free_vertices < 0 ? "" : std::to_string(level.free_vertices),
                 TableFigures(level.auto_weight),
                 level.iterations < 0 ? "" : std::to_string(level.iterations), level.solver);
  }
  return table;
}

ReportTable AutoTable(const AutoReport& report, std::string_view weighted,
                      const std::string& unit) {
  ReportTable table{
      fmt::format("Rounds of the automatic choice, and their error at held-out points{}", weighted),
      {"round", "finest level", "vertices", "degrees of freedom", "weight", Heading("RMS", unit),
       Heading("held out", unit), "outliers"}};
  for (const NestedRound& round : report.rounds) {
    const bool chosen = static_cast<int>(table.rows.size()) == report.chosen_round;
    table.AddRow(fmt::format("{}{}", table.rows.size() + 1, chosen ? " (taken)" : ""), round.finest,
                 round.vertices, TableFigures(round.degrees_of_freedom), TableFigures(round.weight),
                 TableFigures(round.rms_mm), TableFigures(round.held_out_rms_mm), round.outliers);
  }
  return table;
}

ReportSection RoundsSection(const FitResult& fit, bool is_weighted, const std::string& unit) {
  const std::string_view weighted = is_weighted ? "; RMS with the points' weights" : "";
  ReportSection section{.heading = "The fit, round by round", .folded = true};
  if (fit.automatic) {
    section.tables.push_back(AutoTable(*fit.automatic, weighted, unit));
  }
  if (!fit.levels.empty()) {
    section.tables.push_back(RoundsTable(fit, weighted, unit));
  }
  return section;
}

// Multiplies z of heights over x and y that would look like a needle or like a plane. Returns the
// factor.
double ShowHeights(const PointFit& result, FitGrid& grid) {
  constexpr double kLow = 0.1, kHigh = 2;  // of the factor of the fit, which brings z to a quarter
  const double factor = result.height_factor;
  if (factor > kLow && factor < kHigh) {
    return 1;
  }
  ScaleHeights(factor, grid.mesh.points);
  return factor;
}

}  // namespace

std::string FitPageHtml(const PointFitOptions& options, const PointSource& source,
                        const PointFit& result, int threads) {
  const Tolerance tolerance = CompareWithTolerance(options, result);
  FitGrid grid = SampleFit(result.fit, threads);
  const double exaggeration = ShowHeights(result, grid);
  const std::vector<FitCell> cells = FindFitCells(result.fit);
  Report report;
  report.title = options.title == PointFitOptions().title ? source.name : options.title;
  report.subtitle = fmt::format(
      "An H-spline surface through {} of {}",
      Counted(static_cast<long long>(result.fit.residual_mm.size()), "point"), source.name);
  report.faults = result.Faults();
  report.notes = Notes(result, tolerance);
  report.scenes = FitScene(grid, result.unit);
  report.scenes_note = exaggeration == 1
                           ? "Simplified for display; surface.hspline.json is exact."
                           : fmt::format(
                                 "Simplified for display, with z multiplied by {:.3g}; "
                                 "surface.hspline.json is exact.",
                                 exaggeration);
  report.main_images = {
      {SurfacePng(grid, threads),
       "Left: the surface. Right: the surface, coloured by the distance of the points.",
       "the surface, and the points' distances in colours on it",
       {DistanceLegend(grid, result.unit)}}};
  report.tiles = Tiles(result, tolerance);
  report.sections = {
      DistanceSection(result, tolerance),
      {.heading = "Refinement",
       .images =
           {{DomainPng(grid, cells),
             "The domain, u to the right and v upwards. Left: distance of the points; grey has "
             "no points. Right: cells of the surface; brighter cells are finer.",
             "points' distances and levels of the cells over the domain",
             {DistanceLegend(grid, result.unit)}}},
       .tables = {CellsTable(cells, result.unit), WorstTable(cells, result.unit)}},
      RoundsSection(result.fit, std::isfinite(result.weighted_rms_mm), result.unit),
      {.heading = "All options", .preformatted = WriteConfig(options), .folded = true}};
  report.footer = fmt::format("{}: SHA-256 {}", source.name, source.sha256);
  return ReportHtml(report);
}

}  // namespace semblance::problems
