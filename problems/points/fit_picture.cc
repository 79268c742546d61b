// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/fit_picture.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <utility>

#include "problems/report/pictures/lighting.h"
#include "problems/report/pictures/pictures.h"
#include "problems/report/scene_json.h"
#include "problems/report/view/view_mesh.h"
#include "surfaces/base/quantile.h"

namespace semblance::problems {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kPixels = 560;

// The mean of the normals, which is near 1 for a height field and near 0 for what goes round.
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

// The bounds of the vertices that have triangles.
Box3 BoxShown(const TriMesh& mesh, const Mat3& view_from_world) {
  Box3 box;
  for (const Triangle& t : mesh.triangles) {
    for (const int corner : t) {
      box.extend(view_from_world * mesh.points[corner]);
    }
  }
  return box;
}

Camera Framed(const TriMesh& mesh, const Mat3& view_from_world) {
  const Box3 box = BoxShown(mesh, view_from_world);
  constexpr double kMargin = 1.08;
  return {.view_from_world = view_from_world,
          .centre = view_from_world.transpose() * box.center(),
          .height_mm = kMargin * std::max(box.sizes().x(), box.sizes().y())};
}

// 40 degrees above the plane of a height field, its longer side to the right.
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

Camera CameraOf(const TriMesh& mesh) {
  constexpr double kHeightField = 0.5;
  const Vec3 normal = MeanNormal(mesh);
  if (normal.norm() >= kHeightField) {
    return FromAbove(mesh, normal);
  }
  const Box3 box = BoxShown(mesh, Mat3::Identity());
  return Framed(mesh, CameraFor(View::kThreeQuarter, box, 1).view_from_world);
}

RenderOptions Options(Lighting lighting) {
  RenderOptions options;
  options.width = kPixels;
  options.height = kPixels;
  options.lighting = lighting;
  return options;
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
    const int gap = right - left > 4 && bottom - top > 4 ? 1 : 0;  // the cells' edges
    FillRectangle(image, left, top, right - left - gap, bottom - top - gap,
                  ColourAt(map, cell.level));
  }
  return image;
}

}  // namespace

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

Legend DistanceLegend(const FitGrid& grid, const std::string& unit) {
  return {.map = DistanceColours(grid), .title = "distance of the points", .unit = unit};
}

std::string SurfacePng(const FitGrid& fine, int threads) {
  const FitGrid grid = Halved(fine);  // the lights of all would cost four times as much
  const Camera camera = CameraOf(grid.mesh);
  Scene plain, mapped;
  plain.objects = {{.mesh = grid.mesh, .material = PlasticMaterial({0.62, 0.70, 0.78})}};
  mapped.objects = {MappedObject(grid.mesh, grid.rms_mm, DistanceColours(fine))};
  ShadowMaps shadows;    // of one mesh
  shadows.texels = 256;  // several from a vertex to the next of 71
  const auto render = [&](const Scene& scene, Lighting lighting) {
    return std::move(RenderAll(scene, {&camera, 1}, Options(lighting), shadows, threads).front());
  };
  const std::array<Image, 2> pictures = {render(plain, Lighting::kStudio),
                                         render(mapped, Lighting::kEven)};
  return EncodePng(ContactSheet(pictures), PngEffort::kQuick);
}

std::string DomainPng(const FitGrid& grid, const std::vector<FitCell>& cells) {
  const std::array<Image, 2> pictures = {DistancePicture(grid), LevelPicture(cells)};
  return EncodePng(ContactSheet(pictures), PngEffort::kQuick);
}

namespace {

// A mesh and the points' distances at its vertices.
struct ShownGrid {
  TriMesh mesh;
  std::vector<double> rms_mm;
};

// Without the vertices of no triangle: the view frames all that it is given.
ShownGrid ShownOf(const FitGrid& grid) {
  ShownGrid shown{.mesh = grid.mesh, .rms_mm = {}};
  for (const std::int32_t vertex : DropUnusedPoints(shown.mesh)) {
    shown.rms_mm.push_back(grid.rms_mm[vertex]);
  }
  return shown;
}

}  // namespace

std::string FitScene(const FitGrid& grid, const std::string& unit) {
  const ColourMap map = DistanceColours(grid);
  const double scale = map.high_mm / 100;  // what is written has whole hundredths
  ShownGrid shown = ShownOf(grid);
  for (double& value : shown.rms_mm) {
    value /= scale;
  }
  SceneBlobs blobs;
  const std::string mesh = blobs.AddMesh(shown.mesh);
  Json scene = {
      {"label", "surface"},
      {"facts", Json::array()},
      {"unit", unit},
      {"axes", {"+x", "\u2212x", "+y", "\u2212y", "+z", "\u2212z"}},
      {"maps",
       {{"distance",
         {{"title", "distance of the points"},
          {"unit", unit},
          {"low_mm", 0},
          {"high_mm", 100},
          {"scale", scale},
          {"no_data", HexText(kNoDataColour)},
          {"colours", ColourSteps(map)}}}}},
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

}  // namespace semblance::problems
