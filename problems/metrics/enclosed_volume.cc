// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/metrics/enclosed_volume.h"

#include <array>
#include <cmath>

namespace semblance {
namespace {

struct Corner {
  Vec3 point, move;
  double signed_mm;
};

double Swept_mm3(const Corner& a, const Corner& b, const Corner& c) {
  const Vec3 e1 = b.point - a.point, e2 = c.point - a.point;
  const Vec3 f1 = b.move - a.move, f2 = c.move - a.move;
  const Vec3 twice_area = e1.cross(e2) + (e1.cross(f2) + f1.cross(e2)) / 2 + f1.cross(f2) / 3;
  return ((a.move + b.move + c.move) / 3).dot(twice_area) / 2;
}

// Where the distance is 0 between corners of unlike sign: the surfaces meet there.
Corner Crossing(const Corner& a, const Corner& b) {
  const double s = a.signed_mm / (a.signed_mm - b.signed_mm);
  return {a.point + s * (b.point - a.point), a.move + s * (b.move - a.move), 0};
}

void Add(double swept_mm3, bool outside, EnclosedVolume& volume) {
  (outside ? volume.outside_cm3 : volume.inside_cm3) += (outside ? 1 : -1) * swept_mm3 / 1000;
}

EnclosedVolume OfTriangle(const std::array<Corner, 3>& t) {
  EnclosedVolume volume;
  const auto outside = [&](int k) { return t[k].signed_mm > 0; };
  int alone = 0;  // the corner whose sign no other has
  while (alone < 3 && (outside(alone) == outside((alone + 1) % 3) ||
                       outside(alone) == outside((alone + 2) % 3))) {
    ++alone;
  }
  if (alone == 3) {
    Add(Swept_mm3(t[0], t[1], t[2]), outside(0), volume);
    return volume;
  }
  const Corner &a = t[alone], &b = t[(alone + 1) % 3], &c = t[(alone + 2) % 3];
  const Corner ab = Crossing(a, b), ac = Crossing(a, c);
  Add(Swept_mm3(a, ab, ac), outside(alone), volume);
  Add(Swept_mm3(ab, b, c) + Swept_mm3(ab, c, ac), !outside(alone), volume);
  return volume;
}

void Accumulate(const EnclosedVolume& more, double share, EnclosedVolume& sum) {
  sum.outside_cm3 += share * more.outside_cm3;
  sum.inside_cm3 += share * more.inside_cm3;
}

}  // namespace

VolumeByPart MeasureEnclosed(const TriMesh& mesh, std::span<const Vec3> move,
                             std::span<const double> signed_mm, std::span<const int> part) {
  VolumeByPart volume;
  for (const Triangle& t : mesh.triangles) {
    std::array<Corner, 3> corners;
    bool known = true;
    for (int k = 0; k < 3; ++k) {
      corners[k] = {mesh.points[t[k]], move[t[k]], signed_mm[t[k]]};
      known = known && std::isfinite(signed_mm[t[k]]);
    }
    if (known) {
      const EnclosedVolume swept = OfTriangle(corners);
      Accumulate(swept, 1, volume.all);
      for (const auto v : t) {
        if (part[v] >= 0) {
          Accumulate(swept, 1.0 / 3, volume.parts[part[v]]);
        }
      }
    }
  }
  return volume;
}

}  // namespace semblance
