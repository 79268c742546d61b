// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/phantom_shape.h"

#include <cmath>
#include <numbers>

namespace semblance {
namespace {

struct Body {
  Vec3 middle;   // on an average skull, mm
  Vec3 half_mm;  // half axes
  double tilt;   // round x, radians
};

// Nothing here is narrower than lets the surface be moved out by 20 mm without folding: a dent of
// height h and width s curves by h / s^2, the foot of a bump by 0.45 h / s^2, both below 1 / 20 mm.
const BumpOnSkull kFeatures[] = {
    {{0, 0, 9}, {16, 30, 11}, 3},        // glabella
    {{0, -4, -19}, {14, 30, 13}, 6},     // nasal bones
    {{0, -4, -46}, {15, 30, 14}, -2.5},  // nasal opening
    {{0, -6, -66}, {24, 40, 13}, 4},     // upper jaw
    {{0, 0, -93}, {22, 30, 12}, -3},     // between teeth and chin
    {{0, 0, -110}, {21, 30, 18}, 7},     // chin
    {{0, 188, -2}, {32, 30, 20}, 5},     // occipital bone
    {{28, 4, 14}, {18, 30, 14}, 3},      // brow ridge
    {{34, 10, -12}, {18, 25, 18}, -1},   // orbit
    {{47, 20, -38}, {18, 26, 18}, 5.5},  // cheek bone
    {{64, 56, -28}, {25, 30, 19}, 13},   // zygomatic arch
    {{57, 36, 18}, {24, 24, 22}, -4},    // temple
    {{50, 66, -84}, {24, 24, 22}, 18},   // angle of the jaw
    {{30, 8, 46}, {22, 25, 20}, 2},      // frontal eminence
    {{60, 120, 58}, {28, 35, 28}, 4},    // parietal eminence
};
const Body kBodies[] = {
    {{0, 98, 17}, {70, 86, 68}, 0},      // brain case
    {{0, 47, -47}, {45, 47, 65}, -0.3},  // face, its lower end forward
    {{0, 88, -38}, {46, 46, 40}, 0},     // throat
};
constexpr double kBlend = 6;  // more joins the bodies with a sharper crease

Vec3 Jittered(const Vec3& v, double share, Random& random) {
  Vec3 factor;
  for (int i = 0; i < 3; ++i) {
    factor[i] = 1 + random.Uniform(-share, share);
  }
  return v.cwiseProduct(factor);
}

}  // namespace

Vec3 PhantomDirection(const Vec3& toward) { return (toward - kPhantomCentre).normalized(); }

double WaveSum::Value(const Vec3& direction) const {
  double sum = 0;
  for (const Wave& w : waves) {
    sum += w.amplitude * std::cos(w.wave_number.dot(direction) + w.phase);
  }
  return sum;
}

Vec3 WaveSum::Gradient(const Vec3& direction) const {
  Vec3 sum = Vec3::Zero();
  for (const Wave& w : waves) {
    sum -= w.amplitude * std::sin(w.wave_number.dot(direction) + w.phase) * w.wave_number;
  }
  return sum;
}

WaveSum DrawWaves(Random& random) {
  constexpr int kWaves = 5;
  WaveSum sum;
  for (int i = 0; i < kWaves; ++i) {
    const Vec3 direction = random.Direction();
    const double wave_number = random.Uniform(1.5, 3);
    const double phase = random.Uniform(0, 2 * std::numbers::pi);
    sum.waves.push_back({wave_number * direction, phase, 1 / std::sqrt(kWaves)});
  }
  return sum;
}

double PhantomBump::Away(const Vec3& at) const {
  return (at - direction).cwiseQuotient(sigma).squaredNorm() / 2;
}

double PhantomBump::Value(const Vec3& at) const {
  return height_mm * std::exp(-std::pow(Away(at), steepness));
}

Vec3 PhantomBump::Gradient(const Vec3& at) const {
  const double slope = steepness * std::pow(Away(at), steepness - 1);
  return -slope * Value(at) * (at - direction).cwiseQuotient(sigma).cwiseQuotient(sigma);
}

std::vector<PhantomBump> DrawBumps(std::span<const BumpOnSkull> bumps, const BumpSpread& spread,
                                   Random& random) {
  std::vector<PhantomBump> drawn;
  for (const BumpOnSkull& bump : bumps) {
    const double reach = (bump.on_skull - kPhantomCentre).norm();
    const double height = bump.height_mm * random.Uniform(1 - spread.height, 1 + spread.height);
    const bool paired = bump.on_skull.x() > 0;
    for (const double side : {1.0, -1.0}) {
      if (side > 0 || paired) {
        const Vec3 on_skull(side * bump.on_skull.x(), bump.on_skull.y(), bump.on_skull.z());
        const double asymmetry = paired ? random.Uniform(1 - spread.side, 1 + spread.side) : 1;
        drawn.push_back({PhantomDirection(on_skull), bump.sigma_mm / reach, height * asymmetry,
                         bump.steepness});
      }
    }
  }
  return drawn;
}

PhantomShape::PhantomShape(Random& random) {
  for (const Body& body : kBodies) {
    const Mat3 turn = Eigen::AngleAxisd(body.tilt, Vec3::UnitX()).toRotationMatrix();
    const Vec3 half = Jittered(body.half_mm, 0.03, random);
    bodies_.push_back({body.middle - kPhantomCentre,
                       turn * half.cwiseAbs2().cwiseInverse().asDiagonal() * turn.transpose()});
  }
  bumps_ = DrawBumps(kFeatures, {.height = 0.2, .side = 0.05}, random);
  waves_ = DrawWaves(random);
}

// The far root t of q(t d - offset) = 1; the middle of the rays lies inside.
PhantomShape::Radial PhantomShape::Hit(const Ellipsoid& e, const Vec3& direction) {
  const Vec3 qd = e.quadric * direction, qo = e.quadric * e.offset;
  const double a = direction.dot(qd), b = direction.dot(qo), c = e.offset.dot(qo) - 1;
  const double t = (b + std::sqrt(b * b - a * c)) / a;
  return {t, -(t * t * qd - t * qo) / (t * a - b)};
}

// A rounded union: the sum of the radii's high powers.
PhantomShape::Radial PhantomShape::Bodies(const Vec3& direction) const {
  std::vector<Radial> hits;
  double sum = 0;
  for (const Ellipsoid& e : bodies_) {
    hits.push_back(Hit(e, direction));
    sum += std::pow(hits.back().radius_mm, kBlend);
  }
  Radial whole{std::pow(sum, 1 / kBlend), Vec3::Zero()};
  for (const Radial& hit : hits) {
    whole.gradient += std::pow(hit.radius_mm / whole.radius_mm, kBlend - 1) * hit.gradient;
  }
  return whole;
}

PhantomShape::Radial PhantomShape::At(const Vec3& direction) const {
  constexpr double kWaveMm = 1;
  Radial r = Bodies(direction);
  for (const PhantomBump& bump : bumps_) {
    r.radius_mm += bump.Value(direction);
    r.gradient += bump.Gradient(direction);
  }
  r.radius_mm += kWaveMm * waves_.Value(direction);
  r.gradient += kWaveMm * waves_.Gradient(direction);
  r.gradient -= direction * direction.dot(r.gradient);
  return r;
}

double PhantomShape::Radius(const Vec3& direction) const { return At(direction).radius_mm; }

// The gradient of |x| - Radius(x / |x|) at the surface.
Vec3 PhantomShape::Normal(const Vec3& direction) const {
  const Radial r = At(direction);
  return (direction - r.gradient / r.radius_mm).normalized();
}

}  // namespace semblance
