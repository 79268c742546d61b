// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/emitters/emitter_search.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>
#include <utility>

namespace semblance {
namespace {

constexpr int kLanes = EmissionUpperBound::kLanes, kLeaf = 4;
static_assert(kLanes == FlatEmitterLanes::kLanes && kLanes == DistanceEmitterLanes::kLanes);
// Multipoles are worth their budget where they err so much less than to leave the emitters out.
constexpr double kWorth = 0.25;

// Builds the tree: a leaf begins at a multiple of four, a node of more than four emitters at one of
// the lanes'. Each 16, 64 or 256 that begin at a multiple of that are a node.
class TreeBuilder {
 public:
  // Puts the emitters in the tree's order.
  static std::vector<EmitterNode> Build(std::vector<EmitterTriangle>& emitters) {
    TreeBuilder builder(emitters);
    builder.Split(0, static_cast<int>(emitters.size()));
    builder.Order(emitters);
    for (auto node = builder.nodes_.rbegin(); node != builder.nodes_.rend(); ++node) {
      builder.Enclose(emitters, *node);  // children first
    }
    return std::move(builder.nodes_);
  }

 private:
  struct Item {
    Vec3 centroid;
    std::int32_t emitter;
  };

  explicit TreeBuilder(const std::vector<EmitterTriangle>& emitters) : items_(emitters.size()) {
    for (std::size_t e = 0; e < items_.size(); ++e) {
      items_[e] = {emitters[e].centroid, static_cast<std::int32_t>(e)};
    }
  }

  int Split(int begin, int end) {
    const int self = static_cast<int>(nodes_.size());
    nodes_.emplace_back();
    nodes_[self].begin = begin;
    nodes_[self].end = end;
    if (end - begin <= kLeaf) {
      return self;
    }
    const int middle = Halve(begin, end);
    const int left = Split(begin, middle), right = Split(middle, end);
    nodes_[self].left = left;
    nodes_[self].right = right;
    return self;
  }

  // Partitions along the longest side of the centroids' box; returns where.
  int Halve(int begin, int end) {
    Box3 centroids;
    for (int n = begin; n < end; ++n) {
      centroids.extend(items_[n].centroid);
    }
    int axis = 0;
    centroids.sizes().maxCoeff(&axis);
    int unit = kLeaf;  // which the left half fills
    for (const int block : {kLanes, 16, 64, 256}) {
      unit = end - begin > block ? block : unit;
    }
    const int middle = begin + ((end - begin) / 2 + unit - 1) / unit * unit;
    std::nth_element(
        items_.begin() + begin, items_.begin() + middle, items_.begin() + end,
        [axis](const Item& a, const Item& b) { return a.centroid[axis] < b.centroid[axis]; });
    return middle;
  }

  void Order(std::vector<EmitterTriangle>& emitters) const {
    std::vector<EmitterTriangle> ordered;
    ordered.reserve(items_.size());
    for (const Item& item : items_) {
      ordered.push_back(emitters[item.emitter]);
    }
    emitters = std::move(ordered);
  }

  void Enclose(const std::vector<EmitterTriangle>& emitters, EmitterNode& node) const {
    if (node.left < 0) {
      for (int e = node.begin; e < node.end; ++e) {
        Add(emitters[e], node);
      }
    } else {
      Add(nodes_[node.left], node);
      Add(nodes_[node.right], node);
    }
    constexpr int kMany = 256;  // one by one it would not be much better
    if (node.end - node.begin > kMany) {
      node.lowest_mm =
          std::min(LowestOf(nodes_[node.left], node), LowestOf(nodes_[node.right], node));
      return;
    }
    for (int e = node.begin; e < node.end; ++e) {
      const EmitterTriangle& t = emitters[e];
      node.lowest_mm = std::min(node.lowest_mm, t.normal.dot(t.a - node.box.center()));
    }
  }

  static void Add(const EmitterTriangle& t, EmitterNode& node) {
    for (const Vec3& corner : {t.a, t.b, t.c}) {
      node.box.extend(corner).extend(corner + t.moved);
    }
    node.normals.extend(t.normal);
    node.gain += t.most_gain;
    node.greatest_gain = std::max(node.greatest_gain, t.most_gain);
  }
  static void Add(const EmitterNode& part, EmitterNode& node) {
    node.box.extend(part.box);
    node.normals.extend(part.normals);
    node.gain += part.gain;
    node.greatest_gain = std::max(node.greatest_gain, part.greatest_gain);
  }
  // Not more than any of a part's planes is over the center of the node's box.
  static double LowestOf(const EmitterNode& part, const EmitterNode& node) {
    const Vec3 to = part.box.center() - node.box.center();
    return part.lowest_mm +
           part.normals.min().cwiseProduct(to).cwiseMin(part.normals.max().cwiseProduct(to)).sum();
  }

  std::vector<Item> items_;
  std::vector<EmitterNode> nodes_;
};

// Not less than the height of any point within half of p, each way, over the plane of any of the
// node's emitters.
double MostHeight(const EmitterNode& node, const Vec3& p, const Vec3& half) {
  const Vec3 &low = node.normals.min(), &high = node.normals.max();
  const Vec3 from = p - node.box.center();
  const double most = low.cwiseProduct(from).cwiseMax(high.cwiseProduct(from)).sum() +
                      low.cwiseAbs().cwiseMax(high.cwiseAbs()).dot(half);
  return most - node.lowest_mm +
         kRounding * ((from.cwiseAbs() + half).sum() + std::abs(node.lowest_mm));
}

// Goes down from the root in a fixed order, by the nodes' numbers: no further where done(node), and
// visits those of at most `few` emitters where not.
template <class Done, class Visit>
void DescendTree(std::span<const EmitterNode> nodes, int few, const Done& done,
                 const Visit& visit) {
  std::array<int, 64> stack;
  int size = 0;
  stack[size++] = 0;
  while (size > 0) {
    const int n = stack[--size];
    const EmitterNode& node = nodes[n];
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

std::vector<EmissionUpperBound> MakeUpperBounds(const std::vector<EmitterTriangle>& emitters) {
  std::vector<EmissionUpperBound> bounds((emitters.size() + kLanes - 1) / kLanes);
  for (std::size_t e = 0; e < emitters.size(); ++e) {
    bounds[e / kLanes].Set(static_cast<int>(e % kLanes), emitters[e]);
  }
  return bounds;
}

// Of the four parts of a node of up to 4 * part emitters.
MultipoleLanes MultipolesOf(std::span<const EmitterTriangle> emitters, std::size_t part,
                            int power) {
  MultipoleLanes lanes;
  for (int lane = 0; lane * part < emitters.size(); ++lane) {
    const std::size_t begin = lane * part, count = std::min(part, emitters.size() - begin);
    lanes.Set(lane, MultipoleOf(emitters.subspan(begin, count), power - 3), power);
  }
  return lanes;
}

// A quarter of 16, 64 or 256, if the node is all emitters from a multiple of that on; else 0.
int PartOf(const EmitterNode& node, int emitters) {
  int block = 16;
  while (block < node.end - node.begin) {
    block *= 4;
  }
  const bool whole = node.begin % block == 0 && node.end == std::min(node.begin + block, emitters);
  return whole && block <= 256 ? block / 4 : 0;
}

// Drops, smallest first, what together is at most `budget` of some numbers >= 0: sets each of these
// to 0 and returns their sum. By powers of 2, so that nothing is sorted.
double DropWithinBudget(double budget, std::vector<double>& errors) {
  if (!(budget > 0)) {
    return 0;
  }
  constexpr int kPowers = 40;
  const auto exponent = [](double value) {
    return static_cast<int>(std::bit_cast<std::uint64_t>(value) >> 52);
  };
  const int first = exponent(budget);
  std::array<double, kPowers> sums{};  // [n]: of numbers of about budget / 2^n
  for (const double value : errors) {
    const int power = first - exponent(value);
    if (power >= 0) {
      sums[std::min(power, kPowers - 1)] += value;
    }
  }
  int last = kPowers;
  double dropped = 0;
  while (last > 0 && dropped + sums[last - 1] <= budget) {
    dropped += sums[--last];
  }
  for (double& value : errors) {
    value = first - exponent(value) >= last ? 0 : value;
  }
  return dropped;
}

}  // namespace

EmitterSearch::EmitterSearch(std::vector<EmitterTriangle>& emitters,
                             const EmitterSearchOptions& options)
    : options_(options),
      nodes_(TreeBuilder::Build(emitters)),
      upper_bounds_(MakeUpperBounds(emitters)) {
  if (options.multipoles && options.tail_error > 0) {
    MakeMultipoles(emitters);
  }
}

void EmitterSearch::MakeMultipoles(const std::vector<EmitterTriangle>& emitters) {
  for (const EmitterNode& node : nodes_) {
    const int part = PartOf(node, static_cast<int>(emitters.size()));
    multipoles_of_.push_back(part > 0 ? static_cast<int>(multipoles_.size()) : -1);
    if (part > 0) {
      const auto of_node = std::span(emitters).subspan(node.begin, node.end - node.begin);
      multipoles_.push_back(MultipolesOf(of_node, part, options_.falloff.whole));
    }
  }
}

NeighbourList EmitterSearch::InBox(const Box3& box, FarField far, double& left_out) const {
  const QueryBox query{box, box.center(), 0.5 * box.sizes(),
                       far == FarField::kMultipole && !multipoles_.empty()};
  // Of the tail error, for one node: a first guess that nearly always does.
  double least = (query.by_multipoles ? 1.0 / 512 : 1.0 / 128) * options_.tail_error;
  Pruned pruned;
  do {
    pruned = Descend(query, least);
    least /= 8;
  } while (pruned.error > 0.5 * options_.tail_error);
  std::vector<Candidate> candidates;
  for (const int node : pruned.rest) {
    AppendCandidates(node, query, candidates);
  }
  return Choose(candidates, std::move(pruned), left_out);
}

// Nodes that may be left out, or summed by multipoles, at an error of at most `least` each.
EmitterSearch::Pruned EmitterSearch::Descend(const QueryBox& query, double least) const {
  Pruned pruned;
  const int few = (query.by_multipoles ? 2 : 4) * kLanes;
  DescendTree(
      nodes_, few, [&](int n) { return Prune(n, query, least, pruned); },
      [&pruned](int n) { pruned.rest.push_back(n); });
  return pruned;
}

// False where the node emits too much for both.
bool EmitterSearch::Prune(int node, const QueryBox& query, double least, Pruned& pruned) const {
  constexpr double kHopeless = 4;  // nodes that emit more are too near for multipoles
  const double most = UpperBoundOfNode(nodes_[node], query);
  if (most <= least) {
    pruned.error += most;
    return true;
  }
  const bool may = query.by_multipoles && most < kHopeless * options_.tail_error;
  const double error = may ? MultipoleError(node, query) : most;
  if (error > least || error > kWorth * most) {
    return false;
  }
  pruned.error += error;
  pruned.multipoles.push_back(multipoles_of_[node]);
  return true;
}

// The most that a node's emitters together give in the box.
double EmitterSearch::UpperBoundOfNode(const EmitterNode& node, const QueryBox& query) const {
  const double height = MostHeight(node, query.center, query.half);
  if (height <= 0) {
    return 0;
  }
  const double distance2 = node.box.squaredExteriorDistance(query.box);
  if (distance2 <= 0) {
    return std::numeric_limits<double>::infinity();
  }
  const double share = options_.falloff.Most(distance2, height);
  const bool cut = node.greatest_gain * share < (1 - kRounding) * options_.falloff.cut;
  return cut ? 0 : node.gain * share;
}

// Infinity where the node has no multipoles.
double EmitterSearch::MultipoleError(int node, const QueryBox& query) const {
  const int lanes = multipoles_of_[node];
  return lanes < 0
             ? std::numeric_limits<double>::infinity()
             : multipoles_[lanes].ErrorInBox(query.center, query.half, options_.falloff.whole);
}

void EmitterSearch::AppendCandidates(int node, const QueryBox& query,
                                     std::vector<Candidate>& candidates) const {
  constexpr double kLittle = 0.01, kNear = 32;  // of the tail error: multipoles are of no use
  const EmitterNode& of = nodes_[node];
  const std::size_t first = candidates.size();
  const double most = AppendRuns(of, query, candidates);
  const double tail_error = options_.tail_error;
  if (!query.by_multipoles || most < kLittle * tail_error || most > kNear * tail_error) {
    return;
  }
  const double error = MultipoleError(node, query);
  if (error < kWorth * most) {
    candidates.resize(first);
    candidates.push_back({of.begin, of.end, error, multipoles_of_[node]});
  }
}

// Returns the most that all of them emit.
double EmitterSearch::AppendRuns(const EmitterNode& node, const QueryBox& query,
                                 std::vector<Candidate>& candidates) const {
  EmissionUpperBound::Lanes most;
  double sum = 0;
  for (int eight = node.begin; eight < node.end; eight += kLanes) {
    UpperBoundInBox(upper_bounds_[eight / kLanes], query.center, query.half, options_.falloff,
                    most);
    for (int begin = eight; begin < std::min(eight + kLanes, node.end); begin += options_.run) {
      const int end = std::min(begin + options_.run, node.end);
      const auto lane = most.begin() + (begin - eight);
      candidates.push_back({begin, end, std::accumulate(lane, lane + (end - begin), 0.0)});
      sum += candidates.back().error;
    }
  }
  return sum;
}

// Leaves out, or sums by multipoles, what together errs by at most what is left of the tail error.
NeighbourList EmitterSearch::Choose(const std::vector<Candidate>& candidates, Pruned pruned,
                                    double& left_out) const {
  std::vector<double> errors;
  for (const Candidate& candidate : candidates) {
    errors.push_back(candidate.error);
  }
  left_out = pruned.error + DropWithinBudget(options_.tail_error - pruned.error, errors);
  NeighbourList near{{}, std::move(pruned.multipoles), {}};
  for (std::size_t n = 0; n < candidates.size(); ++n) {
    const Candidate& candidate = candidates[n];
    if (errors[n] > 0) {
      for (int begin = candidate.begin; begin < candidate.end; begin += options_.run) {
        near.runs.push_back(begin / options_.run);
      }
    } else if (candidate.multipoles >= 0) {
      near.multipoles.push_back(candidate.multipoles);
    }
  }
  return near;
}

}  // namespace semblance
