// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline/patch_layout.h"

#include <algorithm>
#include <utility>

namespace semblance {
namespace {

// Each column becomes the union of those that `sources(column)` names.
template <class Sources>
ColumnSpans Gathered(int columns, const ColumnSpans& from, const Sources& sources) {
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
    result[column] = Merged(std::move(spans));
  }
  return result;
}

ColumnSpans United(const ColumnSpans& a, const ColumnSpans& b) {
  if (a.empty() || b.empty()) {
    return a.empty() ? b : a;
  }
  ColumnSpans both = a;
  for (std::size_t i = 0; i < both.size(); ++i) {
    both[i].insert(both[i].end(), b[i].begin(), b[i].end());
    both[i] = Merged(std::move(both[i]));
  }
  return both;
}

// The rows of patches that a row of vertices reaches.
void AddRowsReached(const HSplineShape& shape, int level, int row, std::vector<RowSpan>& spans) {
  const int patches = shape.PatchesV(level), begin = std::max(row - 3, 0),
            end = std::min(row + 1, patches);
  if (!spans.empty() && begin <= spans.back().end) {
    spans.back().end = end;
  } else {
    spans.push_back({begin, end});
  }
}

ColumnSpans ReachedPatches(const HSplineShape& shape, int level,
                           const std::map<VertexId, Vec3>& offsets) {
  ColumnSpans rows;  // of patches, for each column of vertices
  for (auto it = offsets.lower_bound({level, 0, 0});
       it != offsets.end() && it->first.level == level; ++it) {
    rows.resize(shape.Columns(level));
    AddRowsReached(shape, level, it->first.j, rows[it->first.i]);
  }
  return Gathered(shape.PatchesU(level), rows, [&](int patch) {
    return std::array{shape.Column(level, patch), shape.Column(level, patch + 1),
                      shape.Column(level, patch + 2), shape.Column(level, patch + 3)};
  });
}

}  // namespace

ColumnSpans Parents(const ColumnSpans& patches) {
  ColumnSpans halves = patches;
  for (std::vector<RowSpan>& spans : halves) {
    for (RowSpan& span : spans) {
      span = {span.begin / 2, (span.end + 1) / 2};
    }
  }
  return Gathered(static_cast<int>(patches.size()) / 2, halves, [](int i) {
    return std::array{2 * i, 2 * i + 1};
  });
}

ColumnSpans VerticesOf(const HSplineShape& shape, int level, const ColumnSpans& patches) {
  ColumnSpans rows = patches;
  for (std::vector<RowSpan>& spans : rows) {
    for (RowSpan& span : spans) {
      span.end += 3;
    }
  }
  return Gathered(shape.Columns(level), rows, [&](int i) {
    return std::array{shape.Column(level, i - 3), shape.Column(level, i - 2),
                      shape.Column(level, i - 1), i};
  });
}

std::vector<LevelLayout> LayoutOf(const HSplineShape& shape,
                                  const std::map<VertexId, Vec3>& offsets) {
  std::vector<LevelLayout> layout(shape.max_level + 1);
  for (int level = shape.max_level; level > 0; --level) {
    layout[level].reached = ReachedPatches(shape, level, offsets);
    layout[level].needed = level < shape.max_level
                               ? United(layout[level].reached, Parents(layout[level + 1].needed))
                               : layout[level].reached;
  }
  layout[0].reached = ColumnSpans(shape.patches_u, {{0, shape.patches_v}});
  layout[0].needed = layout[0].reached;
  return layout;
}

}  // namespace semblance
