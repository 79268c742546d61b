// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline/sparse_net.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>

#include "surfaces/hspline/bspline.h"

namespace semblance::surfaces {
namespace {

// Result column i is the union of the columns sources(i) of `from`.
template <class Sources>
ColumnSpans GatherColumns(int columns, const ColumnSpans& from, const Sources& sources) {
  ColumnSpans result;
  if (from.empty()) {
    return result;
  }
  result.resize(columns);
  for (int column = 0; column < columns; ++column) {
    std::vector<RowSpan> spans;
    for (const int source : sources(column)) {
      if (source >= 0 && source < static_cast<int>(from.size())) {
        spans.insert(spans.end(), from[source].begin(), from[source].end());
      }
    }
    result[column] = MergeSpans(std::move(spans));
  }
  return result;
}

ColumnSpans UniteSpans(const ColumnSpans& a, const ColumnSpans& b) {
  if (a.empty() || b.empty()) {
    return a.empty() ? b : a;
  }
  ColumnSpans both = a;
  for (std::size_t i = 0; i < both.size(); ++i) {
    both[i].insert(both[i].end(), b[i].begin(), b[i].end());
    both[i] = MergeSpans(std::move(both[i]));
  }
  return both;
}

// Adds the rows of patches that a row of vertices influences.
void AddRowsReached(const HSplineShape& shape, int level, int row, std::vector<RowSpan>& spans) {
  const int patches = shape.PatchesV(level), begin = std::max(row - 3, 0),
            end = std::min(row + 1, patches);
  if (!spans.empty() && begin <= spans.back().end) {
    spans.back().end = end;
  } else {
    spans.push_back({begin, end});
  }
}

ColumnSpans InfluencedPatches(const HSplineShape& shape, int level,
                              const std::map<VertexId, Vec3>& offsets) {
  ColumnSpans rows;  // rows of patches per column of vertices
  for (auto it = offsets.lower_bound({level, 0, 0});
       it != offsets.end() && it->first.level == level; ++it) {
    rows.resize(shape.Columns(level));
    AddRowsReached(shape, level, it->first.j, rows[it->first.i]);
  }
  return GatherColumns(shape.PatchesU(level), rows, [&](int patch) {
    return std::array{shape.Column(level, patch), shape.Column(level, patch + 1),
                      shape.Column(level, patch + 2), shape.Column(level, patch + 3)};
  });
}

}  // namespace

std::vector<RowSpan> MergeSpans(std::vector<RowSpan> spans) {
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

SparseNet RefineSparse(const HSplineShape& shape, int level, const SparseNet& coarse,
                       RowTable rows) {
  SparseNet fine(std::move(rows));
  for (int i = 0; i < fine.rows().columns(); ++i) {
    const RefinementRow u = RefineRow(i);
    for (int span = fine.rows().First(i); span < fine.rows().First(i + 1); ++span) {
      const auto [begin, end] = fine.rows().Span(span);
      const int first = begin / 2, last = end / 2 + 2;  // rows on the coarser level
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

ColumnSpans ParentPatches(const ColumnSpans& patches) {
  ColumnSpans halves = patches;
  for (std::vector<RowSpan>& spans : halves) {
    for (RowSpan& span : spans) {
      span = {span.begin / 2, (span.end + 1) / 2};
    }
  }
  return GatherColumns(static_cast<int>(patches.size()) / 2, halves, [](int i) {
    return std::array{2 * i, 2 * i + 1};
  });
}

ColumnSpans VertexSpans(const HSplineShape& shape, int level, const ColumnSpans& patches) {
  ColumnSpans rows = patches;
  for (std::vector<RowSpan>& spans : rows) {
    for (RowSpan& span : spans) {
      span.end += 3;
    }
  }
  return GatherColumns(shape.Columns(level), rows, [&](int i) {
    return std::array{shape.Column(level, i - 3), shape.Column(level, i - 2),
                      shape.Column(level, i - 1), i};
  });
}

std::vector<LevelLayout> MakeLayouts(const HSplineShape& shape,
                                     const std::map<VertexId, Vec3>& offsets) {
  std::vector<LevelLayout> layout(shape.max_level + 1);
  for (int level = shape.max_level; level > 0; --level) {
    layout[level].influenced = InfluencedPatches(shape, level, offsets);
    layout[level].needed =
        level < shape.max_level
            ? UniteSpans(layout[level].influenced, ParentPatches(layout[level + 1].needed))
            : layout[level].influenced;
  }
  layout[0].influenced = ColumnSpans(shape.patches_u, {{0, shape.patches_v}});
  layout[0].needed = layout[0].influenced;
  return layout;
}

}  // namespace semblance::surfaces
