// SPDX-License-Identifier: GPL-3.0-or-later
// A binary tree over emitters, for leaving out whole branches whose emission is too small to count.
// For implicit_surface.cc alone.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "surfaces/emitters/distance_batch.h"
#include "surfaces/emitters/emitter_triangle.h"
#include "surfaces/emitters/flat_batch.h"

namespace semblance {

// Bounds over a run of emitters.
struct EmitterNode {
  Box3 box;  // of the triangles and of where they are moved to
  Box3 normals;
  double lowest_mm =
      std::numeric_limits<double>::infinity();  // over planes through the box's center
  int begin = 0, end = 0;                       // of emitters
  int left = -1, right = -1;                    // -1 in a leaf
  double gain = 0;                              // sum over its emitters
  double greatest_gain = 0;

  void Add(const EmitterTriangle& t) {
    for (const Vec3& corner : {t.a, t.b, t.c}) {
      box.extend(corner).extend(corner + t.moved);
    }
    normals.extend(t.normal);
    gain += t.most_gain;
    greatest_gain = std::max(greatest_gain, t.most_gain);
  }
  void Add(const EmitterNode& part) {
    box.extend(part.box);
    normals.extend(part.normals);
    gain += part.gain;
    greatest_gain = std::max(greatest_gain, part.greatest_gain);
  }
  // Not more than any of a part's planes is over this box's center.
  double LowestOf(const EmitterNode& part) const {
    const Vec3 to = part.box.center() - box.center();
    return part.lowest_mm +
           part.normals.min().cwiseProduct(to).cwiseMin(part.normals.max().cwiseProduct(to)).sum();
  }
  // Not less than the height of any point within half of p, each way, over the plane of any of its
  // emitters.
  double MostHeight(const Vec3& p, const Vec3& half) const {
    const Vec3 from = p - box.center();
    const double most =
        normals.min().cwiseProduct(from).cwiseMax(normals.max().cwiseProduct(from)).sum() +
        normals.min().cwiseAbs().cwiseMax(normals.max().cwiseAbs()).dot(half);
    return most - lowest_mm + kRounding * ((from.cwiseAbs() + half).sum() + std::abs(lowest_mm));
  }
};

// Each leaf begins at a multiple of four, nodes of more than four at one of the batches' lanes.
// Each 16, 64 or 256 that begin at a multiple of that are a node.
class EmitterTree {
 public:
  // Puts the emitters in the tree's order.
  explicit EmitterTree(std::vector<EmitterTriangle>& emitters) {
    std::vector<Item> items(emitters.size());
    for (std::size_t e = 0; e < items.size(); ++e) {
      items[e] = {emitters[e].centroid, static_cast<std::int32_t>(e)};
    }
    Split(items, 0, static_cast<int>(items.size()));
    std::vector<EmitterTriangle> ordered;
    ordered.reserve(items.size());
    for (const Item& item : items) {
      ordered.push_back(emitters[item.emitter]);
    }
    emitters = std::move(ordered);
    for (auto node = nodes_.rbegin(); node != nodes_.rend(); ++node) {  // children first
      Enclose(emitters, *node);
    }
  }

  const std::vector<EmitterNode>& nodes() const { return nodes_; }

  // Goes down from the root in a fixed order, by the nodes' numbers: no further where done(node),
  // and visits those of at most `few` emitters where not.
  template <class Done, class Visit>
  void Descend(int few, const Done& done, const Visit& visit) const {
    std::array<int, 64> stack;
    int size = 0;
    stack[size++] = 0;
    while (size > 0) {
      const int n = stack[--size];
      const EmitterNode& node = nodes_[n];
      if (done(n)) {
        continue;
      }
      if (node.end - node.begin <= few) {
        visit(n);
      } else {
        stack[size++] = node.right;
        stack[size++] = node.left;
      }
    }
  }

 private:
  static constexpr int kBatch = FlatBatch::kLanes, kLeaf = 4;
  static_assert(kBatch == DistanceBatch::kLanes);

  struct Item {
    Vec3 centroid;
    std::int32_t emitter;
  };

  int Split(std::vector<Item>& items, int begin, int end) {
    const int self = static_cast<int>(nodes_.size());
    nodes_.emplace_back();
    nodes_[self].begin = begin;
    nodes_[self].end = end;
    if (end - begin <= kLeaf) {
      return self;
    }
    Box3 centroids;
    for (int n = begin; n < end; ++n) {
      centroids.extend(items[n].centroid);
    }
    int axis = 0;
    centroids.sizes().maxCoeff(&axis);
    int unit = kLeaf;  // which the left half fills
    for (const int block : {kBatch, 16, 64, 256}) {
      unit = end - begin > block ? block : unit;
    }
    const int middle = begin + ((end - begin) / 2 + unit - 1) / unit * unit;
    std::nth_element(
        items.begin() + begin, items.begin() + middle, items.begin() + end,
        [axis](const Item& a, const Item& b) { return a.centroid[axis] < b.centroid[axis]; });
    const int left = Split(items, begin, middle), right = Split(items, middle, end);
    nodes_[self].left = left;
    nodes_[self].right = right;
    return self;
  }

  void Enclose(const std::vector<EmitterTriangle>& emitters, EmitterNode& node) const {
    if (node.left < 0) {
      for (int e = node.begin; e < node.end; ++e) {
        node.Add(emitters[e]);
      }
    } else {
      node.Add(nodes_[node.left]);
      node.Add(nodes_[node.right]);
    }
    if (node.end - node.begin > 256) {  // one by one it would not be much better
      node.lowest_mm =
          std::min(node.LowestOf(nodes_[node.left]), node.LowestOf(nodes_[node.right]));
      return;
    }
    for (int e = node.begin; e < node.end; ++e) {
      const EmitterTriangle& t = emitters[e];
      node.lowest_mm = std::min(node.lowest_mm, t.normal.dot(t.a - node.box.center()));
    }
  }

  std::vector<EmitterNode> nodes_;
};

}  // namespace semblance
