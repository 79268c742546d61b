// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/marching/polygonize.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numeric>
#include <utility>
#include <vector>

#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"
#include "surfaces/marching/edge_intersections.h"

namespace semblance::surfaces {

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

GridIndex CellCorner(const GridIndex& cell, int c) {
  return {cell[0] + (c & 1), cell[1] + (c >> 1 & 1), cell[2] + (c >> 2 & 1)};
}

bool IsCell(const SampleGrid& grid, const GridIndex& cell) {
  return cell[0] >= 0 && cell[1] >= 0 && cell[2] >= 0 && cell[0] + 1 < grid.counts[0] &&
         cell[1] + 1 < grid.counts[1] && cell[2] + 1 < grid.counts[2];
}

// The edges of a cell on one of its faces, and their indices in the cell beyond that face.
struct FaceEdges {
  EdgeBits on = 0;
  std::array<std::uint8_t, 12> beyond{};
};

FaceEdges FindFaceEdges(int axis, int upper) {
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

// Indexed by 2 * axis + upper.
std::array<FaceEdges, 6> AllFaces() {
  std::array<FaceEdges, 6> faces;
  for (int f = 0; f < 6; ++f) {
    faces[f] = FindFaceEdges(f / 2, f % 2);
  }
  return faces;
}

// Values at some corners of a large grid, in blocks of 8^3 corners that exist only where a corner
// was requested.
class SparseGrid {
 public:
  explicit SparseGrid(const SampleGrid& grid) {
    for (int axis = 0; axis < 3; ++axis) {
      counts_[axis] = (grid.counts[axis] + kEdge - 1) / kEdge;
    }
    blocks_.resize(std::size_t(counts_[0]) * counts_[1] * counts_[2]);
  }

  // The state of a cell, stored at its lowest corner; empty at first.
  struct CellRecord {
    EdgeBits edges = 0;
    std::uint8_t mask = 0;
  };
  CellRecord& CellAt(const GridIndex& cell) { return FindOrMakeBlock(cell).cells[Within(cell)]; }
  // Marks a corner as requested; returns true the first time.
  bool MarkRequested(const GridIndex& corner) {
    auto bit = FindOrMakeBlock(corner).requested[Within(corner)];
    const bool first = !bit;
    bit = true;
    return first;
  }

  // Value of a requested corner. Different corners may be set by several threads at once.
  void Set(const GridIndex& corner, double value) {
    blocks_[BlockIndex(corner)]->value[Within(corner)] = value;
  }
  double Get(const GridIndex& corner) const {
    return blocks_[BlockIndex(corner)]->value[Within(corner)];
  }

 private:
  static constexpr int kEdge = 8, kCorners = kEdge * kEdge * kEdge;
  struct Block {
    std::array<double, kCorners> value;
    std::array<CellRecord, kCorners> cells{};
    std::bitset<kCorners> requested;
  };

  // Indices are not negative; unsigned division is faster.
  static std::size_t Within(const GridIndex& at) {
    const auto within = [&at](int axis) { return std::size_t(at[axis]) % kEdge; };
    return within(0) + kEdge * (within(1) + kEdge * within(2));
  }
  std::size_t BlockIndex(const GridIndex& at) const {
    const auto block = [&at](int axis) { return std::size_t(at[axis]) / kEdge; };
    return block(0) + std::size_t(counts_[0]) * (block(1) + std::size_t(counts_[1]) * block(2));
  }
  Block& FindOrMakeBlock(const GridIndex& at) {
    std::unique_ptr<Block>& block = blocks_[BlockIndex(at)];
    if (!block) {
      block = std::make_unique<Block>();
    }
    return *block;
  }

  GridIndex counts_{};  // number of blocks
  std::vector<std::unique_ptr<Block>> blocks_;
};

// Follows components from crossed cells to their neighbours, wave by wave. If a cell contains two
// sheets, it follows only the one on which it arrived. A cell's `edges` are those known to belong
// to the followed components.
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
  // From here on all sheets in a cell count as one.
  void JoinSheetsInCells() {
    join_sheets_ = true;
    for (const std::int64_t cell : std::vector(cells_)) {
      Visit(grid_.At(cell), kAllEdges);
    }
  }
  // Returns the cells in ascending order, and their edges.
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
  // The corners of new cells that have no value yet.
  std::vector<std::int64_t> UnknownCorners() {
    std::vector<std::int64_t> unknown;
    for (std::size_t n = known_cells_; n < cells_.size(); ++n) {
      const GridIndex at = grid_.At(cells_[n]);
      for (int c = 0; c < 8; ++c) {
        const GridIndex corner = CellCorner(at, c);
        if (corners_.MarkRequested(corner)) {
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
      mask |= static_cast<std::uint8_t>((corners_.Get(CellCorner(cell, c)) > 0) << c);
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
        Visit(neighbour, join_sheets_ ? kAllEdges : beyond);
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
                                      corners_.Get(CellCorner(at, edge.from)),
                                      corners_.Get(CellCorner(at, edge.to))});
    });
  }

  const ScalarField& field_;
  const SampleGrid& grid_;
  const RunContext& context_;
  SparseGrid corners_;
  std::array<FaceEdges, 6> faces_;
  const std::array<std::array<EdgeBits, 12>, 256>& loops_ = MarchingCubesLoops();
  bool join_sheets_ = false;
  std::vector<std::int64_t> cells_;  // visited cells
  std::size_t known_cells_ = 0;      // number of cells_ with known corners
  std::vector<StartCell> next_;      // next wave
  EdgeIntersections intersections_;
};

PolygonizeResult SearchEdges(const ScalarField& field, const SampleGrid& grid,
                             const EdgeSearchOptions& options, const RunContext& context,
                             EdgeIntersections intersections) {
  std::vector<std::int64_t> counts(intersections.edges.size(), 0);
  ParallelFor(intersections.edges.size(), context.threads, 64, [&](std::size_t n) {
    CrossedEdge& edge = intersections.edges[n];
    const EdgeLine line = MakeEdgeLine(grid, edge);
    edge.at = SearchCrossing(
        edge.from, edge.to, options, [&](double t) { return field(line.At(t)); }, counts[n]);
  });
  intersections.summary.edge_evaluations =
      std::accumulate(counts.begin(), counts.end(), std::int64_t{0});
  return BuildMesh(grid, std::move(intersections));
}

// Marches through all cells; layer(k, values) fills in the k-th layer of corners.
template <class GiveLayer>
EdgeIntersections MarchAll(const SampleGrid& grid, const RunContext& context,
                           const GiveLayer& layer) {
  SliceMarchingCubes march(grid);
  layer(0, march.UpperLayer());
  for (int k = 0; k + 1 < grid.counts[2]; ++k) {
    context.ThrowIfStopped();
    context.Report("polygonize", {}, static_cast<double>(k) / grid.counts[2]);
    march.NextLayer();
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
  return SearchEdges(field, grid, options, context, std::move(intersections));
}

PolygonizeResult PolygonizeFrom(const ScalarField& field, const SampleGrid& grid,
                                std::span<const StartCell> starts, const EdgeSearchOptions& options,
                                const RunContext& context) {
  CheckGrid(grid);
  Continuation continuation(field, grid, context);
  continuation.Follow(starts);
  return SearchEdges(field, grid, options, context, continuation.Take());
}

PolygonizeResult PolygonizeThrough(const ScalarField& field, const SampleGrid& grid,
                                   std::span<const StartCell> starts,
                                   const EdgeSearchOptions& options, const RunContext& context) {
  CheckGrid(grid);
  Continuation continuation(field, grid, context);
  continuation.Follow(starts.first(std::min<std::size_t>(1, starts.size())));
  const auto reached = [&](const StartCell& start) { return continuation.Reached(start); };
  if (!std::all_of(starts.begin(), starts.end(), reached)) {
    continuation.JoinSheetsInCells();
    continuation.Follow(starts);
  }
  return SearchEdges(field, grid, options, context, continuation.Take());
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
  return BuildMesh(grid, std::move(intersections));
}

}  // namespace semblance::surfaces
