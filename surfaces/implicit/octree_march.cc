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

#include "surfaces/implicit/emitter_cache.h"
#include "surfaces/marching/slice_marching_cubes.h"

namespace semblance {
namespace {

constexpr double kSumRounding = 1e-9;  // share by which sums in two orders may differ

using Emitters = std::vector<std::int32_t>;

// The emitters that a volume has to sum, ascending, and the most that all others together add in
// it.
struct Influence {
  Emitters emitters;
  double slack = 0;
};

// A cube of cells, 2^depth along the grid's longest side, aligned with the grid's cells.
struct Node {
  GridIndex low{};
  int size = 0;  // cells, a power of 2
  Influence influence;
  bool empty = false;    // proven: no surface
  bool divided = false;  // else a leaf
  std::array<std::unique_ptr<Node>, 8> children;

  GridIndex Corner(int c) const {
    return {low[0] + (c & 1) * size, low[1] + (c >> 1 & 1) * size, low[2] + (c >> 2 & 1) * size};
  }
};

// Cells along the root's side.
int RootSize(const SampleGrid& grid) {
  const int cells = *std::max_element(grid.counts.begin(), grid.counts.end()) - 1;
  return static_cast<int>(std::bit_ceil(static_cast<unsigned>(cells)));
}

// Single emitters at corners of the octree, from the cache if there is one.
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

// How the two octrees choose what a node lists and whether it is divided.
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

  // Lists the emitters that give enough, and returns their bounds.
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

  // The least sum in the node where the least of each emitter that allows it is taken at one of the
  // node's corners (thesis 3.2.3).
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

// The octree as far as it meets the slice at hand: nodes are made when the march comes to them and
// freed when it has passed (thesis 3.2.2).
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
    rule_.Set(root_, all, BoxOf(root_), corners_, summary_);
  }

  // Calls visit(leaf) for each leaf that meets slice k and is not empty. k must not fall.
  template <class Visit>
  void ForEachLeaf(int k, const Visit& visit) {
    Descend(root_, k, visit);
  }

 private:
  Box3 BoxOf(const Node& node) const {
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
        rule_.Set(*child, node.influence, BoxOf(*child), corners_, summary_);
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

// The field from a leaf's list, where that decides the sign; else the field itself.
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
      return Decide(surface_.SumOf(*gathered_, p, summary_.emitter_evaluations), p);
    }
    summary_.emitter_evaluations += std::ssize(influence_.emitters);
    return Decide(surface_.SumOf(influence_.emitters, p), p);
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
  // From the sum of the listed emitters, and perhaps of others that count in the slack too.
  double Decide(double sum, const Vec3& p) const {
    const double share = surface_.SumShare() + kSumRounding;
    const bool inside = (1 - share) * sum - surface_.TailError() > 1;
    const bool outside = (1 + share) * (sum + influence_.slack) + surface_.TailError() < 1;
    return inside || outside ? surface_.Flatten(sum)
                             : surface_.Flattened(p, summary_.emitter_evaluations);
  }

  const ImplicitSurface& surface_;
  const SampleGrid& grid_;
  const Influence& influence_;
  CornerEmissions& corners_;
  PolygonizeSummary& summary_;
  std::shared_ptr<const NeighbourList> gathered_;  // where sums are in lanes
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

  // The cells of a leaf in the slice at hand.
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
    const EdgeLine line = LineOf(grid_, edge);
    std::int64_t& evaluations = march_.Summary().edge_evaluations;
    if (options_.method == EdgeSearch::kBisection) {  // asks for signs alone
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
    march.GoUp();
    octree.ForEachLeaf(k, LeafMarch(surface, grid, options, sums, corners, march));
  }
  return MeshOf(grid, march.Take());
}

}  // namespace

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

}  // namespace semblance
