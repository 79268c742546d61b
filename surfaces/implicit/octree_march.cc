// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/implicit/octree_march.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "surfaces/marching/edge_intersections.h"

namespace semblance::surfaces {
namespace {

constexpr double kSumRounding = 1e-9;  // relative round-off between two orders of a sum

using Emitters = std::vector<std::int32_t>;

// The emitters to sum in a volume (ascending), and an upper bound of the sum of all others in it.
struct Influence {
  Emitters emitters;
  double slack = 0;
};

// A cube of grid cells. A node of depth d has 1 / 2^d of the root's side.
struct Node {
  GridIndex low{};
  int size = 0;  // cells, a power of 2
  Influence influence;
  bool empty = false;    // proven to contain no surface
  bool divided = false;  // has children; otherwise it is a leaf
  std::array<std::unique_ptr<Node>, 8> children;

  GridIndex Corner(int c) const {
    return {low[0] + (c & 1) * size, low[1] + (c >> 1 & 1) * size, low[2] + (c >> 2 & 1) * size};
  }
};

// Cells along the root's side, a power of 2.
int RootSize(const SampleGrid& grid) {
  const int cells = *std::max_element(grid.counts.begin(), grid.counts.end()) - 1;
  return static_cast<int>(std::bit_ceil(static_cast<unsigned>(cells)));
}

// Evaluates single emitters at corners of the octree, with the cache if requested.
class CornerEmissions {
 public:
  CornerEmissions(const ImplicitSurface& surface, const SampleGrid& grid, bool cached)
      : surface_(surface), grid_(grid) {
    if (cached) {
      cache_.emplace(surface, grid, RootSize(grid));
    }
  }

  void Get(const GridIndex& corner, const Emitters& emitters, std::vector<double>& values,
           PolygonizeSummary& summary) {
    values.resize(emitters.size());
    if (cache_) {
      cache_->Get(corner, emitters, values, summary.emitter_evaluations);
      return;
    }
    surface_.EmissionsAt(grid_.Corner(corner), emitters, values);
    summary.emitter_evaluations += std::ssize(emitters);
  }

 private:
  const ImplicitSurface& surface_;
  const SampleGrid& grid_;
  std::optional<EmitterCache> cache_;
};

// The rules by which the two octrees list a node's emitters and decide on its division.
class McRule {
 public:
  McRule(const McOctree& octree, const ImplicitSurface& surface) : surface_(surface) {
    for (std::int32_t e = 0; e < surface.EmitterCount(); ++e) {
      boxes_.push_back(surface.InfluenceBox(e, octree.influence));
    }
  }

  void Set(Node& node, const Influence& parent, const Box3& box, CornerEmissions&,
           PolygonizeSummary& summary) const {
    Emitters dropped;
    for (const std::int32_t e : parent.emitters) {
      (boxes_[e].intersects(box) ? node.influence.emitters : dropped).push_back(e);
    }
    std::vector<EmissionBounds> bounds(dropped.size());
    surface_.BoundsIn(box, dropped, bounds);
    summary.bound_evaluations += std::ssize(dropped);
    node.influence.slack =
        std::accumulate(bounds.begin(), bounds.end(), parent.slack,
                        [](double sum, const EmissionBounds& b) { return sum + b.most; });
    const bool some = !node.influence.emitters.empty() || node.influence.slack >= 1;
    node.empty = !some;
    node.divided = node.influence.emitters.size() > 1 || node.influence.slack >= 1;
  }

 private:
  const ImplicitSurface& surface_;
  std::vector<Box3> boxes_;
};

class MinMaxRule {
 public:
  MinMaxRule(const MinMaxOctree& octree, const ImplicitSurface& surface)
      : octree_(octree), surface_(surface) {}

  void Set(Node& node, const Influence& parent, const Box3& box, CornerEmissions& corners,
           PolygonizeSummary& summary) const {
    std::vector<EmissionBounds> bounds(parent.emitters.size());
    surface_.BoundsIn(box, parent.emitters, bounds);
    summary.bound_evaluations += std::ssize(bounds);
    bounds = List(parent, bounds, node.influence);
    double least = 0, most = node.influence.slack;
    for (const EmissionBounds& one : bounds) {
      least += one.least;
      most += one.most;
    }
    if (octree_.minimum != EmitterMinimum::kBall && MayHoldSurface(least, most)) {
      least = LeastByCorners(node, bounds, corners, summary);
    }
    node.divided = MayHoldSurface(least, most);
    node.empty = !node.divided;
  }

 private:
  bool MayHoldSurface(double least, double most) const {
    return most + surface_.TailError() > 1 && least - surface_.TailError() < 1;
  }

  // Lists the emitters with enough emission in the node and returns their bounds.
  std::vector<EmissionBounds> List(const Influence& parent,
                                   const std::vector<EmissionBounds>& bounds,
                                   Influence& influence) const {
    std::vector<EmissionBounds> listed;
    influence.slack = parent.slack;
    for (std::size_t n = 0; n < bounds.size(); ++n) {
      if (bounds[n].most >= octree_.least_emission && bounds[n].most > 0) {
        influence.emitters.push_back(parent.emitters[n]);
        listed.push_back(bounds[n]);
      } else {
        influence.slack += bounds[n].most;
      }
    }
    return listed;
  }

  // A lower bound of the sum in the node, from each emitter's smallest value at the node's corners
  // if its minimum is at a corner (thesis 3.2.3).
  double LeastByCorners(const Node& node, const std::vector<EmissionBounds>& bounds,
                        CornerEmissions& corners, PolygonizeSummary& summary) const {
    Emitters at_corner;
    double sum = 0;
    for (std::size_t n = 0; n < bounds.size(); ++n) {
      if (bounds[n].least_at_corner) {
        at_corner.push_back(node.influence.emitters[n]);
      } else {
        sum += bounds[n].least;
      }
    }
    std::vector<double> least(at_corner.size(), std::numeric_limits<double>::infinity()), values;
    for (int c = 0; c < 8; ++c) {
      corners.Get(node.Corner(c), at_corner, values, summary);
      for (std::size_t n = 0; n < values.size(); ++n) {
        least[n] = std::min(least[n], values[n]);
      }
    }
    const double share = surface_.SumShare() + kSumRounding;
    return sum + (1 - share) * std::accumulate(least.begin(), least.end(), 0.0);
  }

  const MinMaxOctree& octree_;
  const ImplicitSurface& surface_;
};

// The part of the octree that meets the current slice. Nodes are created when the march reaches
// them and freed when it has passed them (thesis 3.2.2).
template <class Rule>
class Octree {
 public:
  Octree(const Rule& rule, const ImplicitSurface& surface, const SampleGrid& grid,
         CornerEmissions& corners, PolygonizeSummary& summary)
      : rule_(rule), grid_(grid), corners_(corners), summary_(summary) {
    root_.size = RootSize(grid);
    Influence all;
    all.emitters.resize(surface.EmitterCount());
    std::iota(all.emitters.begin(), all.emitters.end(), 0);
    rule_.Set(root_, all, NodeBox(root_), corners_, summary_);
  }

  // Calls visit(leaf) for each non-empty leaf that meets slice k. k must not decrease.
  template <class Visit>
  void ForEachLeaf(int k, const Visit& visit) {
    Descend(root_, k, visit);
  }

 private:
  Box3 NodeBox(const Node& node) const {
    return {grid_.Corner(node.Corner(0)), grid_.Corner(node.Corner(7))};
  }

  bool InGrid(const Node& node) const {
    return node.low[0] + 1 < grid_.counts[0] && node.low[1] + 1 < grid_.counts[1] &&
           node.low[2] + 1 < grid_.counts[2];
  }

  Node& Child(Node& node, int c) {
    std::unique_ptr<Node>& child = node.children[c];
    if (!child) {
      child = std::make_unique<Node>();
      child->size = node.size / 2;
      for (int axis = 0; axis < 3; ++axis) {
        child->low[axis] = node.low[axis] + (c >> axis & 1) * child->size;
      }
      if (InGrid(*child)) {
        rule_.Set(*child, node.influence, NodeBox(*child), corners_, summary_);
      } else {
        child->empty = true;
      }
    }
    return *child;
  }

  template <class Visit>
  void Descend(Node& node, int k, const Visit& visit) {
    if (node.empty) {
      return;
    }
    if (!node.divided || node.size == 1) {
      visit(node);
      return;
    }
    const int upper = k >= node.low[2] + node.size / 2 ? 4 : 0;
    for (int c = 0; c < 4; ++c) {
      if (upper != 0) {
        node.children[c].reset();
      }
      Descend(Child(node, upper + c), k, visit);
    }
  }

  const Rule& rule_;
  const SampleGrid& grid_;
  CornerEmissions& corners_;
  PolygonizeSummary& summary_;
  Node root_;
};

// The field from a leaf's listed emitters if they determine the sign, otherwise the field itself.
class ListedField {
 public:
  ListedField(const ImplicitSurface& surface, const SampleGrid& grid, const Influence& influence,
              ListSums sums, CornerEmissions& corners, PolygonizeSummary& summary)
      : surface_(surface),
        grid_(grid),
        influence_(influence),
        corners_(corners),
        summary_(summary) {
    if (sums == ListSums::kLanes) {
      gathered_ = surface.Gather(influence.emitters);
    }
  }

  double At(const Vec3& p) const {
    if (gathered_) {
      return Decide(surface_.SumEmissions(*gathered_, p, summary_.emitter_evaluations), p);
    }
    summary_.emitter_evaluations += std::ssize(influence_.emitters);
    return Decide(surface_.SumEmissions(influence_.emitters, p), p);
  }

  double AtCorner(const GridIndex& corner) const {
    const Vec3 p = grid_.Corner(corner);
    if (gathered_) {
      return At(p);
    }
    std::vector<double> values;
    corners_.Get(corner, influence_.emitters, values, summary_);
    return Decide(std::accumulate(values.begin(), values.end(), 0.0), p);
  }

 private:
  // Uses the sum of the listed emitters (and perhaps of some that are also counted in the slack) if
  // it determines the sign.
  double Decide(double sum, const Vec3& p) const {
    const double share = surface_.SumShare() + kSumRounding;
    const bool inside = (1 - share) * sum - surface_.TailError() > 1;
    const bool outside = (1 + share) * (sum + influence_.slack) + surface_.TailError() < 1;
    return inside || outside ? surface_.FlattenAt(p, sum)
                             : surface_.Flattened(p, summary_.emitter_evaluations);
  }

  const ImplicitSurface& surface_;
  const SampleGrid& grid_;
  const Influence& influence_;
  CornerEmissions& corners_;
  PolygonizeSummary& summary_;
  std::shared_ptr<const NeighbourList> gathered_;  // set for ListSums::kLanes
};

class LeafMarch {
 public:
  LeafMarch(const ImplicitSurface& surface, const SampleGrid& grid,
            const EdgeSearchOptions& options, ListSums sums, CornerEmissions& corners,
            SliceMarchingCubes& march)
      : surface_(surface),
        grid_(grid),
        options_(options),
        sums_(sums),
        corners_(corners),
        march_(march) {}

  // Marches through the leaf's cells in the current slice.
  void operator()(const Node& leaf) const {
    const ListedField field(surface_, grid_, leaf.influence, sums_, corners_, march_.Summary());
    const auto value = [&](const GridIndex& corner) { return field.AtCorner(corner); };
    const auto search = [&](CrossedEdge& edge) { Search(field, edge); };
    for (int j = leaf.low[1]; j < std::min(leaf.low[1] + leaf.size, grid_.counts[1] - 1); ++j) {
      for (int i = leaf.low[0]; i < std::min(leaf.low[0] + leaf.size, grid_.counts[0] - 1); ++i) {
        march_.Cell(i, j, value, search);
      }
    }
  }

 private:
  void Search(const ListedField& field, CrossedEdge& edge) const {
    const EdgeLine line = MakeEdgeLine(grid_, edge);
    std::int64_t& evaluations = march_.Summary().edge_evaluations;
    if (options_.method == EdgeSearch::kBisection) {  // needs only signs
      edge.at = SearchCrossing(
          edge.from, edge.to, options_, [&](double t) { return field.At(line.At(t)); },
          evaluations);
      return;
    }
    const auto exact = [&](double t) {
      return surface_.Flattened(line.At(t), march_.Summary().emitter_evaluations);
    };
    edge.at = SearchCrossing(exact(0), exact(1), options_, exact, evaluations);
    evaluations += 2;
  }

  const ImplicitSurface& surface_;
  const SampleGrid& grid_;
  const EdgeSearchOptions& options_;
  ListSums sums_;
  CornerEmissions& corners_;
  SliceMarchingCubes& march_;
};

template <class Rule>
PolygonizeResult March(const Rule& rule, ListSums sums, bool cached, const ImplicitSurface& surface,
                       const SampleGrid& grid, const EdgeSearchOptions& options,
                       const RunContext& context) {
  SliceMarchingCubes march(grid);
  CornerEmissions corners(surface, grid, cached);
  Octree<Rule> octree(rule, surface, grid, corners, march.Summary());
  for (int k = 0; k + 1 < grid.counts[2]; ++k) {
    context.ThrowIfStopped();
    context.Report("polygonize", {}, static_cast<double>(k) / grid.counts[2]);
    march.NextLayer();
    octree.ForEachLeaf(k, LeafMarch(surface, grid, options, sums, corners, march));
  }
  return BuildMesh(grid, march.Take());
}

}  // namespace

EmitterCache::EmitterCache(const ImplicitSurface& surface, const SampleGrid& grid, int size)
    : surface_(surface),
      grid_(grid),
      size_(size),
      depths_(std::countr_zero(static_cast<unsigned>(size))),
      layers_(depths_ + 2) {}

EmitterCache::Kept& EmitterCache::At(const GridIndex& corner) {
  const int k = corner[2];
  Layer& layer =
      k == 0 ? layers_.back() : layers_[depths_ - std::countr_zero(static_cast<unsigned>(k))];
  if (layer.k != k) {
    layer.k = k;
    layer.corners.clear();
  }
  return layer.corners[corner[0] + std::int64_t{size_ + 1} * corner[1]];
}

void EmitterCache::Get(const GridIndex& corner, std::span<const std::int32_t> emitters,
                       std::span<double> values, std::int64_t& evaluations) {
  Kept& kept = At(corner);
  Kept fresh;
  std::vector<std::size_t> missing;  // indices into `emitters`
  std::size_t next = 0;              // index into kept.emitters
  for (std::size_t n = 0; n < emitters.size(); ++n) {
    while (next < kept.emitters.size() && kept.emitters[next] < emitters[n]) {
      ++next;
    }
    if (next < kept.emitters.size() && kept.emitters[next] == emitters[n]) {
      values[n] = kept.values[next];
    } else {
      missing.push_back(n);
      fresh.emitters.push_back(emitters[n]);
    }
  }
  if (missing.empty()) {
    return;
  }
  fresh.values.resize(missing.size());
  surface_.EmissionsAt(grid_.Corner(corner), fresh.emitters, fresh.values);
  evaluations += std::ssize(missing);
  for (std::size_t m = 0; m < missing.size(); ++m) {
    values[missing[m]] = fresh.values[m];
  }
  Insert(fresh, kept);
}

void EmitterCache::Insert(const Kept& fresh, Kept& kept) const {
  Kept both;
  both.emitters.reserve(kept.emitters.size() + fresh.emitters.size());
  both.values.reserve(both.emitters.capacity());
  std::size_t next = 0;  // index into fresh.emitters
  const auto append_fresh = [&] {
    both.emitters.push_back(fresh.emitters[next]);
    both.values.push_back(fresh.values[next++]);
  };
  for (std::size_t n = 0; n < kept.emitters.size(); ++n) {
    while (next < fresh.emitters.size() && fresh.emitters[next] < kept.emitters[n]) {
      append_fresh();
    }
    both.emitters.push_back(kept.emitters[n]);
    both.values.push_back(kept.values[n]);
  }
  while (next < fresh.emitters.size()) {
    append_fresh();
  }
  kept = std::move(both);
}

PolygonizeResult MarchOctree(const McOctree& octree, const ImplicitSurface& surface,
                             const SampleGrid& grid, const EdgeSearchOptions& options,
                             const RunContext& context) {
  return March(McRule(octree, surface), octree.sums, false, surface, grid, options, context);
}

PolygonizeResult MarchOctree(const MinMaxOctree& octree, const ImplicitSurface& surface,
                             const SampleGrid& grid, const EdgeSearchOptions& options,
                             const RunContext& context) {
  const bool cached = octree.minimum == EmitterMinimum::kCachedCorners;
  return March(MinMaxRule(octree, surface), octree.sums, cached, surface, grid, options, context);
}

}  // namespace semblance::surfaces
