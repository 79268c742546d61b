// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/polygonize.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "surfaces/corner_blocks.h"
#include "surfaces/crossings.h"
#include "surfaces/error.h"
#include "surfaces/parallel.h"
#include "surfaces/slab_march.h"

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

// Corners of a cell on its lower or upper face across an axis, as a mask.
int FaceMask(int axis, int upper) {
  int mask = 0;
  for (int c = 0; c < 8; ++c) {
    mask |= ((c >> axis & 1) == upper) << c;
  }
  return mask;
}

// Goes on from crossed cells to their neighbours, wave by wave, until no new cell is crossed.
class Continuation {
 public:
  Continuation(const ScalarField& field, const SampleGrid& grid, const RunContext& context)
      : field_(field), grid_(grid), context_(context), corners_(grid) {}

  Crossings Run(std::span<const std::int64_t> seeds) {
    std::vector<std::int64_t> wave;
    for (const std::int64_t cell : seeds) {
      Visit(grid_.At(cell), wave);
    }
    while (!wave.empty()) {
      context_.ThrowIfStopped();
      context_.Report("polygonize");
      Evaluate(UnknownCorners(wave));
      wave = Cross(wave);
    }
    std::sort(crossings_.cells.begin(), crossings_.cells.end(),
              [](const CrossedCell& a, const CrossedCell& b) { return a.index < b.index; });
    AppendEdges();
    return std::move(crossings_);
  }

 private:
  void Visit(const std::array<int, 3>& cell, std::vector<std::int64_t>& wave) {
    if (IsCell(grid_, cell) && corners_.FirstVisit(cell)) {
      wave.push_back(grid_.Index(cell[0], cell[1], cell[2]));
    }
  }
  std::vector<std::int64_t> UnknownCorners(const std::vector<std::int64_t>& wave) {
    std::vector<std::int64_t> unknown;
    for (const std::int64_t cell : wave) {
      const std::array<int, 3> at = grid_.At(cell);
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
  int MaskOf(const std::array<int, 3>& cell) const {
    int mask = 0;
    for (int c = 0; c < 8; ++c) {
      mask |= (corners_.Get(CornerOf(cell, c)) > 0) << c;
    }
    return mask;
  }
  std::vector<std::int64_t> Cross(const std::vector<std::int64_t>& wave) {
    std::vector<std::int64_t> next;
    for (const std::int64_t cell : wave) {
      const std::array<int, 3> at = grid_.At(cell);
      const int mask = MaskOf(at);
      if (mask == 0 || mask == 255) {
        continue;
      }
      crossings_.cells.push_back({cell, static_cast<std::uint8_t>(mask)});
      for (int axis = 0; axis < 3; ++axis) {
        for (int upper = 0; upper < 2; ++upper) {
          const int face = FaceMask(axis, upper);
          if ((mask & face) != 0 && (mask & face) != face) {
            std::array<int, 3> neighbour = at;
            neighbour[axis] += upper ? 1 : -1;
            Visit(neighbour, next);
          }
        }
      }
    }
    return next;
  }
  void AppendEdges() {
    for (const CrossedCell& cell : crossings_.cells) {
      const std::array<int, 3> at = grid_.At(cell.index);
      ForEachOwnEdge(grid_, at, cell.mask, [&](const CellEdge& edge) {
        crossings_.edges.push_back({EdgeId(grid_, at, edge), corners_.Get(CornerOf(at, edge.from)),
                                    corners_.Get(CornerOf(at, edge.to))});
      });
    }
  }

  const ScalarField& field_;
  const SampleGrid& grid_;
  const RunContext& context_;
  CornerBlocks corners_;
  Crossings crossings_;
};

void SearchCrossings(const ScalarField& field, const SampleGrid& grid,
                     const EdgeSearchOptions& options, const RunContext& context,
                     Crossings& crossings) {
  std::vector<std::int64_t> counts(crossings.edges.size(), 0);
  ParallelFor(crossings.edges.size(), context.threads, 64, [&](std::size_t n) {
    CrossedEdge& edge = crossings.edges[n];
    if (std::isfinite(edge.at)) {
      return;
    }
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
  SearchCrossings(field, grid, options, context, crossings);
  return MeshOf(grid, std::move(crossings));
}

PolygonizeResult PolygonizeFrom(const ScalarField& field, const SampleGrid& grid,
                                std::span<const std::int64_t> seed_cells,
                                const EdgeSearchOptions& options, const RunContext& context) {
  CheckGrid(grid);
  Crossings crossings = Continuation(field, grid, context).Run(seed_cells);
  SearchCrossings(field, grid, options, context, crossings);
  return MeshOf(grid, std::move(crossings));
}

PolygonizeResult PolygonizeLargestFrom(const ScalarField& field, const SampleGrid& grid,
                                       std::span<const std::int64_t> seed_cells,
                                       const EdgeSearchOptions& options,
                                       const RunContext& context) {
  CheckGrid(grid);
  Crossings crossings = Continuation(field, grid, context).Run(seed_cells);
  const std::vector<bool> may_be_largest = EdgesOfLargest(grid, crossings);
  for (std::size_t n = 0; n < crossings.edges.size(); ++n) {
    crossings.edges[n].at = may_be_largest[n] ? kNaN : 0.5;
  }
  SearchCrossings(field, grid, options, context, crossings);
  return MeshOf(grid, std::move(crossings));
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
