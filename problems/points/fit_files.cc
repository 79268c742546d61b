// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/fit_files.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <utility>
#include <vector>

#include "fitting/fit.h"
#include "problems/points/height_field.h"
#include "surfaces/base/csv.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline/patch_tree.h"
#include "surfaces/hspline_query/tessellate.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance::problems {
namespace {

double BoxDiagonal(std::span<const Vec3> positions) {
  Box3 box;
  for (const Vec3& p : positions) {
    box.extend(p);
  }
  return box.diagonal().norm();
}

// Chords per extent with `auto`: the error is a pixel in a picture that is 5000 pixels wide.
constexpr double kChordsPerExtent = 5000;

// Rounds up to two digits.
double RoundedUp(double value) {
  const double digit = std::pow(10, std::floor(std::log10(value)) - 1);
  return digit * std::ceil(value / digit);
}

void RefuseBelow(double least_mm, double chord_mm) {
  if (chord_mm < least_mm) {
    throw InputError(
        fmt::format("chord_mm: {} is too fine for these points: surface.ply would have too many "
                    "triangles; give at least {:.2g}, or auto",
                    chord_mm, RoundedUp(least_mm)));
  }
}

// chord_mm, or as much more as keeps the number of cells, each of two triangles, at most_cells, or
// at one for each patch of a surface that has more patches.
double AffordableChord(const HSplineSurface& surface, double chord_mm, double most_cells) {
  most_cells = std::max(most_cells, static_cast<double>(PatchTree(surface).leaves().size()));
  while (std::isfinite(chord_mm) && CellsToChord(surface, chord_mm) > most_cells) {
    chord_mm *= 2;
  }
  return chord_mm;
}

// A surface through some of the points, which bends less than the final one.
HSplineSurface RoughSurface(const HSplineSurface& start, const ScatteredPoints& points,
                            const RunContext& context) {
  constexpr std::size_t kEnough = 4000;  // points; more would cost time in proportion
  const std::size_t every = std::max<std::size_t>(points.size() / kEnough, 1);
  std::vector<Vec3> positions;
  std::vector<Vec2> uv;
  for (std::size_t k = 0; k < points.size(); k += every) {
    positions.push_back(points.positions[k]);
    uv.push_back(points.uv[k]);
  }
  const FitOptions rough = PointFitOptions().fit;
  return Fit(start, {positions, uv}, rough, {.on_event = {}, .stop_token = context.stop_token})
      .surface;
}

std::uint8_t AsColour(double value) {
  return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0)));
}

// Returns whether red, green and blue range from 0 to 255, and not from 0 to 1 or from 0 to 65535.
bool AreBytes(std::span<const PointAttribute> attributes,
              const std::array<std::ptrdiff_t, 3>& rgb) {
  double least = 0, most = 0;
  for (const std::ptrdiff_t k : rgb) {
    const auto [low, high] = std::ranges::minmax(attributes[k].values);
    least = std::min(least, low);
    most = std::max(most, high);
  }
  return least >= 0 && most > 1 && most <= 255;
}

// The attributes at (u,v): red, green and blue as colours, the others as scalars of their names.
MeshAttributes AttributesAt(const PointFit& result, std::span<const Vec2> uv, int threads) {
  const std::vector<std::vector<double>> values = result.attribute_fit.At(uv, threads);
  const auto find = [&](std::string_view name) {
    return std::find_if(result.attributes.begin(), result.attributes.end(),
                        [&](const PointAttribute& a) { return a.name == name; }) -
           result.attributes.begin();
  };
  const std::array<std::ptrdiff_t, 3> rgb = {find("red"), find("green"), find("blue")};
  const bool coloured = *std::max_element(rgb.begin(), rgb.end()) < std::ssize(values) &&
                        AreBytes(result.attributes, rgb);
  MeshAttributes attributes;
  for (std::ptrdiff_t k = 0; k < std::ssize(values); ++k) {
    if (!coloured || std::find(rgb.begin(), rgb.end(), k) == rgb.end()) {
      attributes.scalars.push_back({result.attributes[k].name, values[k]});
    }
  }
  if (result.sigma) {
    attributes.scalars.push_back({"sigma_mm", result.sigma->OfChosen(uv)});
  }
  for (std::size_t k = 0; coloured && k < uv.size(); ++k) {
    attributes.colors.push_back(
        {AsColour(values[rgb[0]][k]), AsColour(values[rgb[1]][k]), AsColour(values[rgb[2]][k])});
  }
  return attributes;
}

}  // namespace

void CheckChord(const AutoOr<double>& chord_mm, const HSplineSurface& start,
                const ScatteredPoints& points, const RunContext& context) {
  constexpr std::size_t kFewest = 16;  // points: the auto plan refuses fewer
  constexpr double kFinest = 1e-7;  // share of the extent, near the round-off of single precision
  if (chord_mm.automatic) {
    return;
  }
  const double extent_mm = BoxDiagonal(points.positions);
  if (chord_mm.value > extent_mm / kChordsPerExtent) {
    return;
  }
  double least_mm = std::max(chord_mm.value, kFinest * extent_mm);
  if (points.size() >= kFewest) {
    const HSplineSurface rough = RoughSurface(start, points, context);
    least_mm = AffordableChord(rough, least_mm, kMaxCells / 4);
  }
  RefuseBelow(least_mm, chord_mm.value);
}

namespace {

// The surface in the coordinates of the fit, in which heights and places have about one size.
HSplineSurface SurfaceOfFit(const PointFit& result) {
  return result.height_factor == 1 ? result.fit.surface
                                   : WithScaledHeights(result.fit.surface, result.height_factor);
}

// Brings triangles from the coordinates of the fit to those of the points.
void ScaleBack(double factor, Tessellation& tessellation) {
  ScaleHeights(1 / factor, tessellation.mesh.points);
  for (Vec3& normal : tessellation.normals) {
    normal = normal.cwiseProduct(Vec3(1, 1, factor)).normalized();
  }
}

}  // namespace

double ChooseChord(const PointFit& result, const AutoOr<double>& chord_mm) {
  constexpr double kEnough = 500'000;  // cells: a million triangles
  const HSplineSurface surface = SurfaceOfFit(result);
  const double factor = result.height_factor;
  const double chord =
      chord_mm.automatic
          ? AffordableChord(surface, BoxDiagonal(surface.Net(0).vertices) / kChordsPerExtent,
                            kEnough)
          : AffordableChord(surface, factor * chord_mm.value, kMaxCells / 4);
  return chord / factor;
}

std::string SurfacePly(const PointFit& result, double chord_mm, int threads) {
  const double factor = result.height_factor;
  Tessellation tessellation = TessellateToChord(SurfaceOfFit(result), factor * chord_mm, threads);
  if (factor != 1) {
    ScaleBack(factor, tessellation);
  }
  MeshAttributes attributes = AttributesAt(result, tessellation.uv, threads);
  attributes.normals = std::move(tessellation.normals);
  return EncodeMesh(tessellation.mesh, ".ply", attributes, chord_mm);
}

namespace {

// One flag per point; empty if the fit looks for no outliers.
std::vector<char> OutlierFlags(const FitResult& fit) {
  std::vector<char> outlier;
  if (fit.automatic) {
    outlier.assign(fit.uv.size(), 0);
    for (const std::uint32_t k : fit.automatic->outliers) {
      outlier[k] = 1;
    }
  }
  return outlier;
}

void AppendFloat(double value, std::string& bytes) {
  const auto number = static_cast<float>(value);
  char raw[sizeof number];
  std::memcpy(raw, &number, sizeof number);
  bytes.append(raw, sizeof number);
}

std::vector<std::string> ColumnNames(const ResidualColumns& columns, bool outliers) {
  std::vector<std::string> names = {"point", "u", "v", "residual_mm"};
  if (outliers) {
    names.emplace_back("outlier");
  }
  if (!columns.weights.empty()) {
    names.emplace_back("weight");
  }
  if (!columns.sigma_mm.empty()) {
    names.emplace_back("sigma_mm");
  }
  for (const PointAttribute& attribute : columns.attributes) {
    names.push_back(attribute.name);
    names.push_back(attribute.name + "_residual");
  }
  return names;
}

}  // namespace

std::string ResidualsCsv(const ResidualColumns& columns) {
  const FitResult& fit = columns.fit;
  const std::vector<char> outlier = OutlierFlags(fit);
  CsvWriter csv(ColumnNames(columns, !outlier.empty()));
  for (std::size_t k = 0; k < fit.uv.size(); ++k) {
    csv.Add(k, fit.uv[k].x(), fit.uv[k].y(), fit.residual_mm[k]);
    if (!outlier.empty()) {
      csv.Add(int{outlier[k]});
    }
    if (!columns.weights.empty()) {
      csv.Add(columns.weights[k]);
    }
    if (!columns.sigma_mm.empty()) {
      csv.Add(columns.sigma_mm[k]);
    }
    for (std::size_t c = 0; c < columns.attributes.size(); ++c) {
      csv.Add(columns.fitted[c][k], columns.attributes[c].values[k] - columns.fitted[c][k]);
    }
    csv.EndRow();
  }
  return csv.Text();
}

std::string ResidualsPly(const ResidualColumns& columns) {
  const FitResult& fit = columns.fit;
  const std::vector<char> outlier = OutlierFlags(fit);
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float "
      "y\nproperty float z\nproperty float residual_mm\nproperty float outlier\n",
      fit.uv.size());
  bytes += columns.weights.empty() ? "" : "property float weight\n";
  bytes += columns.sigma_mm.empty() ? "" : "property float sigma_mm\n";
  for (const PointAttribute& attribute : columns.attributes) {
    bytes += fmt::format("property float {0}\nproperty float {0}_residual\n", attribute.name);
  }
  bytes += "end_header\n";
  bytes.reserve(bytes.size() + fit.uv.size() * (20 + 8 * columns.attributes.size()));
  for (std::size_t k = 0; k < fit.uv.size(); ++k) {
    AppendFloat(fit.uv[k].x(), bytes);
    AppendFloat(fit.uv[k].y(), bytes);
    AppendFloat(0, bytes);
    AppendFloat(fit.residual_mm[k], bytes);
    AppendFloat(outlier.empty() ? 0 : outlier[k], bytes);
    if (!columns.weights.empty()) {
      AppendFloat(columns.weights[k], bytes);
    }
    if (!columns.sigma_mm.empty()) {
      AppendFloat(columns.sigma_mm[k], bytes);
    }
    for (std::size_t c = 0; c < columns.attributes.size(); ++c) {
      AppendFloat(columns.fitted[c][k], bytes);
      AppendFloat(columns.attributes[c].values[k] - columns.fitted[c][k], bytes);
    }
  }
  return bytes;
}

}  // namespace semblance::problems
