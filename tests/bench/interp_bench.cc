// SPDX-License-Identifier: GPL-3.0-or-later
// Seconds for a depth at every vertex of a skull of 400k vertices from 32 dowels, of one thread and
// the processor's, so that other work on the machine does not count, of every scheme; how they grow
// with vertices and with dowels; and natural neighbours against CGAL's. Arguments: names of
// schemes, `growth` (of the schemes named beside it, or of all), `cgal`; none: all.
#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/surface_neighbor_coordinates_3.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <utility>

#include "interp/interpolate_depth.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

struct Scene {
  TriMesh skull;
  std::vector<Vec3> normals;
  std::vector<Dowel> dowels;
  DowelNetwork network;
};

// A sphere of 90 mm with dowels on its front, in a grid with areas between them.
Scene MakeScene(int rings, int columns, int rows) {
  Scene scene;
  scene.skull = testing::SphereMesh({0, 0, 0}, 90, rings);
  scene.normals = VertexNormals(scene.skull);
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const double x = 1.35 * (i / (columns - 1.0) - 0.5), z = 1.4 * (j / (rows - 1.0) - 0.5);
      const Vec3 out = Vec3(x, -1, z).normalized();
      scene.dowels.push_back({fmt::format("s{:04}", columns * j + i), 90 * out, out,
                              9 + 4 * std::sin(3 * x) + 3 * std::cos(4 * z), 2});
      if (i > 0 && j > 0) {
        const int d = columns * j + i, c = d - 1, b = d - columns, a = b - 1;
        scene.network.areas.push_back({a, b, d});
        scene.network.areas.push_back({a, d, c});
      }
    }
  }
  return scene;
}

struct Cost {
  double seconds = 0;
  double cpu_seconds = 0;  // what a machine without other work would show
};

Cost CostOf(const DepthScheme& scheme, const Scene& scene) {
  const std::clock_t cpu = std::clock();
  const auto start = std::chrono::steady_clock::now();
  InterpolateDepth(scheme, {scene.skull, scene.normals, scene.dowels, scene.network}, RunContext{});
  return {std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(),
          static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC};
}

// Of five, by processor time.
Cost MedianCost(const DepthScheme& scheme, const Scene& scene) {
  std::array<Cost, 5> costs;
  for (Cost& cost : costs) {
    cost = CostOf(scheme, scene);
  }
  std::ranges::sort(costs, {}, &Cost::cpu_seconds);
  return costs[costs.size() / 2];
}

std::string NameOf(const DepthScheme& scheme) {
  return std::visit([](const auto& o) { return std::string(o.kName); }, scheme);
}

double GoalSeconds(const DepthScheme& scheme) {
  return NeedsSurface(scheme) || std::holds_alternative<Kriging>(scheme) ||
                 std::holds_alternative<AutoScheme>(scheme)  // which holds kriging
             ? 5
             : 0.5;
}

void Print(const std::string& name, const std::string& values, const std::string& unit,
           const std::string& arguments) {
  fmt::print(
      "{{\"name\": \"interp.{}\", {}, \"unit\": \"{}\", \"command\": "
      "\"build/tests/bench/interp_bench {}\"}}\n",
      name, values, unit, arguments);
  std::fflush(stdout);
}

void PrintSeconds(const std::string& name, const Cost& cost, double goal,
                  const std::string& arguments) {
  Print(
      name,
      fmt::format("\"ours\": {:.3f}, \"wall\": {:.3f}, \"peer\": null, \"ratio\": null, \"goal\": "
                  "{}, \"met\": {}",
                  cost.cpu_seconds, cost.seconds, goal, cost.cpu_seconds <= goal),
      "s", arguments);
}

// Every scheme that makes depth from dowels.
template <std::size_t... Index>
std::vector<DepthScheme> Schemes(std::index_sequence<Index...>) {
  std::vector<DepthScheme> schemes = {std::variant_alternative_t<Index, DepthScheme>{}...};
  std::erase_if(schemes, [](const auto& each) {
    return std::holds_alternative<DepthMap>(each) || std::holds_alternative<ExternalScheme>(each);
  });
  return schemes;
}

// The least seconds of some runs at two sizes, 4 times apart.
struct Growth {
  double small_s = kNaN, large_s = kNaN;
  double exponent() const { return std::log(large_s / small_s) / std::log(4.0); }
};

// Runs of both sizes in turn, so that what else the machine does meets both; at least three, and
// more where one is over in a blink: the least of few runs is noise.
Growth GrowthOf(const std::function<double(const Scene&)>& seconds_of, const Scene& small,
                const Scene& large) {
  Growth growth;
  double spent = 0;
  for (int k = 0; k < 3 || (spent < 1 && k < 100); ++k) {
    const double a = seconds_of(small), b = seconds_of(large);
    growth.small_s = std::fmin(growth.small_s, a);
    growth.large_s = std::fmin(growth.large_s, b);
    spent += a + b;
  }
  return growth;
}

Growth GrowthOf(const DepthScheme& scheme, const Scene& small, const Scene& large) {
  return GrowthOf([&](const Scene& scene) { return CostOf(scheme, scene).cpu_seconds; }, small,
                  large);
}

// What no scheme can do without: every point and normal is read once, and a field is written once.
double MemorySeconds(const Scene& scene) {
  const std::clock_t start = std::clock();
  Vec3 sum = Vec3::Zero();
  for (std::size_t v = 0; v < scene.skull.points.size(); ++v) {
    sum += scene.skull.points[v] + scene.normals[v];
  }
  const std::size_t vertices = scene.skull.points.size();
  const DepthField field{std::vector<double>(vertices, sum.x()),
                         std::vector<DepthStatus>(vertices, DepthStatus::kAssigned),
                         std::vector<double>(vertices, sum.y())};
  volatile double used = field.depth_mm[vertices / 2] + field.sd_mm[vertices / 3];
  static_cast<void>(used);
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

// floor: the exponent of what memory alone costs; NaN where it is not asked.
void PrintGrowth(const std::string& name, const std::string& what, const Growth& growth,
                 double goal, double floor) {
  Print(fmt::format("{}_{}_exponent", name, what),
        fmt::format("\"ours\": {:.2f}, \"small_s\": {:.5f}, \"large_s\": {:.5f}, {}\"peer\": null, "
                    "\"ratio\": null, \"goal\": {}, \"met\": {}",
                    growth.exponent(), growth.small_s, growth.large_s,
                    std::isfinite(floor) ? fmt::format("\"memory_floor\": {:.2f}, ", floor) : "",
                    goal, growth.exponent() <= goal),
        "exponent", "growth");
}

// 100k and 400k vertices with 32 dowels; 128 and 512 dowels on 25k vertices. A sparse factor grows
// faster than its matrix, and dense equations with the cube of the dowels. What does next to
// nothing a vertex (mean) is bound by memory, which itself grows faster than with the vertices:
// 100k of them lie in nearer caches than 400k.
// Whose factor is as large as the dowels are many.
bool IsProcess(const DepthScheme& scheme) {
  return std::holds_alternative<Kriging>(scheme) || std::holds_alternative<SurfaceMatern>(scheme) ||
         std::holds_alternative<AutoScheme>(scheme);
}

void MeasureGrowth(const std::vector<DepthScheme>& schemes, const Scene& large) {
  const Scene medium = MakeScene(224, 4, 8);
  const Scene few = MakeScene(112, 8, 16), many = MakeScene(112, 16, 32);
  const double floor = GrowthOf(MemorySeconds, medium, large).exponent();
  for (const DepthScheme& scheme : schemes) {
    const std::string name = NameOf(scheme);
    PrintGrowth(name, "vertices", GrowthOf(scheme, medium, large), NeedsSurface(scheme) ? 1.4 : 1.2,
                floor);
    PrintGrowth(name, "dowels", GrowthOf(scheme, few, many), IsProcess(scheme) ? 3 : 2, kNaN);
  }
}

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Delaunay = CGAL::Delaunay_triangulation_3<Kernel>;

// CGAL's natural neighbours of every vertex of the scene; NaN where it has none.
std::vector<double> DepthByCgal(const Scene& scene) {
  Delaunay delaunay;
  std::map<Point, double> depth_mm;
  for (const Dowel& dowel : scene.dowels) {
    const Point base(dowel.base.x(), dowel.base.y(), dowel.base.z());
    delaunay.insert(base);
    depth_mm[base] = dowel.depth_mm;
  }
  std::vector<double> depths;
  std::vector<std::pair<Point, Kernel::FT>> weights;
  for (std::size_t v = 0; v < scene.skull.points.size(); ++v) {
    const Vec3 &p = scene.skull.points[v], &n = scene.normals[v];
    weights.clear();
    const auto result = CGAL::surface_neighbor_coordinates_3(delaunay, Point(p.x(), p.y(), p.z()),
                                                             Kernel::Vector_3(n.x(), n.y(), n.z()),
                                                             std::back_inserter(weights));
    double sum = 0;
    for (const auto& [base, weight] : weights) {
      sum += weight / result.second * depth_mm.at(base);
    }
    depths.push_back(result.third && !weights.empty() ? sum : kNaN);
  }
  return depths;
}

// What of the scene lies well between the dowels, at their four inner columns and rows.
Scene BetweenDowels(Scene scene) {
  std::vector<Vec3> points, normals;
  for (std::size_t v = 0; v < scene.skull.points.size(); ++v) {
    const Vec3 p = scene.skull.points[v] / -scene.skull.points[v].y();
    if (scene.skull.points[v].y() < 0 && std::abs(p.x()) < 0.5 && std::abs(p.z()) < 0.5) {
      points.push_back(scene.skull.points[v]);
      normals.push_back(scene.normals[v]);
    }
  }
  scene.skull = {std::move(points), {}};
  scene.normals = std::move(normals);
  return scene;
}

void MeasureAgainstCgal() {
  const Scene scene = BetweenDowels(MakeScene(200, 6, 8));
  std::vector<double> ours_s, theirs_s, theirs;
  DepthField field;
  for (int k = 0; k < 5; ++k) {
    const std::clock_t start = std::clock();
    field = InterpolateDepth(NaturalNeighbour{},
                             {scene.skull, scene.normals, scene.dowels, scene.network}, {});
    const std::clock_t middle = std::clock();
    theirs = DepthByCgal(scene);
    ours_s.push_back(static_cast<double>(middle - start) / CLOCKS_PER_SEC);
    theirs_s.push_back(static_cast<double>(std::clock() - middle) / CLOCKS_PER_SEC);
  }
  std::ranges::sort(ours_s);
  std::ranges::sort(theirs_s);
  double furthest = 0;
  std::size_t both = 0;
  for (std::size_t v = 0; v < theirs.size(); ++v) {
    if (std::isfinite(theirs[v]) && std::isfinite(field.depth_mm[v])) {
      ++both;
      furthest = std::max(furthest, std::abs(theirs[v] - field.depth_mm[v]));
    }
  }
  Print("natural_neighbour_vs_cgal",
        fmt::format("\"ours\": {:.4f}, \"peer\": {:.4f}, \"ratio\": {:.1f}, \"goal\": 1, \"met\": "
                    "{}, \"vertices\": {}",
                    ours_s[2], theirs_s[2], theirs_s[2] / ours_s[2], ours_s[2] <= theirs_s[2],
                    theirs.size()),
        "s", "cgal");
  Print("natural_neighbour_off_cgal",
        fmt::format("\"ours\": {:.2e}, \"peer\": null, \"ratio\": null, \"goal\": 1e-6, \"met\": "
                    "{}, \"vertices\": {}",
                    furthest, furthest <= 1e-6 && both > theirs.size() / 2, both),
        "mm", "cgal");
}

void MeasureAll(std::span<char*> names) {
  const auto wanted = [&](const std::string& name) {
    return names.empty() ||
           std::ranges::find(names, name, [](char* n) { return std::string(n); }) != names.end();
  };
  const Scene scene = MakeScene(448, 4, 8);  // 400 514 vertices
  const std::vector<DepthScheme> schemes =
      Schemes(std::make_index_sequence<std::variant_size_v<DepthScheme>>{});
  for (const DepthScheme& scheme : schemes) {
    const std::string name = NameOf(scheme);
    if (wanted(name)) {
      PrintSeconds(fmt::format("{}_400k_seconds", name), MedianCost(scheme, scene),
                   GoalSeconds(scheme), name);
    }
  }
  if (wanted("kriging")) {
    Scene one = scene;
    one.skull = {{scene.skull.points[0]}, {}};
    one.normals.resize(1);
    PrintSeconds("kriging_fit_seconds", MedianCost(Kriging{}, one), 5, "kriging");
  }
  if (wanted("growth")) {  // with names: of these schemes alone
    std::vector<DepthScheme> asked = schemes;
    if (names.size() > 1) {
      std::erase_if(asked, [&](const DepthScheme& scheme) { return !wanted(NameOf(scheme)); });
    }
    MeasureGrowth(asked, scene);
  }
  if (wanted("cgal")) {
    MeasureAgainstCgal();
  }
}

}  // namespace
}  // namespace semblance::problems

int main(int count, char** arguments) {
  semblance::problems::MeasureAll({arguments + 1, static_cast<std::size_t>(count - 1)});
}
