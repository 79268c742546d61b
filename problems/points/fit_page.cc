// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/fit_page.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>

#include "problems/config/config.h"
#include "problems/pictures/colour_map.h"
#include "problems/pictures/lighting.h"
#include "problems/pictures/pictures.h"
#include "problems/plots/histogram.h"
#include "problems/points/fit_report.h"
#include "problems/report/plain_names.h"
#include "problems/report/report.h"
#include "problems/report/scene_blobs.h"
#include "problems/report/scene_json.h"
#include "surfaces/base/quantile.h"

namespace semblance {
namespace {

// ------------------------------------------------------------------------ pictures

using Json = nlohmann::ordered_json;

constexpr int kPixels = 560;  // width and height of each picture

// The mean of the unit normals. Its length is near 1 for a height field and near 0 for a tube.
Vec3 MeanNormal(const TriMesh& mesh) {
  Vec3 sum = Vec3::Zero();
  double area = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 normal =
        (mesh.points[t[1]] - mesh.points[t[0]]).cross(mesh.points[t[2]] - mesh.points[t[0]]);
    sum += normal;
    area += normal.norm();
  }
  return area > 0 ? Vec3(sum / area) : Vec3::Zero();
}

Box3 BoxOf(const TriMesh& mesh, const Mat3& view_from_world) {
  Box3 box;
  for (const Vec3& p : mesh.points) {
    box.extend(view_from_world * p);
  }
  return box;
}

Camera Framed(const TriMesh& mesh, const Mat3& view_from_world) {
  const Box3 box = BoxOf(mesh, view_from_world);
  constexpr double kMargin = 1.08;
  return {.view_from_world = view_from_world,
          .centre = view_from_world.transpose() * box.center(),
          .height_mm = kMargin * std::max(box.sizes().x(), box.sizes().y())};
}

// A view from 40 degrees above the plane of a height field, with the x axis to the right.
Camera FromAbove(const TriMesh& mesh, Vec3 up) {
  constexpr double kRise = 40 * EIGEN_PI / 180;
  Eigen::Index largest = 0;
  up.cwiseAbs().maxCoeff(&largest);
  up = up[largest] < 0 ? Vec3(-up.normalized()) : Vec3(up.normalized());
  const Vec3 axis = std::abs(up.x()) < 0.9 ? Vec3::UnitX() : Vec3::UnitY();
  const Vec3 right = (axis - axis.dot(up) * up).normalized(), forward = up.cross(right);
  const Vec3 towards = std::sin(kRise) * up - std::cos(kRise) * forward;
  Mat3 view;
  view.row(0) = right;
  view.row(1) = towards.cross(right);
  view.row(2) = towards;
  return Framed(mesh, view);
}

Camera ChooseCamera(const TriMesh& mesh) {
  constexpr double kHeightField = 0.5;  // least length of the mean normal; half a tube has 0.64
  const Vec3 normal = MeanNormal(mesh);
  if (normal.norm() >= kHeightField) {
    return FromAbove(mesh, normal);
  }
  const Box3 box = BoxOf(mesh, Mat3::Identity());
  return Framed(mesh, CameraFor(View::kThreeQuarter, box, 1).view_from_world);
}

RenderOptions Options(Lighting lighting) {
  RenderOptions options;
  options.width = kPixels;
  options.height = kPixels;
  options.lighting = lighting;
  return options;
}

// Colours from 0 to the distance that 98 % of the vertices are below, so that a few far points do
// not darken the rest.
ColourMap DistanceColours(const FitGrid& grid) {
  std::vector<double> known;
  std::ranges::copy_if(grid.rms_mm, std::back_inserter(known),
                       [](double v) { return std::isfinite(v); });
  double high = 0;
  if (!known.empty()) {
    high = Quantile(known, 0.98);
  }
  return SequentialMap(0, high > 0 ? high : 1);
}

Legend DistanceLegend(const FitGrid& grid) {
  return {.map = DistanceColours(grid), .title = "distance of the points"};
}

Image DistancePicture(const FitGrid& grid) {
  const ColourMap map = DistanceColours(grid);
  Image image = MakeImage(kPixels, kPixels, {1, 1, 1});
  const auto edge = [](int k, int cells) { return k * kPixels / cells; };
  for (int j = 0; j < grid.rows; ++j) {
    for (int i = 0; i < grid.columns; ++i) {
      const int left = edge(i, grid.columns), top = edge(grid.rows - 1 - j, grid.rows);
      FillRectangle(image, left, top, edge(i + 1, grid.columns) - left,
                    edge(grid.rows - j, grid.rows) - top,
                    ColourAt(map, grid.rms_mm[static_cast<std::size_t>(j) * grid.columns + i]));
    }
  }
  return image;
}

Image LevelPicture(const std::vector<FitCell>& cells) {
  int finest = 1;
  for (const FitCell& cell : cells) {
    finest = std::max(finest, cell.level);
  }
  const ColourMap map = SequentialMap(0, finest);
  Image image = MakeImage(kPixels, kPixels, {1, 1, 1});
  const auto pixel = [](double t) { return static_cast<int>(std::lround(t * kPixels)); };
  for (const FitCell& cell : cells) {
    const int left = pixel(cell.u), right = pixel(cell.u + cell.width),
              top = kPixels - pixel(cell.v + cell.height), bottom = kPixels - pixel(cell.v);
    const int gap = right - left > 4 && bottom - top > 4 ? 1 : 0;  // between cells
    FillRectangle(image, left, top, right - left - gap, bottom - top - gap,
                  ColourAt(map, cell.level));
  }
  return image;
}

// PNG of the surface from obliquely above, or from between front and side if it goes round: plain,
// and coloured by the points' distances.
std::string SurfacePng(const FitGrid& fine, int threads) {
  const FitGrid grid = Halved(fine);  // the shadows of all vertices would cost four times as much
  const Camera camera = ChooseCamera(grid.mesh);
  Scene plain, mapped;
  plain.objects = {{.mesh = grid.mesh, .material = PlasticMaterial({0.62, 0.70, 0.78})}};
  mapped.objects = {MappedObject(grid.mesh, grid.rms_mm, DistanceColours(grid))};
  ShadowMaps shadows;    // shared: both pictures show one mesh
  shadows.texels = 256;  // several between neighbours of the 71 vertices
  const auto render = [&](const Scene& scene, Lighting lighting) {
    return std::move(RenderAll(scene, {&camera, 1}, Options(lighting), shadows, threads).front());
  };
  const std::array<Image, 2> pictures = {render(plain, Lighting::kStudio),
                                         render(mapped, Lighting::kEven)};
  return EncodePng(ContactSheet(pictures, {.title = "",
                                           .captions = {"the surface", "distance of the points"},
                                           .legend = DistanceLegend(grid)}),
                   PngEffort::kQuick);
}

// PNG of the domain, u to the right and v upwards: the points' distances, and the cells, the finer
// the brighter.
std::string DomainPng(const FitGrid& grid, const std::vector<FitCell>& cells) {
  const std::array<Image, 2> pictures = {DistancePicture(grid), LevelPicture(cells)};
  return EncodePng(
      ContactSheet(pictures, {.title = "",
                              .captions = {"distance over (u,v)", "cells: the brighter, the finer"},
                              .legend = DistanceLegend(grid)}),
      PngEffort::kQuick);
}

// A mesh and the points' distances at its vertices.
struct ShownGrid {
  TriMesh mesh;
  std::vector<double> rms_mm;
};

// Drops the vertices without triangles, because the view frames all vertices.
ShownGrid DropHiddenVertices(const FitGrid& grid) {
  ShownGrid shown{.mesh = grid.mesh, .rms_mm = {}};
  for (const std::int32_t vertex : DropUnusedPoints(shown.mesh)) {
    shown.rms_mm.push_back(grid.rms_mm[vertex]);
  }
  return shown;
}

// The scene of the 3-D view (scene_json.h): the surface, plain and by distance.
std::string FitScene(const FitGrid& grid) {
  const ColourMap map = DistanceColours(grid);
  const double scale = map.high_mm / 100;  // the scene stores whole hundredths
  ShownGrid shown = DropHiddenVertices(grid);
  for (double& value : shown.rms_mm) {
    value /= scale;
  }
  SceneBlobs blobs;
  const std::string mesh = blobs.AddMesh(shown.mesh);
  Json colours = Json::array();
  for (int k = 0; k <= 32; ++k) {
    colours.push_back(HexText(ColourAt(map, map.high_mm * k / 32)));
  }
  Json scene = {
      {"label", "surface"},
      {"facts", Json::array()},
      {"axes", {"+x", "\u2212x", "+y", "\u2212y", "+z", "\u2212z"}},
      {"maps",
       {{"distance",
         {{"title", "distance of the points"},
          {"low_mm", 0},
          {"high_mm", 100},
          {"scale", scale},
          {"no_data", HexText(kNoDataColour)},
          {"colours", colours}}}}},
      {"layers",
       {{{"id", "distance"},
         {"label", "Surface by distance"},
         {"colour", "#9fb2c4"},
         {"mesh", mesh},
         {"shown", true},
         {"map", "distance"},
         {"always_mapped", true},
         {"values", blobs.AddValues(shown.rms_mm)}},
        {{"id", "surface"}, {"label", "Surface, plain"}, {"colour", "#9fb2c4"}, {"mesh", mesh}}}},
      {"blobs", blobs.All()}};
  return CollectScene("surface", std::move(scene));
}

// ---------------------------------------------------------------------- the page

using Tolerance = std::optional<ToleranceReport>;  // of an adaptive plan

std::string Figure(double value) {
  return std::isfinite(value) ? fmt::format("{:.3g}", value) : "";
}

std::size_t CountVertices(const HSplineSurface& surface) {
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
      {"control vertices", std::to_string(CountVertices(result.fit.surface)), "", ""}};
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
  return {.heading = "Distances of the points",
          .images = {
              {HistogramSvg(result.fit.residual_mm, marks, "distance (mm)"),
               "All points by their distance from the surface at their (u,v), outliers included.",
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
  ReportTable table{"Cells of the surface by level, each with its own polynomial; without outliers",
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
      fmt::format("The surfaces that were tried, and their prediction of the points held out{}",
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
  const Tolerance tolerance = CompareWithTolerance(options, result);
  const FitGrid grid = SampleFit(result.fit, threads);
  const std::vector<FitCell> cells = FindFitCells(result.fit);
  Report report;
  report.title = options.title == PointFitOptions().title ? source.name : options.title;
  report.subtitle = fmt::format(
      "An H-spline surface through {} of {}",
      Counted(static_cast<long long>(result.fit.residual_mm.size()), "point"), source.name);
  report.notes = Notes(result, tolerance);
  report.scenes = FitScene(grid);
  report.scenes_note = "A thinned-out view; surface.hspline.json is exact.";
  report.main_images = {
      {SurfacePng(grid, threads), "", "the surface, and the points' distances in colours on it"}};
  report.tiles = Tiles(result, tolerance);
  report.sections = {
      DistanceSection(result, tolerance),
      {.heading = "Refinement",
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
