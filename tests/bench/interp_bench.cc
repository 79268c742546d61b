// SPDX-License-Identifier: GPL-3.0-or-later
// Seconds for a depth at every vertex of a skull of 400k vertices from 32 dowels, on one thread, of
// every scheme. Arguments: names of schemes; none: all.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <span>
#include <string>
#include <utility>

#include "interp/depth_scheme.h"
#include "tests/testing/shapes.h"

namespace semblance {
namespace {

struct Scene {
  TriMesh skull;
  std::vector<Vec3> normals;
  std::vector<Dowel> dowels;
  DowelNetwork network;
};

// A sphere of 90 mm with 32 dowels on its front, in a grid of 4 x 8 with areas between them.
Scene BigScene(int rings) {
  Scene scene;
  scene.skull = testing::SphereMesh({0, 0, 0}, 90, rings);
  scene.normals = VertexNormals(scene.skull);
  for (int j = 0; j < 8; ++j) {
    for (int i = 0; i < 4; ++i) {
      const double x = 0.45 * (i - 1.5), z = 0.2 * (j - 3.5);
      const Vec3 out = Vec3(x, -1, z).normalized();
      scene.dowels.push_back({fmt::format("s{:02}", 4 * j + i), 90 * out, out,
                              9 + 4 * std::sin(3 * x) + 3 * std::cos(4 * z), 2});
      if (i > 0 && j > 0) {
        const int d = 4 * j + i, c = d - 1, b = d - 4, a = b - 1;
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

double GoalSeconds(const DepthScheme& scheme) {
  return NeedsSurface(scheme) || std::holds_alternative<Kriging>(scheme) ? 5 : 0.5;
}

void Measure(const DepthScheme& scheme, const Scene& scene, std::span<char*> names) {
  const std::string name = std::visit([](const auto& o) { return std::string(o.kName); }, scheme);
  if (!names.empty() &&
      std::ranges::find(names, name, [](char* n) { return std::string(n); }) == names.end()) {
    return;
  }
  const Cost cost = CostOf(scheme, scene);
  const double goal = GoalSeconds(scheme);
  fmt::print(
      "{{\"name\": \"interp.{}_400k_seconds\", \"ours\": {:.3f}, \"cpu\": {:.3f}, \"peer\": null, "
      "\"ratio\": null, \"goal\": {}, \"met\": {}, \"unit\": \"s\", \"command\": "
      "\"build/tests/bench/interp_bench {}\"}}\n",
      name, cost.seconds, cost.cpu_seconds, goal, cost.seconds <= goal, name);
  std::fflush(stdout);
}

template <std::size_t... Index>
void MeasureAll(const Scene& scene, std::span<char*> names, std::index_sequence<Index...>) {
  (Measure(std::variant_alternative_t<Index, DepthScheme>{}, scene, names), ...);
}

}  // namespace
}  // namespace semblance

int main(int count, char** arguments) {
  using semblance::DepthScheme;
  const semblance::Scene scene = semblance::BigScene(448);  // 400 514 vertices
  semblance::MeasureAll(scene, {arguments + 1, static_cast<std::size_t>(count - 1)},
                        std::make_index_sequence<std::variant_size_v<DepthScheme>>{});
}
