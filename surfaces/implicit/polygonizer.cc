// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/implicit/polygonizer.h"

#include <algorithm>
#include <atomic>

#include "surfaces/base/parallel.h"
#include "surfaces/implicit/octree_march.h"

namespace semblance::surfaces {
namespace {

// Runs polygonize(field) and counts the emitters that the field evaluates.
template <class Polygonize>
PolygonizeResult CountEmitters(const ImplicitSurface& surface, const Polygonize& polygonize) {
  std::atomic<std::int64_t> emitters = 0;
  PolygonizeResult result = polygonize([&surface, &emitters](const Vec3& p) {
    std::int64_t taken = 0;
    const double value = surface.Flattened(p, taken);
    emitters.fetch_add(taken, std::memory_order_relaxed);
    return value;
  });
  result.summary.emitter_evaluations = emitters;
  return result;
}

// Appends the cells of a cube of `size` cells for which bounds do not exclude the surface.
void AppendUnproven(const ImplicitSurface& surface, const SampleGrid& grid, const GridIndex& low,
                    int size, std::vector<StartCell>& cells) {
  constexpr int kMinCubeSize = 2;  // in smaller cubes, evaluating corners costs less than bounds
  GridIndex end;
  for (int axis = 0; axis < 3; ++axis) {
    end[axis] = std::min(low[axis] + size, grid.counts[axis] - 1);
    if (low[axis] >= end[axis]) {
      return;
    }
  }
  const EmissionBounds bounds = surface.BoundsIn(Box3(grid.Corner(low), grid.Corner(end)));
  if (bounds.most < 1 || bounds.least > 1) {
    return;
  }
  if (size > kMinCubeSize) {
    for (int c = 0; c < 8; ++c) {
      const int half = size / 2;
      AppendUnproven(
          surface, grid,
          {low[0] + (c & 1) * half, low[1] + (c >> 1 & 1) * half, low[2] + (c >> 2 & 1) * half},
          half, cells);
    }
    return;
  }
  for (int k = low[2]; k < end[2]; ++k) {
    for (int j = low[1]; j < end[1]; ++j) {
      for (int i = low[0]; i < end[0]; ++i) {
        cells.push_back({grid.Index(i, j, k)});
      }
    }
  }
}

std::vector<StartCell> UnprovenCells(const ImplicitSurface& surface, const SampleGrid& grid,
                                     const RunContext& context) {
  constexpr int kCube = 16;
  std::vector<GridIndex> cubes;
  for (int k = 0; k < grid.counts[2]; k += kCube) {
    for (int j = 0; j < grid.counts[1]; j += kCube) {
      for (int i = 0; i < grid.counts[0]; i += kCube) {
        cubes.push_back({i, j, k});
      }
    }
  }
  std::vector<std::vector<StartCell>> found(cubes.size());
  ParallelFor(cubes.size(), context.threads, 4, [&](std::size_t n) {
    context.ThrowIfStopped();
    AppendUnproven(surface, grid, cubes[n], kCube, found[n]);
  });
  std::vector<StartCell> cells;
  for (const std::vector<StartCell>& some : found) {
    cells.insert(cells.end(), some.begin(), some.end());
  }
  return cells;
}

struct Polygonize {
  const ImplicitSurface& surface;
  const SampleGrid& grid;
  std::span<const StartCell> starts;
  const EdgeSearchOptions& options;
  const RunContext& context;

  PolygonizeResult operator()(const NarrowBand& band) const {
    return CountEmitters(surface, [&](const ScalarField& field) {
      return band.components == FollowedComponents::kAll
                 ? PolygonizeFrom(field, grid, UnprovenCells(surface, grid, context), options,
                                  context)
                 : PolygonizeThrough(field, grid, starts, options, context);
    });
  }
  PolygonizeResult operator()(const BruteForce&) const {
    return CountEmitters(surface, [this](const ScalarField& field) {
      return PolygonizeAll(field, grid, options, context);
    });
  }
  PolygonizeResult operator()(const McOctree& octree) const {
    return MarchOctree(octree, surface, grid, options, context);
  }
  PolygonizeResult operator()(const MinMaxOctree& octree) const {
    return MarchOctree(octree, surface, grid, options, context);
  }
};

}  // namespace

PolygonizeResult PolygonizeSurface(const Polygonizer& polygonizer, const ImplicitSurface& surface,
                                   const SampleGrid& grid, std::span<const StartCell> starts,
                                   const EdgeSearchOptions& options, const RunContext& context) {
  CheckGrid(grid);
  return std::visit(Polygonize{surface, grid, starts, options, context}, polygonizer);
}

}  // namespace semblance::surfaces
