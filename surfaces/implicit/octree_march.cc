// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/implicit/octree_march.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <numeric>

#include "surfaces/marching/slice_marching_cubes.h"

namespace semblance {
namespace {

using Emitters = std::vector<std::int32_t>;

// The emitters that a volume has to sum, and the most that all others together add in it.
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
};

// How the two octrees choose what a node lists and whether it is divided.
class McRule {
 public:
  McRule(const McOctree& octree, const ImplicitSurface& surface) : surface_(surface) {
    for (std::int32_t e = 0; e < surface.EmitterCount(); ++e) {
      boxes_.push_back(surface.InfluenceBox(e, octree.influence));
    }
  }

  void Set(Node& node, const Influence& parent, const Box3& box, PolygonizeSummary& summary) const {
    Emitters dropped;
    for (const std::int32_t e : parent.emitters) {
      (boxes_[e].intersects(box) ? node.influence.emitters : dropped).push_back(e);
    }
    std::vector<EmissionBounds> bounds(dropped.size());
    surface_.BoundsIn(box, dropped, bounds);
    summary.bound_evaluations += static_cast<std::int64_t>(dropped.size());
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
      : least_emission_(octree.least_emission), surface_(surface) {}

  void Set(Node& node, const Influence& parent, const Box3& box, PolygonizeSummary& summary) const {
    std::vector<EmissionBounds> bounds(parent.emitters.size());
    surface_.BoundsIn(box, parent.emitters, bounds);
    summary.bound_evaluations += static_cast<std::int64_t>(bounds.size());
    double least = 0, most = 0;
    node.influence.slack = parent.slack;
    for (std::size_t n = 0; n < bounds.size(); ++n) {
      if (bounds[n].most <= 0) {
        continue;
      }
      if (bounds[n].most < least_emission_) {
        node.influence.slack += bounds[n].most;
        continue;
      }
      node.influence.emitters.push_back(parent.emitters[n]);
      least += bounds[n].least;
      most += bounds[n].most;
    }
    node.divided =
        most + node.influence.slack + surface_.TailError() > 1 && least - surface_.TailError() < 1;
    node.empty = !node.divided;
  }

 private:
  double least_emission_;
  const ImplicitSurface& surface_;
};

// The octree as far as it meets the slice at hand: nodes are made when the march comes to them and
// freed when it has passed (thesis 3.2.2).
template <class Rule>
class Octree {
 public:
  Octree(const Rule& rule, const ImplicitSurface& surface, const SampleGrid& grid,
         PolygonizeSummary& summary)
      : rule_(rule), grid_(grid), summary_(summary) {
    const int cells = *std::max_element(grid.counts.begin(), grid.counts.end()) - 1;
    root_.size = static_cast<int>(std::bit_ceil(static_cast<unsigned>(cells)));
    Influence all;
    all.emitters.resize(surface.EmitterCount());
    std::iota(all.emitters.begin(), all.emitters.end(), 0);
    rule_.Set(root_, all, BoxOf(root_), summary_);
  }

  // Calls visit(leaf) for each leaf that meets slice k and is not empty. k must not fall.
  template <class Visit>
  void ForEachLeaf(int k, const Visit& visit) {
    Descend(root_, k, visit);
  }

 private:
  Box3 BoxOf(const Node& node) const {
    return {
        grid_.Corner(node.low[0], node.low[1], node.low[2]),
        grid_.Corner(node.low[0] + node.size, node.low[1] + node.size, node.low[2] + node.size)};
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
        rule_.Set(*child, node.influence, BoxOf(*child), summary_);
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
  PolygonizeSummary& summary_;
  Node root_;
};

// The field from a leaf's list, where that decides the sign; else the field itself.
class ListedField {
 public:
  ListedField(const ImplicitSurface& surface, const Influence& influence,
              PolygonizeSummary& summary)
      : surface_(surface), influence_(influence), summary_(summary) {}

  double operator()(const Vec3& p) const {
    constexpr double kRounding = 1e-9;
    const double share = surface_.SumShare() + kRounding;
    const double sum = surface_.SumOf(influence_.emitters, p);
    summary_.emitter_evaluations += static_cast<std::int64_t>(influence_.emitters.size());
    const bool inside = (1 - share) * sum - surface_.TailError() > 1;
    const bool outside = (1 + share) * (sum + influence_.slack) + surface_.TailError() < 1;
    return inside || outside ? surface_.Flatten(sum)
                             : surface_.Flattened(p, summary_.emitter_evaluations);
  }

 private:
  const ImplicitSurface& surface_;
  const Influence& influence_;
  PolygonizeSummary& summary_;
};

class LeafMarch {
 public:
  LeafMarch(const ImplicitSurface& surface, const SampleGrid& grid,
            const EdgeSearchOptions& options, SliceMarchingCubes& march)
      : surface_(surface), grid_(grid), options_(options), march_(march) {}

  // The cells of a leaf in the slice at hand.
  void operator()(const Node& leaf) const {
    const ListedField field(surface_, leaf.influence, march_.Summary());
    const auto value = [&](const GridIndex& corner) { return field(grid_.Corner(corner)); };
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
          edge.from, edge.to, options_, [&](double t) { return field(line.At(t)); }, evaluations);
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
  SliceMarchingCubes& march_;
};

template <class Rule>
PolygonizeResult March(const Rule& rule, const ImplicitSurface& surface, const SampleGrid& grid,
                       const EdgeSearchOptions& options, const RunContext& context) {
  SliceMarchingCubes march(grid);
  Octree<Rule> octree(rule, surface, grid, march.Summary());
  for (int k = 0; k + 1 < grid.counts[2]; ++k) {
    context.ThrowIfStopped();
    context.Report("polygonize", {}, static_cast<double>(k) / grid.counts[2]);
    march.GoUp();
    octree.ForEachLeaf(k, LeafMarch(surface, grid, options, march));
  }
  return MeshOf(grid, march.Take());
}

}  // namespace

PolygonizeResult MarchOctree(const McOctree& octree, const ImplicitSurface& surface,
                             const SampleGrid& grid, const EdgeSearchOptions& options,
                             const RunContext& context) {
  return March(McRule(octree, surface), surface, grid, options, context);
}

PolygonizeResult MarchOctree(const MinMaxOctree& octree, const ImplicitSurface& surface,
                             const SampleGrid& grid, const EdgeSearchOptions& options,
                             const RunContext& context) {
  return March(MinMaxRule(octree, surface), surface, grid, options, context);
}

}  // namespace semblance
