// SPDX-License-Identifier: GPL-3.0-or-later
// Scattered data on known surfaces: Franke's function, and a head-like surface, closed in u, with
// bumps at three scales.
#pragma once

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "fitting/problem/fit_target.h"
#include "surfaces/base/random.h"
#include "surfaces/hspline/hspline_surface.h"
#include "tests/testing/shapes.h"

namespace semblance::testing {
using namespace problems;

inline double Franke(double x, double y) {
  const auto square = [](double t) { return t * t; };
  return 0.75 * std::exp(-(square(x - 2) + square(y - 2)) / 4) +
         0.75 * std::exp(-square(x + 1) / 49 - (y + 1) / 10) +
         0.5 * std::exp(-(square(x - 7) + square(y - 3)) / 4) -
         0.2 * std::exp(-square(x - 4) - square(y - 7));
}

inline Vec3 FrankePoint(const Vec2& uv) { return {uv.x(), uv.y(), Franke(9 * uv.x(), 9 * uv.y())}; }

struct Bump {
  double u, v, height, width;
};

// Six large bumps, twenty medium ones, sixty small ones crowded in the region of the face, and two
// at the seam.
inline constexpr Bump kHeadBumps[] = {
    {0.293443, 0.711028, 0.049173, 0.138333},
    {0.500054, 0.878495, 0.013378, 0.112161},
    {0.868376, 0.114196, 0.106516, 0.136519},
    {0.57254, 0.127689, 0.12631, 0.139991},
    {0.452846, 0.629498, 0.116831, 0.123814},
    {0.41264, 0.658123, 0.105117, 0.10191},
    {0.727749, 0.554048, 0.016506, 0.039821},
    {0.310182, 0.477762, -0.015632, 0.044666},
    {0.616594, 0.262824, -0.021935, 0.032589},
    {0.348053, 0.74422, -0.022268, 0.030716},
    {0.258928, 0.455003, 0.018388, 0.034491},
    {0.355285, 0.420609, -0.001308, 0.030933},
    {0.330854, 0.475193, 0.017377, 0.030959},
    {0.407591, 0.793415, 0.018129, 0.043918},
    {0.548044, 0.242564, -0.021851, 0.031359},
    {0.614991, 0.808661, 0.002748, 0.032422},
    {0.644172, 0.739377, -0.024938, 0.039987},
    {0.312036, 0.37916, -0.027041, 0.036994},
    {0.618677, 0.271325, -0.002106, 0.038007},
    {0.67172, 0.54715, 0.01092, 0.040263},
    {0.274788, 0.434878, 0.032773, 0.032563},
    {0.556697, 0.209633, 0.005954, 0.039596},
    {0.369684, 0.72053, -0.021304, 0.030716},
    {0.468847, 0.688869, 0.021653, 0.031501},
    {0.284723, 0.325305, 0.017818, 0.044234},
    {0.646519, 0.685665, 0.010316, 0.032322},
    {0.506883, 0.569869, -0.005538, 0.00905},
    {0.609261, 0.573671, -0.000901, 0.008936},
    {0.438586, 0.507849, 0.006358, 0.009301},
    {0.447992, 0.69773, -0.005898, 0.010772},
    {0.61444, 0.696668, -0.000195, 0.008558},
    {0.51647, 0.477202, 0.006175, 0.008649},
    {0.567692, 0.554506, 0.000863, 0.010995},
    {0.598274, 0.513473, 0.006265, 0.011181},
    {0.442286, 0.689612, 0.000382, 0.010807},
    {0.392868, 0.451382, -0.00278, 0.009181},
    {0.490924, 0.531067, -0.006018, 0.009311},
    {0.545908, 0.682439, -0.001558, 0.009414},
    {0.441748, 0.605042, -0.001572, 0.009912},
    {0.499964, 0.482956, 0.002782, 0.01071},
    {0.609523, 0.564717, 0.005887, 0.009466},
    {0.464441, 0.631979, -0.002758, 0.010343},
    {0.592079, 0.575393, 0.004813, 0.009976},
    {0.575031, 0.683328, -0.001953, 0.009974},
    {0.578277, 0.50355, 0.002393, 0.011585},
    {0.420031, 0.44358, -0.007222, 0.009441},
    {0.437757, 0.643491, -0.000499, 0.008609},
    {0.582496, 0.661465, -0.00765, 0.010353},
    {0.39504, 0.500024, -0.003787, 0.010948},
    {0.441482, 0.48914, 0.007937, 0.011879},
    {0.607791, 0.547588, -0.000927, 0.010201},
    {0.382756, 0.439754, -0.00663, 0.009522},
    {0.415882, 0.486402, -0.001946, 0.009578},
    {0.437952, 0.677472, -0.002673, 0.009196},
    {0.564339, 0.436053, 5e-05, 0.008},
    {0.475048, 0.503772, 0.006643, 0.009093},
    {0.48592, 0.536789, -0.001156, 0.009507},
    {0.385503, 0.543669, -0.005463, 0.01056},
    {0.575529, 0.591618, -0.003679, 0.010006},
    {0.576399, 0.685339, -0.004557, 0.009785},
    {0.419246, 0.429201, -0.004799, 0.009399},
    {0.398895, 0.570038, 0.006102, 0.009404},
    {0.480528, 0.492842, 0.00309, 0.010456},
    {0.562311, 0.671889, -0.003298, 0.010247},
    {0.508441, 0.503547, -0.007265, 0.01032},
    {0.460211, 0.594711, 0.003069, 0.011497},
    {0.589293, 0.569321, -0.00661, 0.01061},
    {0.432355, 0.530719, 0.007369, 0.010465},
    {0.61581, 0.620808, 0.004563, 0.010573},
    {0.399679, 0.561034, -0.0063, 0.010618},
    {0.457414, 0.558944, -0.004719, 0.009},
    {0.479405, 0.570152, -0.002772, 0.008427},
    {0.405573, 0.466689, 0.006898, 0.008708},
    {0.486707, 0.495179, -0.002019, 0.00878},
    {0.554323, 0.473544, -0.00709, 0.01105},
    {0.544598, 0.599339, -0.001385, 0.011868},
    {0.530525, 0.444189, -0.004977, 0.010245},
    {0.425297, 0.616533, 0.007349, 0.011667},
    {0.498399, 0.54064, -0.003894, 0.009862},
    {0.405885, 0.638573, 0.00633, 0.01007},
    {0.393895, 0.410863, -0.006399, 0.009536},
    {0.516181, 0.493446, 0.00354, 0.009226},
    {0.543758, 0.675066, -0.000392, 0.008227},
    {0.480358, 0.403226, -0.007688, 0.00957},
    {0.519815, 0.512664, -0.004391, 0.010107},
    {0.486364, 0.661067, -0.001302, 0.011858},
    {0.0, 0.5, 0.03, 0.03},
    {0.995, 0.55, 0.006, 0.01},
};

// A head-like surface of unit size.
inline Vec3 HeadPoint(const Vec2& uv) {
  double r = 1;
  for (const Bump& bump : kHeadBumps) {
    const double off = uv.x() - bump.u, du = off - std::round(off), dv = uv.y() - bump.v;
    r += bump.height * std::exp(-(du * du + dv * dv) / (2 * bump.width * bump.width));
  }
  const double t = std::numbers::pi * (0.06 + 0.88 * uv.y()), p = 2 * std::numbers::pi * uv.x();
  return {0.78 * r * std::sin(t) * std::cos(p), 0.95 * r * std::sin(t) * std::sin(p),
          1.2 * r * std::cos(t)};
}

// `count` points of the surface at random (u,v), with noise (standard deviation) in each
// coordinate.
template <class Surface>
FitTarget Scattered(const Surface& surface, int count, double noise, std::uint64_t random_seed) {
  Random random(random_seed);
  FitTarget target;
  target.points.reserve(count);
  for (int k = 0; k < count; ++k) {
    const Vec2 uv(random.Uniform(0, 1), random.Uniform(0, 1));
    const Vec3 off(random.Normal(), random.Normal(), random.Normal());
    target.points.push_back({.label = {}, .position = surface(uv) + noise * off, .uv = uv});
  }
  return target;
}

struct CleanError {
  double rms = kNaN, largest = kNaN;
};

// Distance of the fitted surface from the true one at the same (u,v), on a dense grid that was not
// fitted.
template <class Surface>
CleanError ErrorAgainst(const Surface& surface, const HSplineSurface& fitted, int side = 400) {
  double sum = 0, largest = 0;
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) {
      const Vec2 uv((i + 0.5) / side, (j + 0.5) / side);
      const double square = (fitted.Point(uv) - surface(uv)).squaredNorm();
      sum += square;
      largest = std::max(largest, square);
    }
  }
  return {std::sqrt(sum / side / side), std::sqrt(largest)};
}

// A square, or a barrel (closed in u), to start from.
inline HSplineSurface PlainStart(const HSplineShape& shape) {
  ControlNet net{shape.Columns(0), shape.Rows(0), {}};
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      const double u = (i - 1.0) / shape.patches_u, v = (j - 1.0) / shape.patches_v;
      const double p = 2 * std::numbers::pi * u;
      net.vertices.push_back(shape.ClosedU() ? Vec3(std::cos(p), std::sin(p), 1.2 - 2.4 * v)
                                             : Vec3(u, v, 0));
    }
  }
  return HSplineSurface(shape, net);
}

// Writes points to fit as the text of a table.
inline std::string PlainCsv(const FitTarget& target) {
  std::string csv = "x,y,z\n";
  for (const FitPoint& p : target.points) {
    csv += fmt::format("{},{},{}\n", p.position.x(), p.position.y(), p.position.z());
  }
  return csv;
}

inline std::string UvCsv(const FitTarget& target) {
  std::string csv = "x,y,z,u,v\n";
  for (const FitPoint& p : target.points) {
    csv += fmt::format("{},{},{},{},{}\n", p.position.x(), p.position.y(), p.position.z(), p.uv.x(),
                       p.uv.y());
  }
  return csv;
}

}  // namespace semblance::testing
