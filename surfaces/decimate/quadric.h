// SPDX-License-Identifier: GPL-3.0-or-later
// A sum of weighted squared distances from planes and lines, and where it is least.
#pragma once

#include "surfaces/base/geometry.h"

namespace semblance {

// q(x) = x' A x - 2 b' x + c, A symmetric (Garland & Heckbert 1997). Quadrics add up.
struct Quadric {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;  // A
  double x = 0, y = 0, z = 0;                             // b
  double c = 0;

  // area_vector: the triangle's normal times its area, not zero; the weight is the area.
  static Quadric OfTriangle(const Vec3& p, const Vec3& area_vector) {
    const double area = area_vector.norm();
    const Vec3 n = area_vector / area, m = area_vector;
    const double d = n.dot(p), e = area * d;
    return {m.x() * n.x(), m.x() * n.y(), m.x() * n.z(), m.y() * n.y(), m.y() * n.z(),
            m.z() * n.z(), e * n.x(),     e * n.y(),     e * n.z(),     e * d};
  }

  // Of the line through p and q, which are apart; the weight is the squared length.
  static Quadric OfLine(const Vec3& p, const Vec3& q) {
    const Vec3 e = q - p;
    const double l = e.squaredNorm();
    Quadric line{l - e.x() * e.x(), -e.x() * e.y(), -e.x() * e.z(),
                 l - e.y() * e.y(), -e.y() * e.z(), l - e.z() * e.z()};
    const Vec3 b = line.TimesA(p);
    line.x = b.x();
    line.y = b.y();
    line.z = b.z();
    line.c = p.dot(b);
    return line;
  }

  void Add(const Quadric& o, double times = 1) {
    xx += times * o.xx, xy += times * o.xy, xz += times * o.xz;
    yy += times * o.yy, yz += times * o.yz, zz += times * o.zz;
    x += times * o.x, y += times * o.y, z += times * o.z;
    c += times * o.c;
  }

  Vec3 TimesA(const Vec3& p) const {
    return {xx * p.x() + xy * p.y() + xz * p.z(), xy * p.x() + yy * p.y() + yz * p.z(),
            xz * p.x() + yz * p.y() + zz * p.z()};
  }
  double Trace() const { return xx + yy + zz; }
  double At(const Vec3& p) const {
    return p.dot(TimesA(p)) - 2 * (x * p.x() + y * p.y() + z * p.z()) + c;
  }

  // Near `start`, where it is least in the directions in which it rises; `start` in those in which
  // it does not: steps of Newton's method, each held back by a share of A's trace.
  Vec3 LeastNear(const Vec3& start, double held_back, int steps) const {
    const double hold = held_back * Trace();
    const double a = xx + hold, d = yy + hold, f = zz + hold;
    const double c00 = d * f - yz * yz, c01 = xz * yz - xy * f, c02 = xy * yz - xz * d,
                 c11 = a * f - xz * xz, c12 = xy * xz - a * yz, c22 = a * d - xy * xy;
    const double determinant = a * c00 + xy * c01 + xz * c02;
    if (!(determinant > 0)) {
      return start;
    }
    Vec3 p = start;
    for (int step = 0; step < steps; ++step) {
      const Vec3 r = (Vec3(x, y, z) - TimesA(p)) / determinant;
      p += Vec3(c00 * r.x() + c01 * r.y() + c02 * r.z(), c01 * r.x() + c11 * r.y() + c12 * r.z(),
                c02 * r.x() + c12 * r.y() + c22 * r.z());
    }
    return p;
  }
};

}  // namespace semblance
