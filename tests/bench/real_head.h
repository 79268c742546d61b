// SPDX-License-Identifier: GPL-3.0-or-later
// A real skull for the benches, where its mesh is beside the project.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <optional>
#include <string>

#include "surfaces/decimate/decimate.h"
#include "surfaces/mesh/skull_fill.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "tests/bench/phantom_head.h"

namespace semblance::bench {
using namespace problems;

// The filled shell; none, and a line that says what is skipped, without the mesh.
inline std::optional<TriMesh> RealShell(const std::string& skipped) {
  const std::filesystem::path skull = SEMBLANCE_SOURCE_DIR "/../shared/data/cranium/skull.ply";
  if (!std::filesystem::exists(skull)) {
    fmt::print(stderr, "no {}: {} is skipped\n", skull.string(), skipped);
    return std::nullopt;
  }
  return FillSkull(ReadMesh(skull), WrapFill{.edge_mm = 1}, {});
}

// The shell with that many triangles, and smooth depths of 4 to 10 mm.
inline Head RealHead(const TriMesh& shell, int triangles) {
  Head head{Decimate(shell, {.target_triangles = triangles}).mesh, {}};
  for (const Vec3& p : head.skull.points) {
    head.depth_mm.push_back(7 + 3 * std::sin(0.03 * p.x()) * std::cos(0.04 * p.z()));
  }
  return head;
}

}  // namespace semblance::bench
