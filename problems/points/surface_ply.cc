// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/surface_ply.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include "fitting/fit.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline_query/tessellate.h"
#include "surfaces/hspline_query/trimmed_tessellation.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance {
namespace {

// Of the points' box.
double DiagonalOf(std::span<const Vec3> positions) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : positions) {
    box.extend(p);
  }
  return box.diagonal().norm();
}

constexpr double kChords = 5000;  // of an extent, where the chord is `auto`

// To two digits.
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

// `chord_mm`, or as much more as keeps the cells, of two triangles each, within a number.
double AffordableChord(const HSplineSurface& surface, double chord_mm, double most_cells) {
  while (std::isfinite(chord_mm) && CellsToChord(surface, chord_mm) > most_cells) {
    chord_mm *= 2;
  }
  return chord_mm;
}

// Some of the points, smoothed: how the surface will bend at least.
HSplineSurface RoughSurface(const HSplineSurface& start, const ScatteredPoints& points,
                            const RunContext& context) {
  constexpr std::size_t kEnough = 4000;
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

double ExtentOf(const HSplineSurface& surface) { return DiagonalOf(surface.Net(0).vertices); }

std::uint8_t AsColour(double value) {
  return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0)));
}

// Whether values given as red, green and blue are of 0..255; of 0..1 and of 0..65535 they are not.
bool AreOfBytes(std::span<const PointAttribute> attributes,
                const std::array<std::ptrdiff_t, 3>& rgb) {
  double least = 0, most = 0;
  for (const std::ptrdiff_t k : rgb) {
    const auto [low, high] = std::ranges::minmax(attributes[k].values);
    least = std::min(least, low);
    most = std::max(most, high);
  }
  return least >= 0 && most > 1 && most <= 255;
}

// Columns red, green and blue, 0..255, as colours; all others as scalars of their names.
MeshAttributes AttributesOf(const PointFit& result, std::span<const Vec2> uv, int threads) {
  const std::vector<std::vector<double>> values = result.attribute_fit.At(uv, threads);
  const auto find = [&](std::string_view name) {
    return std::find_if(result.attributes.begin(), result.attributes.end(),
                        [&](const PointAttribute& a) { return a.name == name; }) -
           result.attributes.begin();
  };
  const std::array<std::ptrdiff_t, 3> rgb = {find("red"), find("green"), find("blue")};
  const bool coloured = *std::max_element(rgb.begin(), rgb.end()) < std::ssize(values) &&
                        AreOfBytes(result.attributes, rgb);
  MeshAttributes attributes;
  for (std::ptrdiff_t k = 0; k < std::ssize(values); ++k) {
    if (!coloured || std::find(rgb.begin(), rgb.end(), k) == rgb.end()) {
      attributes.scalars.push_back({result.attributes[k].name, values[k]});
    }
  }
  if (result.sigma) {
    attributes.scalars.push_back({"sigma_mm", result.sigma->At(uv)});
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
  constexpr std::size_t kFewest = 16;  // for the auto plan
  constexpr double kFinest = 1e-7;     // of the extent, whatever the surface
  if (chord_mm.automatic) {
    return;
  }
  const double extent_mm = DiagonalOf(points.positions);
  if (chord_mm.value > extent_mm / kChords) {
    return;
  }
  double least_mm = std::max(chord_mm.value, kFinest * extent_mm);
  if (points.size() >= kFewest) {
    const HSplineSurface rough = RoughSurface(start, points, context);
    least_mm = AffordableChord(rough, least_mm, kMostCells / 4);
  }
  RefuseBelow(least_mm, chord_mm.value);
}

double ChordFor(const HSplineSurface& surface, const AutoOr<double>& chord_mm) {
  constexpr double kEnough = 500'000;
  return chord_mm.automatic ? AffordableChord(surface, ExtentOf(surface) / kChords, kEnough)
                            : AffordableChord(surface, chord_mm, kMostCells / 4);
}

namespace {

std::string EncodePly(const PointFit& result, Tessellation tessellation, double chord_mm,
                      int threads) {
  if (result.poles) {
    JoinPoles(*result.poles, tessellation);
  }
  MeshAttributes attributes = AttributesOf(result, tessellation.uv, threads);
  attributes.normals = std::move(tessellation.normals);
  return EncodeMesh(tessellation.mesh, ".ply", attributes, chord_mm);
}

}  // namespace

SurfaceMesh SurfacePly(const PointFit& result, double chord_mm, const TrimmedTo* trim,
                       int threads) {
  const HSplineSurface& surface = result.fit.surface;
  if (trim == nullptr) {
    return {
        .ply = EncodePly(result, TessellateToChord(surface, chord_mm, threads), chord_mm, threads)};
  }
  TrimmedTessellation trimmed =
      TessellateNear(surface, chord_mm, trim->places, trim->distance_mm, threads);
  const TrimReport report{
      .distance_mm = trim->distance_mm, .kept_mm2 = trimmed.kept_mm2, .cut_mm2 = trimmed.cut_mm2};
  return {.ply = EncodePly(result, std::move(trimmed.kept), chord_mm, threads), .trim = report};
}

}  // namespace semblance
