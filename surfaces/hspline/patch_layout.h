// SPDX-License-Identifier: GPL-3.0-or-later
// Which patches and vertices of each level the offsets of an H-spline need.
#pragma once

#include <map>
#include <vector>

#include "surfaces/hspline/sparse_net.h"

namespace semblance {

struct LevelLayout {
  ColumnSpans reached;  // patches that an offset of this level changes: their shape is this level's
  ColumnSpans needed;   // those, and the patches that hold needed ones of the next finer level
};

// Per level, 0..max_level. Each offset reaches 4 x 4 patches of its level, clipped at open
// borders. All patches of level 0 are reached.
std::vector<LevelLayout> LayoutOf(const HSplineShape& shape,
                                  const std::map<VertexId, Vec3>& offsets);

// The patches of the next coarser level that hold the given ones.
ColumnSpans Parents(const ColumnSpans& patches);

// The vertices of the given patches of a level, as stored (sparse_net.h).
ColumnSpans VerticesOf(const HSplineShape& shape, int level, const ColumnSpans& patches);

}  // namespace semblance
