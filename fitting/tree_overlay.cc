// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/tree_overlay.h"

#include <algorithm>
#include <set>

namespace semblance {
namespace {

// Vertices of the next level on the knots of a patch (and beyond, at a border or by the margin)
// that are not edited.
std::vector<VertexId> MissingOver(const OffsetTree& tree, const PatchId& patch, int margin) {
  const HSplineShape& shape = tree.shape();
  const int level = patch.level + 1, columns = shape.Columns(level), rows = shape.Rows(level);
  const bool periodic = shape.closure == Closure::kPeriodicU;
  const auto first = [&](int k) { return k == 0 ? 0 : 2 * k + 1; };
  const auto last = [&](int k, int patches) { return 2 * k + (k == patches - 1 ? 4 : 3); };
  const int i0 = (periodic ? 2 * patch.i + 1 : first(patch.i)) - margin,
            i1 = (periodic ? 2 * patch.i + 3 : last(patch.i, shape.PatchesU(patch.level))) + margin,
            j0 = std::max(first(patch.j) - margin, 0),
            j1 = std::min(last(patch.j, shape.PatchesV(patch.level)) + margin, rows - 1);
  std::vector<VertexId> missing;
  for (int j = j0; j <= j1; ++j) {
    for (int i = i0; i <= i1; ++i) {
      if (!periodic && (i < 0 || i >= columns)) {
        continue;
      }
      const VertexId vertex{level, ((i % columns) + columns) % columns, j};
      if (!tree.IsEdited(vertex)) {
        missing.push_back(vertex);
      }
    }
  }
  return missing;
}

}  // namespace

std::vector<VertexId> FinerVertices(const OffsetTree& tree, const AdaptivePlan& plan) {
  const double most = plan.tolerance_mm * plan.tolerance_mm;
  std::set<VertexId> finer;
  for (const TreeNode& leaf : tree.nodes()) {
    if (leaf.children >= 0 || !(leaf.sums.largest > most) ||
        leaf.range.size() < static_cast<std::size_t>(plan.min_points)) {
      continue;
    }
    for (int level = 0; level <= leaf.patch.level && level < plan.finest; ++level) {
      const int shift = leaf.patch.level - level;
      const PatchId patch{level, leaf.patch.i >> shift, leaf.patch.j >> shift};
      const std::vector<VertexId> missing = MissingOver(tree, patch, plan.margin);
      finer.insert(missing.begin(), missing.end());
      if (!missing.empty()) {
        break;
      }
    }
  }
  return {finer.begin(), finer.end()};
}

}  // namespace semblance
