// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/marching/polygonize.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <utility>

#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"
#include "surfaces/marching/corner_blocks.h"
#include "surfaces/marching/crossings.h"
#include "surfaces/marching/slab_march.h"

namespace semblance {
void CheckGrid(const SampleGrid& grid) {
  const bool sized =
      std::all_of(grid.counts.begin(), grid.counts.end(), [](int n) { return n >= 2; });
  if (!sized || !grid.origin.allFinite() || !(grid.cell_mm.minCoeff() > 0)) {
    throw InputError(
        fmt::format("polygonize: a grid of {} corners is not usable; it needs a finite origin, "
                    "positive cells and 2 corners each way",
                    fmt::join(grid.counts, " x ")));
  }
}

namespace {

std::array<int, 3> CornerOf(const std::array<int, 3>& cell, int c) {
  return {cell[0] + (c & 1), cell[1] + (c >> 1 & 1), cell[2] + (c >> 2 & 1)};
}

bool IsCell(const SampleGrid& grid, const std::array<int, 3>& cell) {
  return cell[0] >= 0 && cell[1] >= 0 && cell[2] >= 0 && cell[0] + 1 < grid.counts[0] &&
         cell[1] + 1 < grid.counts[1] && cell[2] + 1 < grid.counts[2];
}

// The edges of a cell that lie on one of its faces, and what the cell beyond it calls them: each
// moves there along the axis.
struct FaceEdges {
  EdgeBits on = 0;
  std::array<std::uint8_t, 12> beyond{};
};

FaceEdges EdgesOfFace(int axis, int upper) {
  FaceEdges face;
  for (int e = 0; e < 12; ++e) {
    const CellEdge& edge = kCellEdges[e];
    if (edge.axis != axis && (edge.from >> axis & 1) == upper) {
      face.on |= EdgeBits(1 << e);
      face.beyond[e] = static_cast<std::uint8_t>(EdgeFrom(edge.from ^ (1 << axis), edge.axis));
    }
  }
  return face;
}

// [2 axis + upper]
std::array<FaceEdges, 6> AllFaces() {
  std::array<FaceEdges, 6> faces;
  for (int f = 0; f < 6; ++f) {
    faces[f] = EdgesOfFace(f / 2, f % 2);
  }
  return faces;
}

// Goes on from crossed cells to their neighbours, wave by wave, along what hangs together: of two
// sheets in one cell only that which it came along. In `edges`, what a cell is known to have of
// that.
class Continuation {
 public:
  Continuation(const ScalarField& field, const SampleGrid& grid, const RunContext& context)
      : field_(field), grid_(grid), context_(context), corners_(grid), faces_(AllFaces()) {}

  void Follow(std::span<const SeedCell> seeds) {
    for (const SeedCell& seed : seeds) {
      Visit(grid_.At(seed.cell), seed.edges);
    }
    while (!next_.empty()) {
      context_.ThrowIfStopped();
      context_.Report("polygonize");
      const std::vector<SeedCell> wave = std::exchange(next_, {});
      Evaluate(UnknownCorners());
      for (; known_cells_ < cells_.size(); ++known_cells_) {
        SetMask(grid_.At(cells_[known_cells_]));
      }
      for (const SeedCell& cell : wave) {
        Cross(cell);
      }
    }
  }
  bool Reached(const SeedCell& seed) {
    return (seed.edges & ~corners_.CellAt(grid_.At(seed.cell)).edges) == 0;
  }
  // From now on all sheets in a cell count as one.
  void TakeWholeCells() {
    whole_cells_ = true;
    for (const std::int64_t cell : std::vector(cells_)) {
      Visit(grid_.At(cell), kAllEdges);
    }
  }
  // The cells in ascending order, and their edges.
  Crossings Take() {
    std::sort(cells_.begin(), cells_.end());
    for (const std::int64_t cell : cells_) {
      Record(cell);
    }
    return std::move(crossings_);
  }

 private:
  void Visit(const std::array<int, 3>& cell, EdgeBits edges) {
    if (!IsCell(grid_, cell)) {
      return;
    }
    EdgeBits& known = corners_.CellAt(cell).edges;
    const EdgeBits fresh = edges & ~known;
    if (fresh != 0) {
      const std::int64_t index = grid_.Index(cell[0], cell[1], cell[2]);
      if (known == 0) {
        cells_.push_back(index);
      }
      known |= fresh;
      next_.push_back({index, fresh});
    }
  }
  // Of the cells that are new.
  std::vector<std::int64_t> UnknownCorners() {
    std::vector<std::int64_t> unknown;
    for (std::size_t n = known_cells_; n < cells_.size(); ++n) {
      const std::array<int, 3> at = grid_.At(cells_[n]);
      for (int c = 0; c < 8; ++c) {
        const std::array<int, 3> corner = CornerOf(at, c);
        if (corners_.FirstAsked(corner)) {
          unknown.push_back(grid_.Index(corner[0], corner[1], corner[2]));
        }
      }
    }
    return unknown;
  }
  void Evaluate(const std::vector<std::int64_t>& unknown) {
    ParallelFor(unknown.size(), context_.threads, 8, [&](std::size_t n) {
      const std::array<int, 3> at = grid_.At(unknown[n]);
      corners_.Set(at, field_(grid_.Corner(at[0], at[1], at[2])));
    });
    crossings_.summary.corner_evaluations += static_cast<std::int64_t>(unknown.size());
  }
  void SetMask(const std::array<int, 3>& cell) {
    std::uint8_t mask = 0;
    for (int c = 0; c < 8; ++c) {
      mask |= static_cast<std::uint8_t>((corners_.Get(CornerOf(cell, c)) > 0) << c);
    }
    corners_.CellAt(cell).mask = mask;
  }
  void Cross(const SeedCell& cell) {
    const std::array<int, 3> at = grid_.At(cell.cell);
    CornerBlocks::Cell& kept = corners_.CellAt(at);
    const auto& joined = loops_[kept.mask];
    EdgeBits crossed = 0;
    for (EdgeBits rest = cell.edges; rest != 0; rest &= EdgeBits(rest - 1)) {
      crossed |= joined[std::countr_zero(rest)];
    }
    kept.edges |= crossed;
    for (int f = 0; f < 6; ++f) {
      EdgeBits beyond = 0;
      for (EdgeBits on = crossed & faces_[f].on; on != 0; on &= EdgeBits(on - 1)) {
        beyond |= EdgeBits(1 << faces_[f].beyond[std::countr_zero(on)]);
      }
      if (beyond != 0) {
        std::array<int, 3> neighbour = at;
        neighbour[f / 2] += f % 2 != 0 ? 1 : -1;
        Visit(neighbour, whole_cells_ ? kAllEdges : beyond);
      }
    }
  }
  void Record(std::int64_t cell) {
    const std::array<int, 3> at = grid_.At(cell);
    const CornerBlocks::Cell& kept = corners_.CellAt(at);
    if (kept.mask == 0 || kept.mask == 255) {
      return;
    }
    crossings_.cells.push_back({cell, kept.mask, kept.edges});
    ForEachOwnEdge(grid_, crossings_.cells.back(), [&](const CellEdge& edge) {
      crossings_.edges.push_back({EdgeId(grid_, at, edge), corners_.Get(CornerOf(at, edge.from)),
                                  corners_.Get(CornerOf(at, edge.to))});
    });
  }

  const ScalarField& field_;
  const SampleGrid& grid_;
  const RunContext& context_;
  CornerBlocks corners_;
  std::array<FaceEdges, 6> faces_;
  const std::array<std::array<EdgeBits, 12>, 256>& loops_ = MarchingCubesLoops();
  bool whole_cells_ = false;
  std::vector<std::int64_t> cells_;  // that were visited
  std::size_t known_cells_ = 0;      // of these, whose corners are known
  std::vector<SeedCell> next_;       // wave
  Crossings crossings_;
};

PolygonizeResult Searched(const ScalarField& field, const SampleGrid& grid,
                          const EdgeSearchOptions& options, const RunContext& context,
                          Crossings crossings) {
  std::vector<std::int64_t> counts(crossings.edges.size(), 0);
  ParallelFor(crossings.edges.size(), context.threads, 64, [&](std::size_t n) {
    CrossedEdge& edge = crossings.edges[n];
    const std::array<int, 3> low = grid.At(edge.id / 3);
    std::array<int, 3> high = low;
    ++high[edge.id % 3];
    const Vec3 a = grid.Corner(low[0], low[1], low[2]),
               along = grid.Corner(high[0], high[1], high[2]) - a;
    edge.at = SearchCrossing(
        edge.from, edge.to, options, [&](double t) { return field(a + t * along); }, counts[n]);
  });
  crossings.summary.edge_evaluations =
      std::accumulate(counts.begin(), counts.end(), std::int64_t{0});
  return MeshOf(grid, std::move(crossings));
}

// Marches through all cells; layer(k, values) gives the values of the k-th layer of corners.
template <class GiveLayer>
Crossings MarchAll(const SampleGrid& grid, const RunContext& context, const GiveLayer& layer) {
  SlabMarch march(grid);
  layer(0, march.UpperLayer());
  for (int k = 0; k + 1 < grid.counts[2]; ++k) {
    context.ThrowIfStopped();
    context.Report("polygonize", {}, static_cast<double>(k) / grid.counts[2]);
    march.GoUp();
    layer(k + 1, march.UpperLayer());
    for (int j = 0; j + 1 < grid.counts[1]; ++j) {
      for (int i = 0; i + 1 < grid.counts[0]; ++i) {
        march.Cell(i, j);
      }
    }
  }
  return march.Take();
}

}  // namespace

PolygonizeResult PolygonizeAll(const ScalarField& field, const SampleGrid& grid,
                               const EdgeSearchOptions& options, const RunContext& context) {
  CheckGrid(grid);
  Crossings crossings = MarchAll(grid, context, [&](int k, std::span<double> values) {
    ParallelFor(values.size(), context.threads, 64, [&](std::size_t n) {
      const auto column = static_cast<int>(n);
      values[n] = field(grid.Corner(column % grid.counts[0], column / grid.counts[0], k));
    });
  });
  crossings.summary.corner_evaluations = grid.CornerCount();
  return Searched(field, grid, options, context, std::move(crossings));
}

PolygonizeResult PolygonizeFrom(const ScalarField& field, const SampleGrid& grid,
                                std::span<const SeedCell> seeds, const EdgeSearchOptions& options,
                                const RunContext& context) {
  CheckGrid(grid);
  Continuation continuation(field, grid, context);
  continuation.Follow(seeds);
  return Searched(field, grid, options, context, continuation.Take());
}

PolygonizeResult PolygonizeThrough(const ScalarField& field, const SampleGrid& grid,
                                   std::span<const SeedCell> seeds,
                                   const EdgeSearchOptions& options, const RunContext& context) {
  CheckGrid(grid);
  Continuation continuation(field, grid, context);
  continuation.Follow(seeds.first(std::min<std::size_t>(1, seeds.size())));
  const auto reached = [&](const SeedCell& seed) { return continuation.Reached(seed); };
  if (!std::all_of(seeds.begin(), seeds.end(), reached)) {
    continuation.TakeWholeCells();
    continuation.Follow(seeds);
  }
  return Searched(field, grid, options, context, continuation.Take());
}

PolygonizeResult PolygonizeSamples(std::span<const float> samples, const SampleGrid& grid,
                                   const RunContext& context) {
  CheckGrid(grid);
  if (static_cast<std::int64_t>(samples.size()) != grid.CornerCount()) {
    throw InputError(fmt::format("polygonize: {} samples do not fit a grid of {} corners",
                                 samples.size(), grid.CornerCount()));
  }
  Crossings crossings = MarchAll(grid, context, [&](int k, std::span<double> values) {
    const auto layer = samples.subspan(k * values.size(), values.size());
    std::copy(layer.begin(), layer.end(), values.begin());
  });
  for (CrossedEdge& edge : crossings.edges) {
    edge.at = edge.from / (edge.from - edge.to);
  }
  return MeshOf(grid, std::move(crossings));
}

}  // namespace semblance
