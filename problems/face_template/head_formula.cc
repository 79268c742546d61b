// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face_template/head_formula.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace semblance {
namespace {

// ---------------------------------------------------------------------------------------------
// Curves through tabled points
// ---------------------------------------------------------------------------------------------

// The natural cubic spline through (t, y): C2, linear outside.
class Curve {
 public:
  Curve(std::vector<double> t, std::vector<double> y) : t_(std::move(t)), y_(std::move(y)) {
    const int n = static_cast<int>(t_.size());
    curvature_.assign(n, 0);
    std::vector<double> pivot(n, 1), right(n, 0);
    for (int i = 1; i + 1 < n; ++i) {
      const double h0 = t_[i] - t_[i - 1], h1 = t_[i + 1] - t_[i];
      const double slope_change = (y_[i + 1] - y_[i]) / h1 - (y_[i] - y_[i - 1]) / h0;
      const double below = i > 1 ? h0 / pivot[i - 1] : 0;
      pivot[i] = 2 * (h0 + h1) - below * (i > 1 ? h0 : 0);
      right[i] = 6 * slope_change - below * right[i - 1];
    }
    for (int i = n - 2; i > 0; --i) {
      curvature_[i] = (right[i] - (t_[i + 1] - t_[i]) * curvature_[i + 1]) / pivot[i];
    }
  }

  double operator()(double t) const {
    const int last = static_cast<int>(t_.size()) - 2;
    int i = 0;
    while (i < last && t > t_[i + 1]) {
      ++i;
    }
    const double h = t_[i + 1] - t_[i];
    if (t < t_.front() || t > t_.back()) {
      const double end = t < t_.front() ? t_.front() : t_.back();
      const double sign = t < t_.front() ? -1 : 1;
      const double slope =
          (y_[i + 1] - y_[i]) / h + sign * h / 6 * (t < end ? curvature_[i + 1] : curvature_[i]);
      return (t < end ? y_.front() : y_.back()) + slope * (t - end);
    }
    const double a = (t_[i + 1] - t) / h, b = (t - t_[i]) / h;
    return a * y_[i] + b * y_[i + 1] +
           h * h / 6 * ((a * a * a - a) * curvature_[i] + (b * b * b - b) * curvature_[i + 1]);
  }

 private:
  std::vector<double> t_, y_, curvature_;
};

template <class Row, std::size_t count>
Curve Column(const Row (&rows)[count], double Row::*t, double Row::*y) {
  std::vector<double> ts, ys;
  for (const Row& row : rows) {
    ts.push_back(row.*t);
    ys.push_back(row.*y);
  }
  return Curve(std::move(ts), std::move(ys));
}

// ---------------------------------------------------------------------------------------------
// The head without features
// ---------------------------------------------------------------------------------------------

constexpr double kAxisY = 95;  // mm behind nasion: the vertical axis of the azimuth
constexpr double kEdgeAzimuth = 110 * std::numbers::pi / 180;
constexpr double kAzimuthCubic = 0.6;  // > 0: the middle of the face gets more of u than its sides

// A rib runs round the head at constant v: an ellipse seen from above, pinched (k > 0) or boxy
// (k < 0) between its axes, which rises by `rise` from the midline to the side.
struct Rib {
  double v, y, z;     // of the midline point, mm
  double half_width;  // at 90 deg, mm
  double pinch;
  double rise;  // from the midline to 90 deg, mm
};

constexpr Rib kRibs[] = {
    {0.00, 58, -112, 49, 0.02, 16},    // throat
    {0.065, 35, -118, 55, 0.04, 34},   //
    {0.125, 13, -119, 60, 0.06, 48},   // menton
    {0.18, 4, -108, 62.5, 0.05, 48},   // pogonion
    {0.26, 2, -90, 66, -0.035, 42},    // chin-lip fold
    {0.34, -1, -74, 67.5, -0.09, 38},  // mouth
    {0.45, 1, -49, 67.5, -0.14, 30},   // base of the nose
    {0.52, 4, -37, 68, -0.15, 28},     //
    {0.692, 3, 0, 70.5, -0.09, 14},    // nasion
    {0.77, 1, 25, 72.5, -0.055, 3},    //
    {0.848, 10, 52, 72, -0.03, -6},    // forehead
    {0.924, 26, 74, 66, -0.02, -9},    //
    {1.00, 49, 89, 56, 0.00, -10},     // front of the crown
};

struct BasePoint {
  double azimuth_deg = 0;  // 0 in the midline, > 0; of the half of the face
  double x = 0, y = 0, z = 0;
  double sine = 0, cosine = 1;  // of the azimuth
};

// s = |2u - 1|: 0 in the midline, 1 at the edge.
BasePoint Base(double s, double v) {
  static const Curve y = Column(kRibs, &Rib::v, &Rib::y);
  static const Curve z = Column(kRibs, &Rib::v, &Rib::z);
  static const Curve width = Column(kRibs, &Rib::v, &Rib::half_width);
  static const Curve pinch = Column(kRibs, &Rib::v, &Rib::pinch);
  static const Curve rise = Column(kRibs, &Rib::v, &Rib::rise);
  const double azimuth = kEdgeAzimuth * (s + kAzimuthCubic * s * s * s) / (1 + kAzimuthCubic);
  BasePoint p;
  p.azimuth_deg = azimuth * 180 / std::numbers::pi;
  p.sine = std::sin(azimuth);
  p.cosine = std::cos(azimuth);
  const double double_sine = 2 * p.sine * p.cosine;
  const double radius = (1 - pinch(v) * double_sine * double_sine) /
                        std::hypot(p.cosine / (kAxisY - y(v)), p.sine / width(v));
  p.x = radius * p.sine;
  p.y = kAxisY - radius * p.cosine;
  p.z = z(v) + rise(v) * (1 - p.cosine);
  return p;
}

// ---------------------------------------------------------------------------------------------
// Features
// ---------------------------------------------------------------------------------------------

double Bell(double distance, double sigma) {
  return std::exp(-0.5 * distance * distance / (sigma * sigma));
}

// Flat on top, steep at |distance| = half_width.
double Plateau(double distance, double half_width) {
  const double q = distance * distance / (half_width * half_width);
  return 1 / (1 + q * q);
}

// 0 below `from`, 1 above `to`, C2.
double SmoothStep(double x, double from, double to) {
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * t * (t * (6 * t - 15) + 10);
}

// A hill (height > 0) or hollow on the front, in the frontal plane of the base, pushed forward.
struct FrontBump {
  double x, z, sigma_x, sigma_z, height;  // mm
  double tilt_deg;                        // > 0 raises the lateral end
};

constexpr FrontBump kFrontBumps[] = {
    // orbit, eyeball below its lids, the inner corner of the eye
    {30, 0, 15.5, 9, -10, 0},
    {31.5, -4, 11.5, 7.5, 9.5, 0},
    {17, -3, 5.5, 6, -3, 0},
    // brow ridges, their outer ends, glabella
    {22, 13, 11, 5.5, 2, 8},
    {43, 13, 11, 5.5, 3, -18},
    {0, 12, 10, 7, 2.8, 0},
    // cheek bone
    {46, -28, 13, 10, 3.0, 25},
    // muzzle, philtrum, corners of the mouth
    {0, -71, 20, 15, 5, 0},
    {0, -60.5, 3, 6, -1.5, 0},
    {27, -75.5, 4.5, 4.5, -2.0, 0},
    // chin-lip fold, chin
    {0, -92.5, 15, 5.5, -3.8, 0},
    {0, -107, 14, 9, 3.2, 0},
    // nasolabial fold
    {25, -57, 3.5, 11, -1.5, 28},
};

double FrontHeight(double x, double z) {
  double sum = 0;
  for (const FrontBump& b : kFrontBumps) {
    const double tilt = b.tilt_deg * std::numbers::pi / 180;
    const auto hill = [&](double center) {
      const double dx = x - center, dz = z - b.z;
      const double slope = center < 0 ? -tilt : tilt;
      return b.height * Bell(std::cos(slope) * dx + std::sin(slope) * dz, b.sigma_x) *
             Bell(std::cos(slope) * dz - std::sin(slope) * dx, b.sigma_z);
    };
    // a hill off the midline has its twin, so that the halves join smoothly
    sum += b.x > 0 ? hill(b.x) + hill(-b.x) : hill(0);
  }
  return sum;
}

// The lips along their curved line, with a groove between them.
double LipHeight(double x, double z) {
  const double q = x * x / (25.0 * 25.0);
  const double line = -74.5 - 1.2 * q;
  const double bow = 1.0 * Bell(x, 8) - 0.7 * Bell(x, 2.8);  // Cupid's bow
  const double upper = 4.6 * Plateau(x, 18) * Bell(z - line - 5 - bow, 3.6);
  const double lower = 5.2 * Plateau(x, 17) * Bell(z - line + 5.8, 4.2);
  return upper + lower - 3.2 * Plateau(x, 22) * Bell(z - line, 1.9);
}

// The line between the closed lids, and the crease over the upper lid.
double LeftLidHeight(double x, double z) {
  const double d = x - 31.5;
  const double line = -8.5 + 0.012 * d * d + 0.06 * d;
  const double crease = 2.0 - 0.022 * d * d;
  return -2.4 * Plateau(d, 12.5) * Bell(z - line, 2.2) -
         1.4 * Plateau(d, 13) * Bell(z - crease, 2.4);
}

double LidHeight(double x, double z) { return LeftLidHeight(x, z) + LeftLidHeight(-x, z); }

// The nose drawn in profile over the base: how far each height of the midline goes forward and
// down, and how wide it is there.
struct NoseSection {
  double z;           // of the base, mm
  double forward;     // mm
  double down;        // mm
  double half_width;  // mm
};

constexpr NoseSection kNose[] = {
    {-72, 0, 0, 14},      {-66, 0.5, 0, 14},  {-60, 1.5, 0, 14},  {-54, 4, 1.2, 13},
    {-49, 9, 4, 12},      {-45, 19, 7, 11.5}, {-41, 26.5, 6, 11}, {-37, 28.5, 3.5, 11},
    {-30, 23.5, 1, 10.5}, {-20, 17, 0, 9.5},  {-10, 10, 0, 8.5},  {0, 3.5, 0, 8},
    {7, 1, 0, 9},         {14, 0, 0, 10},
};

Vec3 NoseOffset(double x, double z) {
  static const Curve forward = Column(kNose, &NoseSection::z, &NoseSection::forward);
  static const Curve down = Column(kNose, &NoseSection::z, &NoseSection::down);
  static const Curve width = Column(kNose, &NoseSection::z, &NoseSection::half_width);
  const double window = SmoothStep(z, -70, -58) * SmoothStep(-z, -12, -2);
  if (window == 0) {
    return Vec3::Zero();
  }
  const double profile = window * (0.4 * Plateau(x, width(z)) + 0.6 * Bell(x, width(z)));
  return {0, -profile * forward(z), -profile * down(z)};
}

// The wing of the nose, the groove behind it and a hint of the nostril, of the left side.
Vec3 LeftAlaOffset(double x, double z) {
  const double wing = Bell(x - 13, 4.2) * Bell(z + 43, 4.2);
  const double groove = Bell(x - 20, 3) * Bell(z + 44, 6);
  const double nostril = Bell(x - 7, 2.8) * Bell(z + 46, 2.2);
  return {2.0 * wing, -7 * wing + 1.0 * groove + 3 * nostril, -1.5 * wing + 2 * nostril};
}

Vec3 AlaOffset(double x, double z) {
  const Vec3 left = LeftAlaOffset(x, z), right = LeftAlaOffset(-x, z);
  return {left.x() - right.x(), left.y() + right.y(), left.z() + right.z()};
}

// ---------------------------------------------------------------------------------------------
// The sides
// ---------------------------------------------------------------------------------------------

// A hill or hollow on the side, by azimuth and height, pushed away from the axis.
struct SideBump {
  double azimuth_deg, z;  // deg, mm
  double sigma_deg, sigma_z, height;
};

constexpr SideBump kSideBumps[] = {
    {56, 22, 11, 14, -4},     // temple
    {72, -26, 14, 9, 2.0},    // zygomatic arch
    {48, -55, 12, 14, -1.5},  // cheek
    {70, -76, 10, 10, 3.5},   // angle of the jaw
    {100, -85, 14, 14, -4},   // neck
};

double SideHeight(double azimuth_deg, double z) {
  double sum = 0;
  for (const SideBump& b : kSideBumps) {
    sum += b.height *
           (Bell(azimuth_deg - b.azimuth_deg, b.sigma_deg) +
            Bell(azimuth_deg + b.azimuth_deg, b.sigma_deg)) *
           Bell(z - b.z, b.sigma_z);
  }
  return sum;
}

}  // namespace

Vec3 HeadPoint(double u, double v) {
  const double t = 2 * u - 1;
  const BasePoint b = Base(std::abs(t), v);
  const double forward = FrontHeight(b.x, b.z) + LipHeight(b.x, b.z) + LidHeight(b.x, b.z);
  const double side = SideHeight(b.azimuth_deg, b.z);
  Vec3 p(b.x, b.y, b.z);
  p += Vec3(0, -forward, 0) + side * Vec3(b.sine, -b.cosine, 0);
  p += NoseOffset(b.x, b.z) + AlaOffset(b.x, b.z);
  p.x() = std::copysign(p.x(), t);
  return p;
}

}  // namespace semblance
