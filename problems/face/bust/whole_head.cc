// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/bust/whole_head.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <utility>

#include "fitting/fit.h"
#include "fitting/problem/start_surface.h"
#include "problems/face/bust/head_domain.h"
#include "surfaces/base/error.h"
#include "surfaces/base/json_text.h"
#include "surfaces/hspline_files/hspline_json.h"

namespace semblance::problems {
namespace {

using json_parts::Json;

constexpr HSplineShape kShape = {
    .patches_u = 16, .patches_v = 12, .max_level = 4, .closure = Closure::kPeriodicU};
constexpr int kHeadSamplesPerPatch = 2;     // of the finest level, along each side
constexpr double kHeadTolerance_mm = 0.12;  // patches that are farther off are refined
constexpr double kWave_mm = 1;              // smoothness halves displacements of this wavelength
constexpr double kUnit_mm = 1e-3;           // of the written numbers

FitOptions HeadFitOptions() {
  constexpr double kLength_mm = 10;
  const double wave = kWave_mm / (2 * std::numbers::pi * kLength_mm);
  return {
      .plan =
          AdaptivePlan{
              .tolerance_mm = kHeadTolerance_mm, .finest = kShape.max_level, .min_points = 4},
      .terms = {PointTerm{}, SmoothnessTerm{.weight = std::pow(wave, 4), .length_mm = kLength_mm}},
      .features = FreeFeatures{},
      .relaxation = NoRelaxation{},
      .solver = Solver::kFastest};
}

Vec3 Rounded(const Vec3& v) {
  return {std::round(v.x() / kUnit_mm) * kUnit_mm, std::round(v.y() / kUnit_mm) * kUnit_mm,
          std::round(v.z() / kUnit_mm) * kUnit_mm};
}

// Rounds to three decimals, so that the written text is short.
Vec3 Shortened(const Vec3& v) {
  const auto number = [](double x) { return std::stod(fmt::format("{:.3f}", x)) + 0.0; };
  return {number(v.x()), number(v.y()), number(v.z())};
}

HSplineSurface Shortened(const HSplineSurface& surface) {
  ControlNet net = surface.Net(0);
  std::ranges::transform(net.vertices, net.vertices.begin(),
                         [](const Vec3& v) { return Shortened(Rounded(v)); });
  HSplineSurface result(surface.shape(), net);
  std::map<VertexId, std::optional<Vec3>> offsets;
  for (const auto& [vertex, offset] : surface.Offsets()) {
    const Vec3 rounded = Shortened(Rounded(offset));
    if (!rounded.isZero()) {
      offsets[vertex] = rounded;
    }
  }
  result.SetOffsets(offsets);
  return result;
}

// The least-squares sphere through points. Needs four that do not lie on a circle.
Sphere FitSphere(std::span<const Vec3> points) {
  const auto n = static_cast<Eigen::Index>(points.size());
  Vec3 middle = Vec3::Zero();
  for (const Vec3& p : points) {
    middle += p / static_cast<double>(n);
  }
  Eigen::MatrixXd left(n, 4);
  Eigen::VectorXd right(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vec3 p = points[i] - middle;
    left.row(i) << 2 * p.transpose(), 1;
    right[i] = p.squaredNorm();
  }
  const Eigen::Vector4d x = left.colPivHouseholderQr().solve(right);
  return {middle + x.head<3>(), std::sqrt(x[3] + x.head<3>().squaredNorm())};
}

// The balls behind openings that lie off the midline and are as wide as an eye.
std::vector<Sphere> Eyeballs(const HeadDomain& domain) {
  constexpr double kNarrowest_mm = 15, kWidest_mm = 40, kOffMidline_mm = 15;  // of an eye's opening
  constexpr double kBehindLid_mm = 0.1;  // gap between the ball and the lids
  const double midline = Bounds(domain.mesh).center().x();
  std::vector<Sphere> eyes;
  for (const auto& rim : domain.rims) {
    std::vector<Vec3> points;
    Box3 box;
    for (const std::int32_t v : rim) {
      points.push_back(domain.mesh.points[v]);
      box.extend(points.back());
    }
    const double width = box.sizes().x(), aside = std::abs(box.center().x() - midline);
    if (width > kNarrowest_mm && width < kWidest_mm && aside > kOffMidline_mm) {
      Sphere ball = FitSphere(points);
      ball.radius_mm -= kBehindLid_mm;
      eyes.push_back({Shortened(ball.center), Shortened(Vec3::Constant(ball.radius_mm)).x()});
    }
  }
  std::ranges::sort(eyes, {}, [](const Sphere& eye) { return eye.center.x(); });
  return eyes;
}

// The number of points of a ring: half of the ring below if they would be crowded, else the same.
// So no slivers meet at the crown.
int CountColumns(const WholeHead& head, int row, int below, int rows) {
  constexpr int kFewestColumns = 8;  // of the last rings
  constexpr int kProbes = 32;        // edges over which the lengths are measured
  const double v = static_cast<double>(row) / rows;
  double round = 0, up = 0;
  for (int i = 0; i < kProbes; ++i) {
    const Vec3 p = head.surface.Point({double(i) / kProbes, v});
    round += (head.surface.Point({double(i + 1) / kProbes, v}) - p).norm();
    up += (head.surface.Point({double(i) / kProbes, v - 1.0 / rows}) - p).norm() / kProbes;
  }
  return row > rows / 2 && below % 2 == 0 && below > kFewestColumns && round / below < 0.5 * up
             ? below / 2
             : below;
}

std::vector<Vec3> MakeRing(const WholeHead& head, double v, int columns) {
  std::vector<Vec3> ring;
  for (int i = 0; i < columns; ++i) {
    ring.push_back(head.surface.Point({double(i) / columns, v}));
  }
  return ring;
}

// Close to the crown, where all u meet, some points of a ring nearly coincide while others are far
// apart. The triangles between such points would fold over.
bool IsCrowded(const std::vector<Vec3>& ring) {
  constexpr double kLongest_mm = 60;    // longer rings are not close to the crown
  constexpr double kLeastOfMean = 0.3;  // shortest edge of a sound ring, as a part of the mean edge
  double round = 0, shortest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const double edge = (ring[(i + 1) % ring.size()] - ring[i]).norm();
    round += edge;
    shortest = std::min(shortest, edge);
  }
  return round < kLongest_mm && shortest < kLeastOfMean * round / static_cast<double>(ring.size());
}

// Joins two rings by triangles. The upper one has as many points as the lower one, or half as many.
void JoinRings(int lower, int n, int upper, int m, TriMesh& mesh) {
  for (int i = 0; i < m; ++i) {
    const int next = (i + 1) % m;
    if (n == m) {
      mesh.triangles.push_back({lower + i, lower + next, upper + next});
      mesh.triangles.push_back({lower + i, upper + next, upper + i});
      continue;
    }
    const int a = lower + 2 * i, middle = a + 1, b = lower + (2 * i + 2) % n;
    mesh.triangles.push_back({a, middle, upper + i});
    mesh.triangles.push_back({middle, upper + next, upper + i});
    mesh.triangles.push_back({middle, b, upper + next});
  }
}

}  // namespace

WholeHeadFit FitWholeHead(const TriMesh& mesh, const std::string& name, const RunContext& context) {
  const HeadDomain domain = LayOutHead(mesh, name);
  const HeadSamples samples =
      SampleHead(domain, kHeadSamplesPerPatch * kShape.PatchesU(kShape.max_level),
                 kHeadSamplesPerPatch * kShape.PatchesV(kShape.max_level));
  const HSplineSurface start = StartSurface(kShape, samples.points, samples.uv);
  const FitResult fit =
      Fit(start, MakeFitTarget(samples.points, samples.uv), {}, HeadFitOptions(), context);
  WholeHeadFit result{.head = {Shortened(fit.surface), Eyeballs(domain)}, .usable = fit.usable};
  double sum = 0, most = 0;
  for (std::size_t k = 0; k < samples.uv.size(); ++k) {
    const double off = (result.head.surface.Point(samples.uv[k]) - samples.points[k]).norm();
    sum += off * off;
    most = std::max(most, off);
  }
  result.rms_mm = std::sqrt(sum / static_cast<double>(samples.uv.size()));
  result.max_mm = most;
  return result;
}

std::string WholeHeadToJson(const WholeHead& head) {
  Json eyeballs = Json::array();
  for (const Sphere& eye : head.eyeballs) {
    eyeballs.push_back({eye.center.x(), eye.center.y(), eye.center.z(), eye.radius_mm});
  }
  const Json json = {{"format", "semblance-head"},
                     {"version", 1},
                     {"units", "mm"},
                     {"eyeballs", eyeballs},
                     {"surface", Json::parse(HSplineToJson(head.surface))}};
  return json.dump() + "\n";
}

WholeHead WholeHeadFromJson(std::string_view text, const std::string& name) try {
  const Json json = json_parts::ParseWithoutRepeats(text);
  json_parts::RequireKeys(json, {"format", "version", "units", "eyeballs", "surface"});
  json_parts::RequireFormat(json, "semblance-head", 1);
  std::vector<Sphere> eyeballs;
  for (const Json& row : json_parts::ListFromJson(json, "eyeballs")) {
    json_parts::RequireSize(row, 4);
    const Vec3 radius = json_parts::VecFromJson(row, 1);
    if (!(radius.z() > 0)) {
      throw IoError("an eyeball's radius must be positive");
    }
    eyeballs.push_back({json_parts::VecFromJson(row, 0), radius.z()});
  }
  HSplineSurface surface = HSplineFromJson(json.at("surface").dump(), "its surface");
  if (surface.shape().closure != Closure::kPeriodicU) {
    throw IoError("its surface must go round in u; write closure periodic_u");
  }
  return {std::move(surface), std::move(eyeballs)};
} catch (const IoError& error) {
  throw IoError(fmt::format("{}: {}", name, error.what()));
} catch (const Json::exception& error) {
  throw IoError(fmt::format(
      "{}: not a head that can be read: {}; write it again with `semblance template --bust`", name,
      JsonFault(error)));
}

TriMesh WholeHeadMesh(const WholeHead& head, int columns, int rows) {
  TriMesh mesh;
  std::vector<int> first, count;  // of each ring
  for (int j = 0; j < rows; ++j) {
    const int around = CountColumns(head, j, j == 0 ? columns : count.back(), rows);
    const std::vector<Vec3> ring = MakeRing(head, double(j) / rows, around);
    if (j > rows / 2 && IsCrowded(ring)) {
      break;
    }
    first.push_back(static_cast<int>(mesh.points.size()));
    count.push_back(around);
    mesh.points.insert(mesh.points.end(), ring.begin(), ring.end());
  }
  Vec3 crown = Vec3::Zero();
  for (int i = 0; i < columns; ++i) {
    crown += head.surface.Point({double(i) / columns, 1}) / columns;
  }
  const auto top = static_cast<std::int32_t>(mesh.points.size());
  mesh.points.push_back(crown);
  for (std::size_t j = 0; j + 1 < first.size(); ++j) {
    JoinRings(first[j], count[j], first[j + 1], count[j + 1], mesh);
  }
  for (int i = 0; i < count.back(); ++i) {
    mesh.triangles.push_back({first.back() + i, first.back() + (i + 1) % count.back(), top});
  }
  return mesh;
}

}  // namespace semblance::problems
