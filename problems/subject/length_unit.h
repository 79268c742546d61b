// SPDX-License-Identifier: GPL-3.0-or-later
// What a subject's files may be written in. Inside the program all is in mm and LPS.
#pragma once

#include <array>
#include <string_view>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

enum class LengthUnit { kMillimetre, kCentimetre, kInch, kMetre };
constexpr auto EnumNames(LengthUnit) {
  return std::to_array<std::string_view>({"mm", "cm", "in", "m"});
}

// RAS: +x subject right, +y anterior, +z up; LPS with x and y negated.
enum class Axes { kLps, kRas };
constexpr auto EnumNames(Axes) { return std::to_array<std::string_view>({"LPS", "RAS"}); }

constexpr double Millimetres(LengthUnit unit) {
  constexpr std::array kFactors = {1.0, 10.0, 25.4, 1000.0};
  return kFactors[static_cast<int>(unit)];
}

// A direction, or a point in mm, in LPS.
inline Vec3 ToLps(const Vec3& v, Axes axes) {
  return axes == Axes::kLps ? v : Vec3(-v.x(), -v.y(), v.z());
}

// A point in mm and LPS; the same bits where it was.
inline Vec3 ToLpsMm(const Vec3& p, Axes axes, LengthUnit unit) {
  return unit == LengthUnit::kMillimetre ? ToLps(p, axes) : ToLps(Millimetres(unit) * p, axes);
}

}  // namespace semblance
