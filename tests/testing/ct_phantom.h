// SPDX-License-Identifier: GPL-3.0-or-later
// A head of nested balls as a CT volume: skin, bone, brain, a sinus with an airway to the cut at
// the bottom, a nostril, a head holder and a speck of bone.
#pragma once

#include <algorithm>
#include <cmath>

#include "problems/io/volumes/ct_volume.h"

namespace semblance::testing {
using namespace problems;

struct CtPhantom {
  Vec3 centre{60, -60, 30};  // the head is cut below z = 0
  double skin_mm = 45, bone_mm = 39, brain_mm = 33;
  double blur_mm = 0.75;  // half width of an edge

  CtVolume Make() const {
    CtVolume volume;
    volume.columns = volume.rows = 81;
    volume.slices = 54;
    volume.spacing_mm = Vec3(1.5, 1.5, 1.5);
    volume.origin = Vec3(0, -120, 0);
    for (int k = 0; k < volume.slices; ++k) {
      for (int j = 0; j < volume.rows; ++j) {
        for (int i = 0; i < volume.columns; ++i) {
          volume.values.push_back(static_cast<std::int16_t>(Hu(volume.World(i, j, k))));
        }
      }
    }
    return volume;
  }

  // 1 inside, 0 outside a signed distance, over the width of the blur.
  double Inside(double distance_mm) const {
    return std::clamp(0.5 - distance_mm / (2 * blur_mm), 0.0, 1.0);
  }

  double Hu(const Vec3& p) const {
    const double r = (p - centre).norm();
    double hu = -1000;
    const auto fill = [&hu](double value, double share) { hu += share * (value - hu); };
    fill(40, Inside(r - skin_mm));
    fill(1000, Inside(r - bone_mm));
    fill(40, Inside(r - brain_mm));
    const Vec3 sinus = centre + Vec3(0, 0, -15);
    fill(-1000, Inside((p - sinus).norm() - 9));                  // sinus
    fill(-1000, Inside(AxisDistance(p - sinus, 2, -40, 0) - 4));  // airway to the cut
    fill(-1000, Inside(AxisDistance(p - sinus, 1, -60, 0) - 3));  // nostril to the front
    fill(300, Inside(std::max(std::abs(p.y() + 8) - 1.5, std::abs(p.x() - 60) - 40)));  // holder
    fill(900, Inside((p - Vec3(110, -110, 70)).norm() - 3));  // a speck of bone
    return hu;
  }

  // Distance from the axis through 0 between two heights along it.
  static double AxisDistance(Vec3 p, int axis, double low, double high) {
    p[axis] -= std::clamp(p[axis], low, high);
    return p.norm();
  }
};

}  // namespace semblance::testing
