// SPDX-License-Identifier: GPL-3.0-or-later
// Open sheets over the unit square that are not a graph over any plane, and scattered points on
// them.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "surfaces/base/geometry.h"
#include "surfaces/base/random.h"

namespace semblance::testing {

using Sheet = std::function<Vec3(const Vec2&)>;

// A tube of radius 10 with a gap of an eighth of a turn and more.
inline Vec3 OpenPipe(const Vec2& q) {
  const double turn = 4.6 * (q.x() - 0.5);
  return {10 * std::cos(turn), 20 * q.y(), 10 * std::sin(turn)};
}

// Two arcs of 270 degrees of radius 10, one after the other.
inline Vec3 Ess(const Vec2& q) {
  constexpr double kQuarter = std::numbers::pi / 2;
  const double turn = 3 * kQuarter * std::abs(1 - 2 * q.x()), side = q.x() < 0.5 ? 1 : -1;
  return {-10 * side * std::sin(turn), 30 * q.y(), side * 10 * (1 - std::cos(turn))};
}

// One and a half turns of a spiral with a pitch of 6.28.
inline Vec3 SpiralRoll(const Vec2& q) {
  const double turn = 1.5 * std::numbers::pi * (1 + 2 * q.x());
  return {turn * std::cos(turn), 21 * q.y(), turn * std::sin(turn)};
}

// A sphere of radius 10 up to 130 degrees from its pole.
inline Vec3 DeepBowl(const Vec2& q) {
  const Vec2 p = 2 * q - Vec2(1, 1);
  const double polar = 130 * std::numbers::pi / 180 * p.cwiseAbs().maxCoeff(),
               azimuth = std::atan2(p.y(), p.x());
  return 10 * Vec3(std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth),
                   -std::cos(polar));
}

struct NamedSheet {
  std::string name;
  Sheet sheet;
};

inline std::vector<NamedSheet> BentSheets() {
  return {{"pipe", OpenPipe}, {"S", Ess}, {"roll", SpiralRoll}, {"bowl", DeepBowl}};
}

// The area element by finite differences.
struct Tangents {
  Vec3 u, v;
  Vec3 Normal() const { return u.cross(v); }  // times area
};

inline Tangents TangentsAt(const Sheet& sheet, const Vec2& q) {
  constexpr double kStep = 1e-5;
  const Vec2 u(kStep, 0), v(0, kStep);
  return {(sheet(q + u) - sheet(q - u)) / (2 * kStep), (sheet(q + v) - sheet(q - v)) / (2 * kStep)};
}

// Adds waves to the sheet, so that a fit has detail to find.
inline Sheet Wavy(const Sheet& sheet, double height_mm) {
  return [=](const Vec2& q) -> Vec3 {
    const double wave = std::sin(9 * q.x() + 1) * std::sin(7 * q.y() + 3 * q.x());
    return sheet(q) + height_mm * wave * TangentsAt(sheet, q).Normal().normalized();
  };
}

inline double AreaOf(const Sheet& sheet) {
  constexpr int kSide = 100;
  double area = 0;
  for (int k = 0; k < kSide * kSide; ++k) {
    area += TangentsAt(sheet, Vec2(k % kSide + 0.5, k / kSide + 0.5) / kSide).Normal().norm();
  }
  return area / (kSide * kSide);
}

struct SheetPoints {
  std::vector<Vec3> positions;
  std::vector<Vec2> at;      // true (u,v) in the unit square
  double spacing_mm = kNaN;  // square root of the area per point
};

struct SheetScatter {
  int count = 2000;
  double noise = 0;       // standard deviation along each axis, relative to the spacing
  double outliers = 0;    // share of points anywhere in the box
  double unevenness = 0;  // relative density at u = 1
  int holes = 0;          // number of round holes of radius 0.07
};

inline bool IsInHole(const Vec2& q, int holes) {
  for (int hole = 0; hole < holes; ++hole) {
    if ((q - Vec2(0.2 + 0.3 * hole, 0.3 + 0.2 * hole)).norm() < 0.07) {
      return true;
    }
  }
  return false;
}

// Points with even density over the area, changed by the options.
inline SheetPoints ScatterOver(const Sheet& sheet, const SheetScatter& how) {
  Random random(1);
  SheetPoints points{.positions = {}, .at = {}, .spacing_mm = std::sqrt(AreaOf(sheet) / how.count)};
  const auto density = [&](const Vec2& q) {
    return TangentsAt(sheet, q).Normal().norm() * (1 + how.unevenness * q.x() * q.x());
  };
  double densest = 0;
  Box3 box;
  for (int k = 0; k < 2500; ++k) {
    const Vec2 q = Vec2(k % 50 + 0.5, k / 50 + 0.5) / 50;
    densest = std::max(densest, 1.1 * density(q));
    box.extend(sheet(q));
  }
  while (points.at.size() < static_cast<std::size_t>(how.count)) {
    const Vec2 q(random.Uniform(), random.Uniform());
    if (random.Uniform() * densest > density(q) || IsInHole(q, how.holes)) {
      continue;
    }
    Vec3 off(random.Normal(), random.Normal(), random.Normal());
    Vec3 p = sheet(q) + how.noise * points.spacing_mm * off;
    const Vec3 anywhere = box.min() + box.sizes().cwiseProduct(random.InBox(0, 1));
    if (random.Uniform() < how.outliers) {
      p = anywhere;
    }
    points.positions.push_back(p);
    points.at.push_back(q);
  }
  return points;
}

}  // namespace semblance::testing
