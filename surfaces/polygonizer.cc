// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/polygonizer.h"

#include <atomic>

#include "surfaces/octree_march.h"

namespace semblance {
namespace {

// Runs polygonize(field) and adds how many emitters the field took.
template <class Polygonize>
PolygonizeResult Counted(const ImplicitSurface& surface, const Polygonize& polygonize) {
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

struct Polygonize {
  const ImplicitSurface& surface;
  const SampleGrid& grid;
  std::span<const std::int64_t> seed_cells;
  const EdgeSearchOptions& options;
  const RunContext& context;

  PolygonizeResult operator()(const NarrowBand&) const {
    return Counted(surface, [this](const ScalarField& field) {
      return PolygonizeFrom(field, grid, seed_cells, options, context);
    });
  }
  PolygonizeResult operator()(const BruteForce&) const {
    return Counted(surface, [this](const ScalarField& field) {
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
                                   const SampleGrid& grid, std::span<const std::int64_t> seed_cells,
                                   const EdgeSearchOptions& options, const RunContext& context) {
  CheckGrid(grid);
  return std::visit(Polygonize{surface, grid, seed_cells, options, context}, polygonizer);
}

}  // namespace semblance
