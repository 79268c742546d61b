// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/pictures/colour_map.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "surfaces/base/error.h"
#include "surfaces/mesh_files/srgb.h"

namespace semblance::problems {
namespace {

using Triple = Eigen::Vector3d;

// OKLab, B. Ottosson 2020: linear sRGB -> cone responses -> cube root -> L, a, b.
Eigen::Matrix3d ConesFromLinear() {
  return (Eigen::Matrix3d() << 0.4122214708, 0.5363325363, 0.0514459929,  //
          0.2119034982, 0.6806995451, 0.1073969566,                       //
          0.0883024619, 0.2817188376, 0.6299787005)
      .finished();
}
Eigen::Matrix3d LabFromRoots() {
  return (Eigen::Matrix3d() << 0.2104542553, 0.7936177850, -0.0040720468,  //
          1.9779984951, -2.4285922050, 0.4505937099,                       //
          0.0259040371, 0.7827717662, -0.8086757660)
      .finished();
}

Triple LabFromColour(const Colour& c) {
  const Triple linear(LinearFromSrgb(c.r), LinearFromSrgb(c.g), LinearFromSrgb(c.b));
  const Triple cones = ConesFromLinear() * linear;
  return LabFromRoots() * Triple(std::cbrt(cones[0]), std::cbrt(cones[1]), std::cbrt(cones[2]));
}

Colour ColourFromLab(const Triple& lab) {
  const Triple roots = LabFromRoots().inverse() * lab;
  const Triple linear = ConesFromLinear().inverse() * roots.array().cube().matrix();
  return {SrgbFromLinear(linear[0]), SrgbFromLinear(linear[1]), SrgbFromLinear(linear[2])};
}

}  // namespace

ColourMap SequentialMap(double low_mm, double high_mm) {
  if (!std::isfinite(low_mm) || !std::isfinite(high_mm) || low_mm >= high_mm) {
    throw InputError(fmt::format(
        "colour map from {} mm to {} mm: both must be finite, and the first must be smaller",
        low_mm, high_mm));
  }
  return {.colours = {HexColour(0x440154), HexColour(0x3b528b), HexColour(0x21918c),
                      HexColour(0x5ec962), HexColour(0xfde725)},
          .low_mm = low_mm,
          .high_mm = high_mm};
}

ColourMap DivergingMap(double range_mm) {
  if (!std::isfinite(range_mm) || range_mm <= 0) {
    throw InputError(
        fmt::format("colour map over +-{} mm: the range must be finite and positive", range_mm));
  }
  return {.colours = {HexColour(0x123f8c), HexColour(0x5b9bd5), HexColour(0xf6f5f2),
                      HexColour(0xe58263), HexColour(0x9c1127)},
          .low_mm = -range_mm,
          .high_mm = range_mm};
}

Colour ColourAt(const ColourMap& map, double value_mm) {
  if (std::isnan(value_mm)) {
    return kNoDataColour;
  }
  const double t = std::clamp((value_mm - map.low_mm) / (map.high_mm - map.low_mm), 0.0, 1.0);
  const double s = t * static_cast<double>(map.colours.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(s), map.colours.size() - 2);
  const double f = s - static_cast<double>(i);
  if (f == 0 || f == 1) {
    return map.colours[f == 0 ? i : i + 1];
  }
  return ColourFromLab((1 - f) * LabFromColour(map.colours[i]) +
                       f * LabFromColour(map.colours[i + 1]));
}

std::vector<Colour> ColoursAt(const ColourMap& map, std::span<const double> values_mm) {
  std::vector<Colour> colours;
  colours.reserve(values_mm.size());
  for (const double value : values_mm) {
    colours.push_back(ColourAt(map, value));
  }
  return colours;
}

std::vector<std::string> ColourSteps(const ColourMap& map) {
  constexpr int kSteps = 32;
  std::vector<std::string> colours;
  for (int k = 0; k <= kSteps; ++k) {
    colours.push_back(HexText(ColourAt(map, map.low_mm + (map.high_mm - map.low_mm) * k / kSteps)));
  }
  return colours;
}

}  // namespace semblance::problems
