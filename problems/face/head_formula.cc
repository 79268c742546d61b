// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/head_formula.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <numbers>
#include <string_view>
#include <vector>

#include "problems/subject/sites.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
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
constexpr double kAzimuthCubic = 0.6;  // > 0 gives the middle of the face more of u than its sides

// A rib runs round the head at constant v. Seen from above it is an ellipse. Between its axes it is
// pinched (pinch > 0) or boxy (pinch < 0). It rises by `rise` from the midline to the side.
struct Rib {
  double v, y, z;     // of the midline point; y and z in mm
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
  double azimuth_deg = 0;  // 0 on the midline, positive on both halves of the face
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
double SmootherStep(double x, double from, double to) {
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * t * (t * (6 * t - 15) + 10);
}

// A hill (height > 0) or hollow on the front. Its place is one in the frontal plane of the base,
// and it is pushed forward.
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
    // A hill off the midline has a twin on the other side, so that the halves join smoothly.
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

// The profile of the nose over the base: for each height on the midline, the offset forward and
// down, and the width of the nose there.
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
  const double window = SmootherStep(z, -70, -58) * SmootherStep(-z, -12, -2);
  if (window == 0) {
    return Vec3::Zero();
  }
  const double profile = window * (0.4 * Plateau(x, width(z)) + 0.6 * Bell(x, width(z)));
  return {0, -profile * forward(z), -profile * down(z)};
}

// The left wing of the nose, the groove behind it and a hint of the nostril.
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

// A hill or hollow on the side, placed by azimuth and height, and pushed away from the axis.
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

namespace {

// The soft-tissue point of a landmark on an average adult; the left one of a pair.
struct SkinSite {
  std::string_view code;  // without side, as Site::landmark
  Vec3 near_skin;         // in the frame of HeadPoint, mm; near the skin, not exactly on it
};

// Heights and widths follow the definitions of the sites on the skull. Each point is moved out to
// the skin in the direction of the site's dowel.
const SkinSite kAverageSkin[] = {
    {"sg", {0, 0, 25}},       // the shallow above glabella
    {"g", {0, -2, 13}},       // most forward point of the brow
    {"n", {0, 1, 1}},         // the root of the nose
    {"rhi", {0, -10, -16}},   // the bony end of the bridge
    {"mp", {0, -6, -60}},     // the middle of the philtrum
    {"pr", {0, -11, -69.5}},  // the middle of the upper lip
    {"id", {0, -7, -85}},     // the middle of the lower lip
    {"sm", {0, 4, -94}},      // the deepest of the chin-lip fold
    {"pg", {0, 1, -107}},     // most forward point of the chin
    {"me", {0, 19, -121}},    // the underside of the chin; its dowel points down
    {"fe", {34, 14, 47}},     // the forehead's fullest, over the middle of the brow
    {"mso", {31, 8, 12}},     // the brow over the middle of the orbit
    {"mio", {35, 9, -26}},    // below the middle of the orbit, on its rim
    {"im", {42, 10, -45}},    // the lower border of the cheek bone, below mio
    {"lo", {50, 14, -37}},    // below the lateral margin of the orbit, 10 mm under its floor
    {"zy", {71, 62, -30}},    // halfway along the zygomatic arch
    {"sgl", {72, 83, -29}},   // the root of the arch, before and above the ear opening
    {"go", {61, 74, -84}},    // the angle of the jaw
    {"sM2", {57, 39, -58}},   // the cheek over the second upper molar
    {"mr", {65, 58, -70}},    // the ramus at the height of the mouth
    {"iM2", {51, 33, -82}},   // the cheek over the second lower molar
};

// Points on the formula's own features; the left one of a pair.
const SkinSite kFacialLandmarks[] = {
    {"prn", {0, -45, -44}},   // the tip of the nose, which is closest to a point in front of it
    {"sn", {0, -7, -54.5}},   // where the septum meets the philtrum
    {"sbal", {12, -8, -52}},  // under the wing
    {"en", {18, 11, -7}},     // ends of the line between the lids
    {"ex", {45, 25, -6}},     //
    {"ch", {26, 6, -75.5}},   //
    {"ls", {0, -8, -66}},     // borders of the lips, and the line between them
    {"sto", {0, -6, -74.5}},  //
    {"li", {0, -6, -85}},     //
};

const Vec3& NearSkin(const Site& site) {
  const auto* const found = std::ranges::find(kAverageSkin, site.landmark, &SkinSite::code);
  assert(found != std::end(kAverageSkin));
  return found->near_skin;
}

double DistanceSquared(const Vec2& uv, const Vec3& near_skin) {
  return (HeadPoint(uv.x(), uv.y()) - near_skin).squaredNorm();
}

// The closest grid point of the left half (last_u = 1) or of the midline (last_u = 0.5).
Vec2 ClosestOnGrid(const Vec3& near_skin, double last_u) {
  constexpr int kSteps = 60;
  double least = std::numeric_limits<double>::infinity();
  Vec2 best = Vec2::Constant(kNaN);
  for (int j = 0; j <= 2 * kSteps; ++j) {
    for (int i = 0; i <= (last_u > 0.5 ? kSteps : 0); ++i) {
      const Vec2 uv(0.5 + (last_u - 0.5) * i / kSteps, j / (2.0 * kSteps));
      if (const double d = DistanceSquared(uv, near_skin); d < least) {
        least = d;
        best = uv;
      }
    }
  }
  return best;
}

// Pattern search from the best point of the grid. It halves the step when no neighbour is closer.
Vec2 Closest(const Vec3& near_skin, double last_u) {
  Vec2 best = ClosestOnGrid(near_skin, last_u);
  double least = DistanceSquared(best, near_skin);
  for (double step = 0.5 / 60; step > 1e-9;) {
    const double u_step = last_u > 0.5 ? step : 0;
    const Vec2 start = best;
    for (const Vec2& d : {Vec2(u_step, 0), Vec2(-u_step, 0), Vec2(0, step), Vec2(0, -step)}) {
      const Vec2 uv = (start + d).cwiseMax(Vec2(0.5, 0)).cwiseMin(Vec2(last_u, 1));
      if (const double distance = DistanceSquared(uv, near_skin); distance < least) {
        least = distance;
        best = uv;
      }
    }
    step = best == start ? step / 2 : step;
  }
  return best;
}

}  // namespace

std::map<std::string, Vec2> TemplateSites() {
  std::map<std::string, Vec2> sites;
  for (const Site& site : StandardSites()) {
    if (site.side == Side::kRight) {
      const Vec2& left = sites.at(site.mirror);
      sites[site.code] = Vec2(1 - left.x(), left.y());
    } else {
      sites[site.code] = Closest(NearSkin(site), site.side == Side::kMidline ? 0.5 : 1);
    }
  }
  return sites;
}

std::map<std::string, Vec2> FacialLandmarks() {
  std::map<std::string, Vec2> landmarks;
  for (const SkinSite& place : kFacialLandmarks) {
    const std::string code(place.code);
    if (place.near_skin.x() == 0) {
      landmarks[code] = Closest(place.near_skin, 0.5);
    } else {
      const Vec2 left = Closest(place.near_skin, 1);
      landmarks[code + "_l"] = left;
      landmarks[code + "_r"] = Vec2(1 - left.x(), left.y());
    }
  }
  return landmarks;
}

std::vector<std::string> FacialLandmarkCodes() {
  std::vector<std::string> codes;
  for (const SkinSite& place : kFacialLandmarks) {
    const std::string code(place.code);
    const bool midline = place.near_skin.x() == 0;
    codes.push_back(midline ? code : code + "_l");
    if (!midline) {
      codes.push_back(code + "_r");
    }
  }
  return codes;
}

Vec2 UvOnGenericHead(const std::string& code) {
  static const std::map<std::string, Vec2> places = [] {
    std::map<std::string, Vec2> all = TemplateSites();
    all.merge(FacialLandmarks());
    return all;
  }();
  const auto found = places.find(code);
  if (found == places.end()) {
    throw InputError(fmt::format("landmark '{}' is not known on the generic head", code));
  }
  return found->second;
}

}  // namespace semblance::problems
