// SPDX-License-Identifier: GPL-3.0-or-later
// The control vertices of one level, of which only some exist: per column, runs of rows. Where v is
// closed, the first three rows follow the last one again, so that the vertices of each patch stand
// in a row, also across the seam: there are always StoredRows(level).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "surfaces/hspline/hspline_shape.h"

namespace semblance {

// Rows [begin, end) of a column.
struct RowSpan {
  int begin = 0;
  int end = 0;
  bool operator==(const RowSpan&) const = default;
};

using ColumnSpans =
    std::vector<std::vector<RowSpan>>;  // one list per column; empty if there are none

inline int StoredRows(const HSplineShape& shape, int level) { return shape.PatchesV(level) + 3; }

// Sorts the spans and merges those that overlap or touch.
std::vector<RowSpan> Merged(std::vector<RowSpan> spans);

// Which (i, j) of a grid exist; spans in order and apart. Memory: the spans, and four bytes per
// column.
class RowTable {
 public:
  RowTable() = default;
  // rows: of the grid, in each column.
  RowTable(const ColumnSpans& columns, int rows);

  // The span, as an index, that holds (i, j) of the grid, or -1.
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
  int First(int i) const { return starts_[i]; }  // the column's spans are First(i)..First(i + 1)
  int whole() const { return whole_; }           // rows, if all of every column are there; else 0
  int columns() const { return starts_.empty() ? 0 : static_cast<int>(starts_.size()) - 1; }

  std::size_t Bytes() const;
  bool operator==(const RowTable&) const = default;

 private:
  std::vector<std::int32_t> starts_;  // one per column and one more, or none
  std::vector<RowSpan> spans_;
  int whole_ = 0;
};

class SparseNet {
 public:
  SparseNet() = default;
  explicit SparseNet(RowTable rows);  // vertices at the origin
  // All vertices exist.
  static SparseNet WholeNet(const ControlNet& net, int stored_rows);

  const RowTable& rows() const { return rows_; }
  std::size_t size() const { return vertices_.size(); }

  // The vertices (i, j) to (i, j + count - 1) as stored, contiguous; null unless all exist.
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

  // Copies the vertices that exist into a dense net of the level.
  void CopyTo(ControlNet& net) const;

  std::size_t Bytes() const;

 private:
  RowTable rows_;
  std::vector<std::size_t> first_;  // per span: the index of its first vertex
  std::vector<Vec3> vertices_;
};

// The vertices `rows` of level + 1, made from those of `level`; each needed one must exist there.
// The same bytes as Refine.
SparseNet Refined(const HSplineShape& shape, int level, const SparseNet& coarse, RowTable rows);

}  // namespace semblance
