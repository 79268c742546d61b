// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/solve/refinement_marking.h"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

namespace semblance::fitting {
namespace {

// The vertices of the next level on the knots of a patch that are not edited. At a border, and with
// a margin, they extend beyond the patch.
std::vector<VertexId> MissingOver(const HierarchicalSplineSpace& space, const PatchId& patch,
                                  int margin) {
  const HSplineShape& shape = space.shape();
  const int level = patch.level + 1;
  const auto first = [&](int k, bool closed) {
    return (!closed && k == 0 ? 0 : 2 * k + 1) - margin;
  };
  const auto last = [&](int k, int patches, bool closed) {
    return 2 * k + (!closed && k == patches - 1 ? 4 : 3) + margin;
  };
  const int last_u = last(patch.i, shape.PatchesU(patch.level), shape.ClosedU()),
            last_v = last(patch.j, shape.PatchesV(patch.level), false);
  std::vector<VertexId> missing;
  for (int b = first(patch.j, false); b <= last_v; ++b) {
    for (int a = first(patch.i, shape.ClosedU()); a <= last_u; ++a) {
      const VertexId vertex{level, WrapIndex(shape.Columns(level), a, shape.ClosedU()),
                            WrapIndex(shape.Rows(level), b, false)};
      if (vertex.i >= 0 && vertex.j >= 0 && !space.IsEdited(vertex)) {
        missing.push_back(vertex);
      }
    }
  }
  return missing;
}

// The numbers of points in the patches of a space.
class PatchCounts {
 public:
  explicit PatchCounts(const HierarchicalSplineSpace& space) : shape_(space.shape()) {
    for (const QuadtreeNode& node : space.nodes()) {
      counts_.emplace(MakeKey(node.patch), node.range.size());
    }
  }

  // The neighbours (of eight) with less than a quarter of the patch's points: they are a gap or its
  // edge. With at least min_points points, a quarter seldom occurs by chance.
  std::vector<PatchId> EmptierAround(const PatchId& patch) const {
    const std::size_t own = counts_.at(MakeKey(patch));
    std::vector<PatchId> emptier;
    for (int k = 0; k < 9; ++k) {
      const PatchId other{
          patch.level,
          WrapIndex(shape_.PatchesU(patch.level), patch.i + k % 3 - 1, shape_.ClosedU()),
          WrapIndex(shape_.PatchesV(patch.level), patch.j + k / 3 - 1, false)};
      const auto found = counts_.find(MakeKey(other));
      if (found != counts_.end() && 4 * found->second < own) {
        emptier.push_back(other);
      }
    }
    return emptier;
  }

 private:
  using Key = std::tuple<int, int, int>;
  static Key MakeKey(const PatchId& p) { return {p.level, p.i, p.j}; }

  HSplineShape shape_;
  std::map<Key, std::size_t> counts_;
};

// Returns whether some point of a leaf exceeds its tolerance.
bool Misses(const HSplineShape& shape, const QuadtreeNode& leaf, const AdaptivePlan& plan,
            const PointCloud& cloud, std::span<const double> squares) {
  if (plan.regions.empty()) {
    return leaf.sums.largest > plan.tolerance_mm * plan.tolerance_mm;
  }
  for (std::size_t k = leaf.range.begin; k < leaf.range.end; ++k) {
    const CloudPoint& point = cloud.points()[k];
    const double tolerance_mm =
        plan.ToleranceAt(point.x / shape.patches_u, point.y / shape.patches_v);
    if (squares[k] > tolerance_mm * tolerance_mm) {
      return true;
    }
  }
  return false;
}

}  // namespace

std::vector<VertexId> MarkForRefinement(const HierarchicalSplineSpace& space,
                                        const AdaptivePlan& plan, const PointCloud& cloud,
                                        std::span<const double> squares,
                                        std::span<const Vec2> places) {
  std::set<int> requested;  // leaves
  for (const Vec2& uv : places) {
    requested.insert(space.LeafAt(uv));
  }
  const PatchCounts counts(space);
  std::set<VertexId> finer;
  for (int node = 0; node < std::ssize(space.nodes()); ++node) {
    const QuadtreeNode& leaf = space.nodes()[node];
    const bool has_points = leaf.range.size() >= static_cast<std::size_t>(plan.min_points);
    if (leaf.children >= 0) {
      continue;
    }
    if (!requested.contains(node) &&
        !(has_points && Misses(space.shape(), leaf, plan, cloud, squares))) {
      continue;
    }
    for (int level = 0; level <= std::min(leaf.patch.level, plan.finest - 1); ++level) {
      const int shift = leaf.patch.level - level;
      const PatchId patch{level, leaf.patch.i >> shift, leaf.patch.j >> shift};
      const std::vector<VertexId> missing = MissingOver(space, patch, plan.margin);
      if (missing.empty()) {
        continue;
      }
      finer.insert(missing.begin(), missing.end());
      for (const PatchId& gap : counts.EmptierAround(patch)) {
        const std::vector<VertexId> into = MissingOver(space, gap, plan.margin);
        finer.insert(into.begin(), into.end());
      }
      break;
    }
  }
  return {finer.begin(), finer.end()};
}

}  // namespace semblance::fitting
