// SPDX-License-Identifier: GPL-3.0-or-later
// Sparse storage of one level's control vertices: runs of rows per column. If v is closed, the
// first three rows are stored again behind the last one, so that the four vertices of a patch's
// column are contiguous also across the seam. A complete column has StoredRows(level) rows.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "surfaces/hspline/hspline_shape.h"

namespace semblance::surfaces {

// Rows [begin, end) of a column.
struct RowSpan {
  int begin = 0;
  int end = 0;
  bool operator==(const RowSpan&) const = default;
};

using ColumnSpans = std::vector<std::vector<RowSpan>>;  // one list per column; no columns at all if
                                                        // there are no spans

inline int StoredRows(const HSplineShape& shape, int level) { return shape.PatchesV(level) + 3; }

// Sorts the spans and merges spans that overlap or touch.
std::vector<RowSpan> MergeSpans(std::vector<RowSpan> spans);

// The set of existing (i, j) of a grid. The spans of a column are ascending and do not touch.
// Memory: the spans, and four bytes per column.
class RowTable {
 public:
  RowTable() = default;
  // rows: the number of rows of a complete column.
  RowTable(const ColumnSpans& columns, int rows);

  // The index of the span that contains (i, j), or -1.
  int Find(int i, int j) const {
    if (whole_ > 0) {
      return j < whole_ ? i : -1;
    }
    if (starts_.empty()) {
      return -1;
    }
    int low = starts_[i], high = starts_[i + 1];
    while (low < high) {
      const int middle = (low + high) / 2;
      if (j >= spans_[middle].end) {
        low = middle + 1;
      } else if (j < spans_[middle].begin) {
        high = middle;
      } else {
        return middle;
      }
    }
    return -1;
  }
  const RowSpan& Span(int index) const { return spans_[index]; }
  int First(int i) const { return starts_[i]; }  // column i has the spans First(i)..First(i + 1)
  int whole() const { return whole_; }  // number of rows if all columns are complete, else 0
  int columns() const { return starts_.empty() ? 0 : static_cast<int>(starts_.size()) - 1; }

  std::size_t Bytes() const;
  bool operator==(const RowTable&) const = default;

 private:
  std::vector<std::int32_t> starts_;  // per column the first span, and the end; or empty
  std::vector<RowSpan> spans_;
  int whole_ = 0;
};

class SparseNet {
 public:
  SparseNet() = default;
  explicit SparseNet(RowTable rows);  // all vertices 0
  // A net in which all vertices exist.
  static SparseNet WholeNet(const ControlNet& net, int stored_rows);

  const RowTable& rows() const { return rows_; }
  std::size_t size() const { return vertices_.size(); }

  // The contiguous vertices (i, j) to (i, j + count - 1); null unless all exist.
  const Vec3* Find(int i, int j, int count) const {
    if (rows_.whole() > 0) {
      return vertices_.data() + static_cast<std::size_t>(i) * rows_.whole() + j;
    }
    const int span = rows_.Find(i, j);
    return span < 0 || j + count > rows_.Span(span).end
               ? nullptr
               : vertices_.data() + first_[span] + (j - rows_.Span(span).begin);
  }
  Vec3* Find(int i, int j) {
    return const_cast<Vec3*>(static_cast<const SparseNet*>(this)->Find(i, j, 1));
  }

  // Copies the existing vertices into a dense net of the level.
  void CopyTo(ControlNet& net) const;

  std::size_t Bytes() const;

 private:
  RowTable rows_;
  std::vector<std::size_t> first_;  // per span the index of its first vertex
  std::vector<Vec3> vertices_;
};

// The vertices `rows` of level + 1 by knot insertion from `coarse`, a net of `level` in which all
// needed vertices exist. Gives the same bytes as Refine.
SparseNet RefineSparse(const HSplineShape& shape, int level, const SparseNet& coarse,
                       RowTable rows);

// The patches of one level that the offsets of an H-spline need.
struct LevelLayout {
  ColumnSpans influenced;  // patches that an offset of this level changes
  ColumnSpans needed;      // influenced ones, and parents of needed patches of the next finer level
};

// Computes the layout of each level, 0..max_level. An offset influences 4 x 4 patches of its level,
// fewer at an open border. All patches of level 0 count as influenced.
std::vector<LevelLayout> MakeLayouts(const HSplineShape& shape,
                                     const std::map<VertexId, Vec3>& offsets);

// The patches of the next coarser level that contain the given patches.
ColumnSpans ParentPatches(const ColumnSpans& patches);

// The stored vertices of the given patches of a level.
ColumnSpans VertexSpans(const HSplineShape& shape, int level, const ColumnSpans& patches);

}  // namespace semblance::surfaces
