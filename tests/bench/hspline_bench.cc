// SPDX-License-Identifier: GPL-3.0-or-later
// Batch evaluation of H-splines against OpenCASCADE's B-spline of the same dense net and a plain de
// Boor, closest points against OpenCASCADE's, one thread, in one run; and the memory of a surface
// with local detail against that of its dense net.
#include <fmt/format.h>

#include <Extrema_ExtPS.hxx>
#include <GeomAdaptor_Surface.hxx>
#include <Geom_BSplineSurface.hxx>
#include <TColStd_Array1OfInteger.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TColgp_Array2OfPnt.hxx>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <gp_Pnt.hxx>
#include <gp_Vec.hxx>

#include "surfaces/base/random.h"
#include "surfaces/hspline_query/hspline_batch.h"
#include "surfaces/hspline_query/hspline_project.h"
#include "tests/testing/splines.h"

namespace semblance::problems {
namespace {

constexpr int kCount = 1'000'000;
constexpr int kRepeats = 5;  // the fastest counts

// Million answers a second of processor time, of both, taken in turns.
template <class Ours, class Peer>
std::pair<double, double> Rates(const Ours& ours, const Peer& peer, int count = kCount) {
  const auto rate = [&](const auto& body) {
    const std::clock_t start = std::clock();
    body();
    return count * (double(CLOCKS_PER_SEC) / double(std::clock() - start)) / 1e6;
  };
  std::pair<double, double> best{0, 0};
  for (int r = 0; r < kRepeats; ++r) {
    best.first = std::max(best.first, rate(ours));
    best.second = std::max(best.second, rate(peer));
  }
  return best;
}

// A face-like surface: 8 x 8 patches, four more levels, 3000 edits within a quarter of the domain.
HSplineSurface FaceLike() {
  const HSplineShape shape{.patches_u = 8, .patches_v = 8, .max_level = 4};
  HSplineSurface surface = testing::SmoothSurface(shape, 1);
  Random random(2);
  for (int level = 1; level <= 4; ++level) {
    std::map<VertexId, std::optional<Vec3>> offsets;
    for (int e = 0; e < 750; ++e) {
      offsets[{level, static_cast<int>(random.Uniform(0.25, 0.75) * shape.Columns(level)),
               static_cast<int>(random.Uniform(0.25, 0.75) * shape.Rows(level))}] =
          random.InBox(-0.2, 0.2);
    }
    surface.SetOffsets(offsets);
  }
  return surface;
}

Handle(Geom_BSplineSurface) OcctOf(const HSplineSurface& surface) {
  const int level = surface.shape().max_level;
  const ControlNet& net = surface.Net(level);
  TColgp_Array2OfPnt poles(1, net.columns, 1, net.rows);
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      const Vec3& p = net.At(i, j);
      poles.SetValue(i + 1, j + 1, gp_Pnt(p.x(), p.y(), p.z()));
    }
  }
  const auto knots = [](int patches) {
    TColStd_Array1OfReal values(1, patches + 7);
    for (int k = 0; k < patches + 7; ++k) {
      values.SetValue(k + 1, (k - 3.0) / patches);
    }
    return values;
  };
  const auto ones = [](int patches) { return TColStd_Array1OfInteger(1, patches + 7); };
  const int m = surface.shape().PatchesU(level), n = surface.shape().PatchesV(level);
  TColStd_Array1OfInteger mu = ones(m), mv = ones(n);
  mu.Init(1);
  mv.Init(1);
  return new Geom_BSplineSurface(poles, knots(m), knots(n), mu, mv, 3, 3);
}

// De Boor's triangle along both directions of one patch of the net, with uniform knots.
Vec3 DeBoorPoint(const ControlNet& net, int m, int n, const Vec2& uv) {
  const double x = uv.x() * m, y = uv.y() * n;
  const int i = std::min(static_cast<int>(x), m - 1), j = std::min(static_cast<int>(y), n - 1);
  const auto triangle = [](std::array<Vec3, 4> d, double t) {
    for (int r = 1; r <= 3; ++r) {
      for (int k = 3; k >= r; --k) {
        const double alpha = (t + 3 - k) / (4 - r);
        d[k] = (1 - alpha) * d[k - 1] + alpha * d[k];
      }
    }
    return d[3];
  };
  std::array<Vec3, 4> rows;
  for (int b = 0; b < 4; ++b) {
    rows[b] = triangle(
        {net.At(i, j + b), net.At(i + 1, j + b), net.At(i + 2, j + b), net.At(i + 3, j + b)},
        x - i);
  }
  return triangle(rows, y - j);
}

void Print(const char* name, double ours, double peer, double goal, const char* unit,
           bool less_is_better = false) {
  const double ratio = less_is_better ? peer / ours : ours / peer;
  fmt::print(
      "{{\"name\": \"{}\", \"ours\": {:.4g}, \"peer\": {:.4g}, \"ratio\": {:.3g}, \"goal\": {:g}, "
      "\"met\": {}, \"unit\": \"{}\", \"command\": \"build/tests/bench/hspline_bench\"}}\n",
      name, ours, peer, ratio, goal, ratio >= goal, unit);
}

// Closest points, from 5 mm off the surface: ours against OpenCASCADE's extrema.
void ProjectBoth(const HSplineSurface& surface, const Handle(Geom_BSplineSurface) & occt) {
  constexpr int kPoints = 100;
  Random random(4);
  std::vector<Vec3> points;
  for (int k = 0; k < kPoints; ++k) {
    const Vec2 uv(random.Uniform(0, 1), random.Uniform(0, 1));
    points.push_back(surface.Point(uv) + random.Uniform(-5, 5) * surface.Normal(uv));
  }
  const SurfaceProjector projector(surface);
  const GeomAdaptor_Surface adaptor(occt, 0, 1, 0, 1);
  Extrema_ExtPS extrema;
  extrema.Initialize(adaptor, 0, 1, 0, 1, 1e-9, 1e-9);
  double further = 0;  // that ours is, of any point
  std::vector<double> distances(kPoints);
  const auto [ours, peer] = Rates(
      [&] {
        for (int k = 0; k < kPoints; ++k) {
          distances[k] = projector.Project(points[k]).distance_mm;
        }
      },
      [&] {
        for (int k = 0; k < kPoints; ++k) {
          extrema.Perform(gp_Pnt(points[k].x(), points[k].y(), points[k].z()));
          for (int e = 1; extrema.IsDone() && e <= extrema.NbExt(); ++e) {
            further = std::max(further, distances[k] - std::sqrt(extrema.SquareDistance(e)));
          }
        }
      },
      kPoints);
  if (further > 1e-6) {
    fmt::print(stderr, "hspline_bench: a closest point is further by {} mm\n", further);
  }
  Print("hspline.projection_vs_occt", 1e6 * ours, 1e6 * peer, 1, "a second");
}

double LargestComponent(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double largest = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    largest = std::max(largest, (a[k] - b[k]).norm());
  }
  return largest;
}

int Main() {
  const HSplineSurface surface = FaceLike();
  const int level = surface.shape().max_level, m = surface.shape().PatchesU(level),
            n = surface.shape().PatchesV(level);
  Random random(3);
  std::vector<Vec2> uv;
  for (int k = 0; k < kCount; ++k) {
    uv.emplace_back(random.Uniform(0, 1), random.Uniform(0, 1));
  }
  const HSplineBatch batch(surface);
  const ControlNet net = surface.Net(level);
  const Handle(Geom_BSplineSurface) occt = OcctOf(surface);
  SurfaceSamples ours;
  std::vector<Vec3> points(kCount), normals(kCount), plain(kCount);
  const auto [batch_normals, occt_normals] =
      Rates([&] { batch.PointsAndNormals(uv, 1, ours); },
            [&] {
              for (int k = 0; k < kCount; ++k) {
                gp_Pnt p;
                gp_Vec du, dv;
                occt->D1(uv[k].x(), uv[k].y(), p, du, dv);
                points[k] = Vec3(p.X(), p.Y(), p.Z());
                normals[k] =
                    Vec3(du.X(), du.Y(), du.Z()).cross(Vec3(dv.X(), dv.Y(), dv.Z())).normalized();
              }
            });
  const auto [batch_points, plain_points] = Rates([&] { ours.points = batch.Points(uv); },
                                                  [&] {
                                                    for (int k = 0; k < kCount; ++k) {
                                                      plain[k] = DeBoorPoint(net, m, n, uv[k]);
                                                    }
                                                  });
  constexpr double kSame = 1e-10;  // the peers must have been asked the same
  if (LargestComponent(ours.points, points) > kSame ||
      LargestComponent(ours.normals, normals) > kSame ||
      LargestComponent(ours.points, plain) > kSame) {
    fmt::print(stderr, "hspline_bench: the values differ by {} mm and {} (normals), {} mm\n",
               LargestComponent(ours.points, points), LargestComponent(ours.normals, normals),
               LargestComponent(ours.points, plain));
    return 1;
  }
  Print("hspline.point_normal_vs_occt", batch_normals, occt_normals, 5, "million a second");
  Print("hspline.point_vs_deboor", batch_points, plain_points, 1, "million a second");
  ProjectBoth(surface, occt);
  // A wrinkle, 1000 vertices of level 8: all that our surface holds against the vertices of the
  // dense net.
  const HSplineShape deep{.patches_u = 8, .patches_v = 8, .max_level = 8};
  HSplineSurface sparse = testing::SmoothSurface(deep, 1);
  std::map<VertexId, std::optional<Vec3>> wrinkle;
  for (int k = 0; k < 1000; ++k) {
    wrinkle[{8, 600 + k % 200, 900 + k % 200 / 3 + k / 200}] = Vec3(0, 0, 0.1);
  }
  sparse.SetOffsets(wrinkle);
  Print("hspline.memory_vs_dense", sparse.Bytes() / 1e6,
        sizeof(Vec3) * double(deep.Columns(8)) * deep.Rows(8) / 1e6, 10, "MB", true);
  return 0;
}

}  // namespace
}  // namespace semblance::problems

int main() { return semblance::problems::Main(); }
