// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/phantom_shape.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace semblance::problems {
namespace {

struct Body {
  Vec3 centre;   // on an average skull, mm
  Vec3 half_mm;  // half axes
  double tilt;   // about x, radians
};

// The features of the skull. They are wide enough that the surface can be moved out by 20 mm
// without folding: a dent of height h and width s has the curvature h / s^2, the foot of a bump
// 0.45 h / s^2; both stay below 1 / 20 mm.
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
// Exponent of the rounded union of bodies; a larger one joins them with a sharper crease.
constexpr double kBlend = 6;

Vec3 Jittered(const Vec3& v, double share, Random& random) {
  Vec3 factor;
  for (int i = 0; i < 3; ++i) {
    factor[i] = 1 + random.Uniform(-share, share);
  }
  return v.cwiseProduct(factor);
}

// The places where three measured heads have much or little tissue. The relief is as strong as the
// variogram of those heads' depths allows.
const BumpOnSkull kBumps[] = {
    {{36, 26, -62}, {12.7, 28.3, 12.7}, -8},  // between cheek bone and jaw
    {{52, 58, -60}, {28.3, 12.7, 14.1}, -3},  // masseteric fossa
    {{36, 34, -92}, {12.7, 21.2, 8.5}, -3},   // beside the lower teeth
    {{28, 10, -44}, {7.8, 21.2, 7.1}, -3},    // canine fossa
    {{34, 10, -9}, {12, 21.2, 10.6}, 4, 2},   // orbit, filled as the shell of a head fills it
    {{0, -4, -42}, {7.8, 21.2, 9.2}, -4, 2},  // nasal opening
    {{0, -5, -64}, {15.6, 21.2, 8.5}, -3},    // over the upper teeth
    {{0, -1, -96}, {15.6, 21.2, 5.7}, -3},    // between teeth and chin
    {{60, 44, 6}, {28.3, 12.7, 12.7}, -3},    // temporal fossa
    {{28, 28, -118}, {17, 17, 7.1}, -3},      // below the jaw
    {{50, 70, -90}, {28.3, 9.9, 9.9}, -3},    // behind the angle of the jaw
    {{0, -10, -21}, {6.4, 21.2, 7.1}, 2},     // nasal bones
    {{66, 58, -26}, {28.3, 18.4, 4.9}, 2},    // zygomatic arch
    {{48, 20, -32}, {7.8, 14.1, 5.7}, 2},     // cheek bone
};
// Roughness as a fraction of the tissue: on real heads the bone is rough where tissue is thick, and
// smooth under the scalp.
constexpr RoughnessOptions kRoughness{
    .sd = 0.26, .length_mm = 20, .shortest_mm = 12, .radius_mm = 90};

// The x for which the integral of sin^2 from 0 to x is `share` of the integral to `end`. Bisection.
double SineSquareQuantile(double share, double end) {
  const auto integral = [](double x) { return x - std::sin(x) * std::cos(x); };
  double low = 0, high = end;
  for (int i = 0; i < 50; ++i) {
    const double middle = (low + high) / 2;
    (integral(middle) < share * integral(end) ? low : high) = middle;
  }
  return (low + high) / 2;
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

double PhantomBump::SquaredDistance(const Vec3& at) const {
  return (at - direction).cwiseQuotient(sigma).squaredNorm() / 2;
}

double PhantomBump::Value(const Vec3& at) const {
  return height_mm * std::exp(-std::pow(SquaredDistance(at), steepness));
}

Vec3 PhantomBump::Gradient(const Vec3& at) const {
  const double slope = steepness * std::pow(SquaredDistance(at), steepness - 1);
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
    bodies_.push_back({body.centre - kPhantomCentre,
                       turn * half.cwiseAbs2().cwiseInverse().asDiagonal() * turn.transpose()});
  }
  bumps_ = DrawBumps(kFeatures, {.height = 0.2, .side = 0.05}, random);
  waves_ = DrawWaves(random);
}

// The larger root t of q(t d - offset) = 1. The rays' centre lies inside the ellipsoid.
PhantomShape::Radial PhantomShape::FarHit(const Ellipsoid& e, const Vec3& direction) {
  const Vec3 qd = e.quadric * direction, qo = e.quadric * e.offset;
  const double a = direction.dot(qd), b = direction.dot(qo), c = e.offset.dot(qo) - 1;
  const double t = (b + std::sqrt(b * b - a * c)) / a;
  return {t, -(t * t * qd - t * qo) / (t * a - b)};
}

// A rounded union: the radius is the kBlend-norm of the bodies' radii.
PhantomShape::Radial PhantomShape::JoinedBodies(const Vec3& direction) const {
  std::vector<Radial> hits;
  double sum = 0;
  for (const Ellipsoid& e : bodies_) {
    hits.push_back(FarHit(e, direction));
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
  Radial r = JoinedBodies(direction);
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

// In space the spectrum of exp(-r / length) falls as 1 / (1 + (k length)^2)^2. With the wave number
// k = tan(x) / length, the density of waves over x is proportional to sin^2 x.
WaveSum DrawRoughness(const RoughnessOptions& options, Random& random) {
  constexpr int kWaves = 160;  // more waves come closer to a Gaussian field, and cost more time
  const double end = std::atan(2 * std::numbers::pi / options.shortest_mm * options.length_mm);
  WaveSum sum;
  for (int i = 0; i < kWaves; ++i) {
    const double angle = SineSquareQuantile((i + random.Uniform()) / kWaves, end);
    const Vec3 direction = random.Direction();
    const double wave_number = std::tan(angle) / options.length_mm * options.radius_mm;
    const double phase = random.Uniform(0, 2 * std::numbers::pi);
    sum.waves.push_back({wave_number * direction, phase, options.sd * std::sqrt(2.0 / kWaves)});
  }
  return sum;
}

PhantomRelief::PhantomRelief(Random& random)
    : weight_(std::clamp(1 + 0.12 * random.BoundedNormal(), 0.76, 1.24)),
      bumps_(DrawBumps(kBumps, {.height = 0.25, .side = 0.1}, random)),
      roughness_(DrawRoughness(kRoughness, random)) {}

double PhantomRelief::Height(const Vec3& direction) const {
  double height_mm = 0;
  for (const PhantomBump& bump : bumps_) {
    height_mm += bump.Value(direction);
  }
  return height_mm;
}

// Positive roughness acts linearly, so that tissue stays bounded. The thickness approaches its
// minimum smoothly (softplus), so that prominences are rounded off and not cut.
double PhantomRelief::Thickness(const Vec3& direction, double smooth_mm) const {
  constexpr double kMinThickness_mm = 2, kRounding_mm = 1;
  const double tissue_mm = std::max(0.0, smooth_mm - Height(direction));
  const double rough = roughness_.Value(direction);
  const double factor = weight_ * (rough < 0 ? std::exp(rough) : 1 + rough);
  const double above = (factor * tissue_mm - kMinThickness_mm) / kRounding_mm;
  const double rounded = above > 30 ? above : std::log1p(std::exp(above));
  return kMinThickness_mm + kRounding_mm * rounded;
}

}  // namespace semblance::problems
