// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/marching/polygonize.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"
#include "surfaces/marching/edge_intersections.h"
#include "surfaces/marching/slice_marching_cubes.h"
#include "surfaces/marching/sparse_grid.h"

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

GridIndex CornerOf(const GridIndex& cell, int c) {
  return {cell[0] + (c & 1), cell[1] + (c >> 1 & 1), cell[2] + (c >> 2 & 1)};
}

bool IsCell(const SampleGrid& grid, const GridIndex& cell) {
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

// Goes on from crossed cells to their neighbours, wave by wave, along one component: of two sheets
// in a cell only the one it came along. A cell's `edges` are those known to belong to the
// component.
class Continuation {
 public:
  Continuation(const ScalarField& field, const SampleGrid& grid, const RunContext& context)
      : field_(field), grid_(grid), context_(context), corners_(grid), faces_(AllFaces()) {}

  void Follow(std::span<const StartCell> starts) {
    for (const StartCell& start : starts) {
      Visit(grid_.At(start.cell), start.edges);
    }
    while (!next_.empty()) {
      context_.ThrowIfStopped();
      context_.Report("polygonize");
      const std::vector<StartCell> wave = std::exchange(next_, {});
      Evaluate(UnknownCorners());
      for (; known_cells_ < cells_.size(); ++known_cells_) {
        SetMask(grid_.At(cells_[known_cells_]));
      }
      for (const StartCell& cell : wave) {
        Cross(cell);
      }
    }
  }
  bool Reached(const StartCell& start) {
    return (start.edges & ~corners_.CellAt(grid_.At(start.cell)).edges) == 0;
  }
  // From now on all sheets in a cell count as one.
  void TakeWholeCells() {
    whole_cells_ = true;
    for (const std::int64_t cell : std::vector(cells_)) {
      Visit(grid_.At(cell), kAllEdges);
    }
  }
  // The cells in ascending order, and their edges.
  EdgeIntersections Take() {
    std::sort(cells_.begin(), cells_.end());
    for (const std::int64_t cell : cells_) {
      Record(cell);
    }
    return std::move(intersections_);
  }

 private:
  void Visit(const GridIndex& cell, EdgeBits edges) {
    if (!IsCell(grid_, cell)) {
      return;
    }
    EdgeBits& known = corners_.CellAt(cell).edges;
    const EdgeBits fresh = edges & ~known;
    if (fresh != 0) {
      const std::int64_t index = grid_.Index(cell);
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
      const GridIndex at = grid_.At(cells_[n]);
      for (int c = 0; c < 8; ++c) {
        const GridIndex corner = CornerOf(at, c);
        if (corners_.FirstAsked(corner)) {
          unknown.push_back(grid_.Index(corner));
        }
      }
    }
    return unknown;
  }
  void Evaluate(const std::vector<std::int64_t>& unknown) {
    ParallelFor(unknown.size(), context_.threads, 8, [&](std::size_t n) {
      const GridIndex at = grid_.At(unknown[n]);
      corners_.Set(at, field_(grid_.Corner(at)));
    });
    intersections_.summary.corner_evaluations += static_cast<std::int64_t>(unknown.size());
  }
  void SetMask(const GridIndex& cell) {
    std::uint8_t mask = 0;
    for (int c = 0; c < 8; ++c) {
      mask |= static_cast<std::uint8_t>((corners_.Get(CornerOf(cell, c)) > 0) << c);
    }
    corners_.CellAt(cell).mask = mask;
  }
  void Cross(const StartCell& cell) {
    const GridIndex at = grid_.At(cell.cell);
    SparseGrid::CellRecord& kept = corners_.CellAt(at);
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
        GridIndex neighbour = at;
        neighbour[f / 2] += f % 2 != 0 ? 1 : -1;
        Visit(neighbour, whole_cells_ ? kAllEdges : beyond);
      }
    }
  }
  void Record(std::int64_t cell) {
    const GridIndex at = grid_.At(cell);
    const SparseGrid::CellRecord& kept = corners_.CellAt(at);
    if (kept.mask == 0 || kept.mask == 255) {
      return;
    }
    intersections_.cells.push_back({cell, kept.mask, kept.edges});
    ForEachOwnEdge(grid_, intersections_.cells.back(), [&](const CellEdge& edge) {
      intersections_.edges.push_back({EdgeId(grid_, at, edge),
                                      corners_.Get(CornerOf(at, edge.from)),
                                      corners_.Get(CornerOf(at, edge.to))});
    });
  }

  const ScalarField& field_;
  const SampleGrid& grid_;
  const RunContext& context_;
  SparseGrid corners_;
  std::array<FaceEdges, 6> faces_;
  const std::array<std::array<EdgeBits, 12>, 256>& loops_ = MarchingCubesLoops();
  bool whole_cells_ = false;
  std::vector<std::int64_t> cells_;  // that were visited
  std::size_t known_cells_ = 0;      // of these, whose corners are known
  std::vector<StartCell> next_;      // wave
  EdgeIntersections intersections_;
};

PolygonizeResult Searched(const ScalarField& field, const SampleGrid& grid,
                          const EdgeSearchOptions& options, const RunContext& context,
                          EdgeIntersections intersections) {
  std::vector<std::int64_t> counts(intersections.edges.size(), 0);
  ParallelFor(intersections.edges.size(), context.threads, 64, [&](std::size_t n) {
    CrossedEdge& edge = intersections.edges[n];
    const EdgeLine line = LineOf(grid, edge);
    edge.at = SearchCrossing(
        edge.from, edge.to, options, [&](double t) { return field(line.At(t)); }, counts[n]);
  });
  intersections.summary.edge_evaluations =
      std::accumulate(counts.begin(), counts.end(), std::int64_t{0});
  return MeshOf(grid, std::move(intersections));
}

// Marches through all cells; layer(k, values) gives the values of the k-th layer of corners.
template <class GiveLayer>
EdgeIntersections MarchAll(const SampleGrid& grid, const RunContext& context,
                           const GiveLayer& layer) {
  SliceMarchingCubes march(grid);
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
  EdgeIntersections intersections = MarchAll(grid, context, [&](int k, std::span<double> values) {
    ParallelFor(values.size(), context.threads, 64, [&](std::size_t n) {
      const auto column = static_cast<int>(n);
      values[n] = field(grid.Corner(column % grid.counts[0], column / grid.counts[0], k));
    });
  });
  intersections.summary.corner_evaluations = grid.CornerCount();
  return Searched(field, grid, options, context, std::move(intersections));
}

PolygonizeResult PolygonizeFrom(const ScalarField& field, const SampleGrid& grid,
                                std::span<const StartCell> starts, const EdgeSearchOptions& options,
                                const RunContext& context) {
  CheckGrid(grid);
  Continuation continuation(field, grid, context);
  continuation.Follow(starts);
  return Searched(field, grid, options, context, continuation.Take());
}

PolygonizeResult PolygonizeThrough(const ScalarField& field, const SampleGrid& grid,
                                   std::span<const StartCell> starts,
                                   const EdgeSearchOptions& options, const RunContext& context) {
  CheckGrid(grid);
  Continuation continuation(field, grid, context);
  continuation.Follow(starts.first(std::min<std::size_t>(1, starts.size())));
  const auto reached = [&](const StartCell& start) { return continuation.Reached(start); };
  if (!std::all_of(starts.begin(), starts.end(), reached)) {
    continuation.TakeWholeCells();
    continuation.Follow(starts);
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
  EdgeIntersections intersections = MarchAll(grid, context, [&](int k, std::span<double> values) {
    const auto layer = samples.subspan(k * values.size(), values.size());
    std::copy(layer.begin(), layer.end(), values.begin());
  });
  for (CrossedEdge& edge : intersections.edges) {
    edge.at = edge.from / (edge.from - edge.to);
  }
  return MeshOf(grid, std::move(intersections));
}

}  // namespace semblance
