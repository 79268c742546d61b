// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline/sparse_net.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>

#include "surfaces/hspline/bspline_basis.h"

namespace semblance {

std::vector<RowSpan> Merged(std::vector<RowSpan> spans) {
  std::sort(spans.begin(), spans.end(),
            [](const RowSpan& a, const RowSpan& b) { return a.begin < b.begin; });
  std::size_t count = 0;
  for (const RowSpan& span : spans) {
    if (count > 0 && span.begin <= spans[count - 1].end) {
      spans[count - 1].end = std::max(spans[count - 1].end, span.end);
    } else {
      spans[count++] = span;
    }
  }
  spans.resize(count);
  return spans;
}

RowTable::RowTable(const ColumnSpans& columns, int rows) {
  std::size_t count = 0;
  for (const std::vector<RowSpan>& spans : columns) {
    count += spans.size();
  }
  if (count == 0) {
    return;
  }
  starts_.reserve(columns.size() + 1);
  spans_.reserve(count);
  for (const std::vector<RowSpan>& spans : columns) {
    starts_.push_back(static_cast<std::int32_t>(spans_.size()));
    spans_.insert(spans_.end(), spans.begin(), spans.end());
  }
  starts_.push_back(static_cast<std::int32_t>(spans_.size()));
  const bool whole = spans_.size() == columns.size() &&
                     std::all_of(columns.begin(), columns.end(), [&](const auto& spans) {
                       return spans == std::vector<RowSpan>{{0, rows}};
                     });
  whole_ = whole ? rows : 0;
}

std::size_t RowTable::Bytes() const {
  return starts_.capacity() * sizeof(starts_[0]) + spans_.capacity() * sizeof(spans_[0]);
}

SparseNet::SparseNet(RowTable rows) : rows_(std::move(rows)) {
  std::size_t count = 0;
  for (int k = 0; rows_.columns() > 0 && k < rows_.First(rows_.columns()); ++k) {
    first_.push_back(count);
    count += rows_.Span(k).end - rows_.Span(k).begin;
  }
  vertices_.resize(count, Vec3::Zero());
}

SparseNet SparseNet::WholeNet(const ControlNet& net, int stored_rows) {
  SparseNet whole(RowTable(ColumnSpans(net.columns, {{0, stored_rows}}), stored_rows));
  for (int i = 0; i < net.columns; ++i) {
    for (int j = 0; j < stored_rows; ++j) {
      whole.vertices_[static_cast<std::size_t>(i) * stored_rows + j] = net.At(i, j % net.rows);
    }
  }
  return whole;
}

void SparseNet::CopyTo(ControlNet& net) const {
  for (int i = 0; i < rows_.columns(); ++i) {
    for (int span = rows_.First(i); span < rows_.First(i + 1); ++span) {
      const RowSpan& rows = rows_.Span(span);
      for (int j = rows.begin; j < rows.end; ++j) {
        net.At(i, j % net.rows) = vertices_[first_[span] + (j - rows.begin)];
      }
    }
  }
}

std::size_t SparseNet::Bytes() const {
  return rows_.Bytes() + first_.capacity() * sizeof(first_[0]) +
         vertices_.capacity() * sizeof(vertices_[0]);
}

SparseNet Refined(const HSplineShape& shape, int level, const SparseNet& coarse, RowTable rows) {
  SparseNet fine(std::move(rows));
  for (int i = 0; i < fine.rows().columns(); ++i) {
    const RefinementRow u = RefineRow(i);
    for (int span = fine.rows().First(i); span < fine.rows().First(i + 1); ++span) {
      const auto [begin, end] = fine.rows().Span(span);
      const int first = begin / 2, last = end / 2 + 2;  // rows of the coarser level
      std::array<const Vec3*, 3> columns;
      for (int a = 0; a < 3; ++a) {
        columns[a] = coarse.Find(shape.Column(level, u.index[a]), first, last - first);
        assert(columns[a] != nullptr);
      }
      Vec3* out = fine.Find(i, begin);
      for (int j = begin; j < end; ++j) {
        const RefinementRow v = RefineRow(j);
        *out++ = RefinedVertex(
            u, v, [&](int a, int b) -> const Vec3& { return columns[a][v.index[b] - first]; });
      }
    }
  }
  return fine;
}

}  // namespace semblance
