// SPDX-License-Identifier: GPL-3.0-or-later
// Scenes for tests of depth schemes: a skull with dowels and their network.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "interp/dowels/depth_input.h"
#include "surfaces/base/random.h"
#include "tests/testing/shapes.h"

namespace semblance::testing {
using namespace problems;

struct DowelScene {
  TriMesh skull;
  std::vector<Vec3> normals;
  std::vector<Dowel> dowels;
  DowelNetwork network;

  DepthInput Input() const { return {skull, normals, dowels, network}; }
  // The same dowels with these points as the skull's vertices, all with the normal `normal`.
  DowelScene At(std::vector<Vec3> points, const Vec3& normal = Vec3(0, 0, 1)) const {
    DowelScene scene = *this;
    scene.normals.assign(points.size(), normal);
    scene.skull = {std::move(points), {}};
    return scene;
  }
};

// Four dowels around the square [5,35]^2 in the plane z = 0, two areas along its diagonal, all
// directions up, over a plate of 40 mm.
inline DowelScene FlatScene() {
  DowelScene scene;
  scene.skull = Plate(40, 20);
  scene.normals = VertexNormals(scene.skull);
  const Vec3 up(0, 0, 1);
  scene.dowels = {{"sg", {5, 5, 0}, up, 4, 1},
                  {"g", {35, 5, 0}, up, 7, 2},
                  {"n", {35, 35, 0}, up, 9, 3},
                  {"rhi", {5, 35, 0}, up, 5, 1.5}};
  scene.network.areas = {{0, 1, 2}, {0, 2, 3}};
  return scene;
}

// Five dowels on the front (-y) of a sphere of 90 mm, within some degrees of its radii, in four
// areas around "n".
inline DowelScene DomeScene() {
  DowelScene scene;
  scene.skull = SphereMesh({0, 0, 0}, 90, 40);
  scene.normals = VertexNormals(scene.skull);
  const auto add = [&](const char* site, double x, double z, double depth, const Vec3& tilt) {
    const Vec3 base(x, -std::sqrt(90 * 90 - x * x - z * z), z);
    scene.dowels.push_back({site, base, (base / 90 + tilt).normalized(), depth, depth / 4});
  };
  add("sg", 2, 60, 4.5, {0.1, 0, 0});
  add("mso_l", 42, 28, 8.5, {0, 0.1, -0.1});
  add("mso_r", -40, 30, 8, {-0.1, 0, 0.05});
  add("n", 0, 10, 6, {0, 0, 0});
  add("me", 1, -50, 11, {0.05, 0, 0.1});
  scene.network.areas = {{0, 2, 3}, {0, 3, 1}, {3, 2, 4}, {3, 4, 1}};
  return scene;
}

// `count` dowels at vertices of the front half of a sphere of 90 mm, in no network.
inline DowelScene ScatteredScene(int count) {
  DowelScene scene;
  scene.skull = SphereMesh({0, 0, 0}, 90, 40);
  scene.normals = VertexNormals(scene.skull);
  std::vector<std::size_t> front;
  for (std::size_t i = 0; i < scene.skull.points.size(); ++i) {
    if (scene.skull.points[i].y() < -5) {
      front.push_back(i);
    }
  }
  Random random(7);
  for (int k = 0; k < count; ++k) {
    const std::size_t vertex = front[front.size() * k / count];
    const Vec3& base = scene.skull.points[vertex];
    const double depth = 10 + base.z() / 20 + std::sin(base.x() / 20) + random.Uniform(-0.5, 0.5);
    scene.dowels.push_back({std::to_string(100000 + k), base, base / 90, depth, kNaN});
  }
  return scene;
}

// The whole scene, moved by a rotation and a translation.
inline DowelScene Moved(DowelScene scene, const Similarity& to_from) {
  scene.skull = Transformed(scene.skull, to_from);
  for (Vec3& normal : scene.normals) {
    normal = to_from.rotation * normal;
  }
  for (Dowel& dowel : scene.dowels) {
    dowel.base = to_from * dowel.base;
    dowel.direction = to_from.rotation * dowel.direction;
  }
  return scene;
}

inline RunContext OnThreads(int threads) {
  RunContext run;
  run.threads = threads;
  return run;
}

template <class T>
bool SameBytes(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}
inline bool SameBytes(const DepthField& a, const DepthField& b) {
  return SameBytes(a.depth_mm, b.depth_mm) && SameBytes(a.status, b.status) &&
         SameBytes(a.sd_mm, b.sd_mm);
}

inline int Count(const DepthField& field, DepthStatus status) {
  return static_cast<int>(std::ranges::count(field.status, status));
}

}  // namespace semblance::testing
