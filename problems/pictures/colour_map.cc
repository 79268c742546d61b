// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/pictures/colour_map.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "problems/pictures/stroke_font.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh_files/srgb.h"

namespace semblance {
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

Triple LabOf(const Colour& c) {
  const Triple linear(LinearFromSrgb(c.r), LinearFromSrgb(c.g), LinearFromSrgb(c.b));
  const Triple cones = ConesFromLinear() * linear;
  return LabFromRoots() * Triple(std::cbrt(cones[0]), std::cbrt(cones[1]), std::cbrt(cones[2]));
}

Colour ColourOf(const Triple& lab) {
  const Triple roots = LabFromRoots().inverse() * lab;
  const Triple linear = ConesFromLinear().inverse() * roots.array().cube().matrix();
  return {SrgbFromLinear(linear[0]), SrgbFromLinear(linear[1]), SrgbFromLinear(linear[2])};
}

// Without a power of ten where that is short.
std::string TickLabel(double value, double step) {
  constexpr int kMostDecimals = 4;
  constexpr double kMostPlain = 1e6;
  const int decimals = std::max(0, static_cast<int>(std::ceil(-std::log10(step) - 1e-9)));
  const bool is_plain = decimals <= kMostDecimals && std::abs(value) < kMostPlain;
  return is_plain ? fmt::format("{:.{}f}", value == 0 ? 0.0 : value, decimals)
                  : fmt::format("{:.6g}", value == 0 ? 0.0 : value);
}

struct Bar {
  int x, y, width, height;
  double scale;  // 1: letters of about 11 pixels
};

struct BarTick {
  double x;  // pixels from the bar's left end
  std::string label;
};

TextStyle TickStyle(const Bar& bar) {
  return {.cap_height_px = 10.5 * bar.scale, .anchor = Anchor::kCentre};
}

bool HaveRoom(const std::vector<BarTick>& ticks, const Bar& bar) {
  const double gap = 10 * bar.scale;
  for (std::size_t k = 1; k < ticks.size(); ++k) {
    const double half = (TextWidth(ticks[k - 1].label, TickStyle(bar)) +
                         TextWidth(ticks[k].label, TickStyle(bar))) /
                        2;
    if (ticks[k].x - ticks[k - 1].x < half + gap) {
      return false;
    }
  }
  return true;
}

std::vector<BarTick> BarTicks(const ColourMap& map, const Bar& bar, int wanted) {
  const std::vector<double> values = Ticks(map, wanted);
  const double step = values.size() > 1 ? values[1] - values[0] : map.high_mm - map.low_mm;
  std::vector<BarTick> ticks;
  for (const double value : values) {
    const double t = (value - map.low_mm) / (map.high_mm - map.low_mm);
    ticks.push_back({std::round(t * (bar.width - 1)), TickLabel(value, step)});
  }
  return ticks;
}

// As many as the labels have room for.
void DrawTicks(Image& image, const ColourMap& map, const Bar& bar) {
  constexpr int kFewest = 2, kMost = 10;
  const int wanted = std::clamp(static_cast<int>(bar.width / (50 * bar.scale)), kFewest, kMost);
  std::vector<BarTick> ticks = BarTicks(map, bar, wanted);
  for (int fewer = wanted - 1; fewer > 0 && !HaveRoom(ticks, bar); --fewer) {
    std::vector<BarTick> some = BarTicks(map, bar, fewer);
    ticks = some.size() < kFewest ? ticks : std::move(some);  // one says nothing of the scale
  }
  const int tick_width = std::max(1, static_cast<int>(bar.scale));
  const int tick_height = static_cast<int>(5 * bar.scale);
  for (const BarTick& tick : ticks) {
    const int x = bar.x + static_cast<int>(tick.x);
    FillRectangle(image, x - tick_width / 2, bar.y + bar.height, tick_width, tick_height,
                  HexColour(0x30343a));
    DrawText(image, x + 0.5, bar.y + bar.height + 20 * bar.scale, tick.label, TickStyle(bar));
  }
}

void DrawNoData(Image& image, const Bar& bar) {
  const int x = bar.x + bar.width + static_cast<int>(34 * bar.scale);
  FillRectangle(image, x, bar.y, bar.height, bar.height, kNoDataColour);
  DrawText(image, x + bar.height + 8 * bar.scale, bar.y + bar.height - 2 * bar.scale, "no data",
           {.cap_height_px = 10.5 * bar.scale});
}

}  // namespace

ColourMap SequentialMap(double low_mm, double high_mm) {
  if (!std::isfinite(low_mm) || !std::isfinite(high_mm) || low_mm >= high_mm) {
    throw InputError(
        fmt::format("colour map from {} mm to {} mm: both must be finite and the first the smaller",
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
  return ColourOf((1 - f) * LabOf(map.colours[i]) + f * LabOf(map.colours[i + 1]));
}

std::vector<Colour> ColoursAt(const ColourMap& map, std::span<const double> values_mm) {
  std::vector<Colour> colours;
  colours.reserve(values_mm.size());
  for (const double value : values_mm) {
    colours.push_back(ColourAt(map, value));
  }
  return colours;
}

std::vector<double> Ticks(const ColourMap& map, int wanted) {
  const double rough = (map.high_mm - map.low_mm) / std::max(wanted, 1);
  const double power = std::pow(10, std::floor(std::log10(rough)));
  const double ratio = rough / power;
  const double step = power * (ratio > 5 ? 10 : ratio > 2 ? 5 : ratio > 1 ? 2 : 1);
  std::vector<double> ticks;
  const double slack = 1e-9 * step;
  for (double i = std::ceil((map.low_mm - slack) / step); i * step <= map.high_mm + slack; ++i) {
    ticks.push_back(i * step);
  }
  return ticks;
}

void DrawLegend(Image& image, const Legend& legend, int x, int y, int width, int height) {
  const double scale = height / 84.0;
  const int bar_width = std::min(static_cast<int>(560 * scale), width * 6 / 10);
  const Bar bar{x + (width - bar_width) / 2, y + height / 2 - static_cast<int>(6 * scale),
                bar_width, static_cast<int>(15 * scale), scale};
  for (int i = 0; i < bar.width; ++i) {
    const double t = (i + 0.5) / bar.width;
    const double value = legend.map.low_mm + t * (legend.map.high_mm - legend.map.low_mm);
    FillRectangle(image, bar.x + i, bar.y, 1, bar.height, ColourAt(legend.map, value));
  }
  DrawText(image, bar.x + bar.width / 2.0, bar.y - 10 * scale, legend.title + " (mm)",
           {.cap_height_px = 11.5 * scale, .anchor = Anchor::kCentre});
  DrawTicks(image, legend.map, bar);
  if (legend.shows_no_data) {
    DrawNoData(image, bar);
  }
}

}  // namespace semblance
