// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/emitters/emitter_search.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>
#include <utility>

namespace semblance::surfaces {
namespace {

constexpr int kLanes = EmissionUpperBound::kLanes, kLeaf = 4;
static_assert(kLanes == FlatEmitterLanes::kLanes && kLanes == DistanceEmitterLanes::kLanes);
// Emitters are summed by multipoles only if this errs less than this share of leaving them out. A
// larger share spends more of the error budget on multipoles (docs/explanation/mathematics.md, "The
// far field").
constexpr double kMaxErrorShare = 0.25;

// Builds the tree. A leaf begins at a multiple of 4, and a larger node at a multiple of the lane
// count. Each block of 16, 64 or 256 emitters that begins at a multiple of its size is a node, so
// that it can have multipoles.
class TreeBuilder {
 public:
  // Reorders the emitters into the tree's order.
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

  // Partitions along the longest side of the centroids' box and returns the middle.
  int Halve(int begin, int end) {
    Box3 centroids;
    for (int n = begin; n < end; ++n) {
      centroids.extend(items_[n].centroid);
    }
    int axis = 0;
    centroids.sizes().maxCoeff(&axis);
    int unit = kLeaf;  // size that the left half is a multiple of
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
    constexpr int kExactSize = 256;  // larger nodes use their children's bounds, which are hardly
                                     // looser
    if (node.end - node.begin > kExactSize) {
      node.lowest_mm =
          std::min(LowestPlane(nodes_[node.left], node), LowestPlane(nodes_[node.right], node));
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
  // A lower bound of the part's planes relative to the center of the node's box.
  static double LowestPlane(const EmitterNode& part, const EmitterNode& node) {
    const Vec3 to = part.box.center() - node.box.center();
    return part.lowest_mm +
           part.normals.min().cwiseProduct(to).cwiseMin(part.normals.max().cwiseProduct(to)).sum();
  }

  std::vector<Item> items_;
  std::vector<EmitterNode> nodes_;
};

// An upper bound of the height of points in p +- half over the planes of the node's emitters.
double MostHeight(const EmitterNode& node, const Vec3& p, const Vec3& half) {
  const Vec3 &low = node.normals.min(), &high = node.normals.max();
  const Vec3 from = p - node.box.center();
  const double most = low.cwiseProduct(from).cwiseMax(high.cwiseProduct(from)).sum() +
                      low.cwiseAbs().cwiseMax(high.cwiseAbs()).dot(half);
  return most - node.lowest_mm +
         kRounding * ((from.cwiseAbs() + half).sum() + std::abs(node.lowest_mm));
}

// Descends from the root in the order of node numbers. It stops at nodes for which done(node) is
// true, and visits the other nodes of at most `few` emitters.
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

// The multipoles of the four parts of a node of up to 4 * part emitters.
MultipoleLanes MakeMultipoleLanes(std::span<const EmitterTriangle> emitters, std::size_t part,
                                  int power) {
  MultipoleLanes lanes;
  for (int lane = 0; lane * part < emitters.size(); ++lane) {
    const std::size_t begin = lane * part, count = std::min(part, emitters.size() - begin);
    lanes.Set(lane, MakeMultipole(emitters.subspan(begin, count), power - 3), power);
  }
  return lanes;
}

// A quarter of 16, 64 or 256 if the node is an aligned block of that size, else 0.
int MultipolePart(const EmitterNode& node, int emitters) {
  int block = 16;
  while (block < node.end - node.begin) {
    block *= 4;
  }
  const bool whole = node.begin % block == 0 && node.end == std::min(node.begin + block, emitters);
  return whole && block <= 256 ? block / 4 : 0;
}

// Sets the smallest of some numbers >= 0 to 0, as long as their sum stays within `budget`, and
// returns the sum. Groups the numbers by powers of 2 instead of sorting them.
double DropWithinBudget(double budget, std::vector<double>& errors) {
  if (!(budget > 0)) {
    return 0;
  }
  constexpr int kPowers = 40;
  const auto exponent = [](double value) {
    return static_cast<int>(std::bit_cast<std::uint64_t>(value) >> 52);
  };
  const int first = exponent(budget);
  std::array<double, kPowers> sums{};  // [n]: sum of numbers of about budget / 2^n
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
    const int part = MultipolePart(node, static_cast<int>(emitters.size()));
    multipoles_of_.push_back(part > 0 ? static_cast<int>(multipoles_.size()) : -1);
    if (part > 0) {
      const auto of_node = std::span(emitters).subspan(node.begin, node.end - node.begin);
      multipoles_.push_back(MakeMultipoleLanes(of_node, part, options_.falloff.whole));
    }
  }
}

NeighbourList EmitterSearch::InBox(const Box3& box, FarField far, double& left_out) const {
  const QueryBox query{box, box.center(), 0.5 * box.sizes(),
                       far == FarField::kMultipole && !multipoles_.empty()};
  // The error allowed per node. The first guess nearly always suffices.
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

// Finds nodes that can be left out or summed by multipoles with an error of at most `least` each.
EmitterSearch::Pruned EmitterSearch::Descend(const QueryBox& query, double least) const {
  Pruned pruned;
  const int few = (query.by_multipoles ? 2 : 4) * kLanes;
  DescendTree(
      nodes_, few, [&](int n) { return Prune(n, query, least, pruned); },
      [&pruned](int n) { pruned.rest.push_back(n); });
  return pruned;
}

// Returns false if the node emits too much for either.
bool EmitterSearch::Prune(int node, const QueryBox& query, double least, Pruned& pruned) const {
  constexpr double kNearNode = 4;  // times the tail error; nodes that emit more are too near for
                                   // multipoles (saves the bound)
  const double most = UpperBoundOfNode(nodes_[node], query);
  if (most <= least) {
    pruned.error += most;
    return true;
  }
  const bool may = query.by_multipoles && most < kNearNode * options_.tail_error;
  const double error = may ? MultipoleError(node, query) : most;
  if (error > least || error > kMaxErrorShare * most) {
    return false;
  }
  pruned.error += error;
  pruned.multipoles.push_back(multipoles_of_[node]);
  return true;
}

// An upper bound of the joint emission of a node's emitters in the box.
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

// The error bound of the node's multipoles; infinite if it has none.
double EmitterSearch::MultipoleError(int node, const QueryBox& query) const {
  const int lanes = multipoles_of_[node];
  return lanes < 0
             ? std::numeric_limits<double>::infinity()
             : multipoles_[lanes].ErrorInBox(query.center, query.half, options_.falloff.whole);
}

void EmitterSearch::AppendCandidates(int node, const QueryBox& query,
                                     std::vector<Candidate>& candidates) const {
  constexpr double kNegligible = 0.01, kTooNear = 32;  // times the tail error: outside these,
                                                       // multipoles do not pay
  const EmitterNode& of = nodes_[node];
  const std::size_t first = candidates.size();
  const double most = AppendRuns(of, query, candidates);
  const double tail_error = options_.tail_error;
  if (!query.by_multipoles || most < kNegligible * tail_error || most > kTooNear * tail_error) {
    return;
  }
  const double error = MultipoleError(node, query);
  if (error < kMaxErrorShare * most) {
    candidates.resize(first);
    candidates.push_back({of.begin, of.end, error, multipoles_of_[node]});
  }
}

// Appends the node's runs and returns an upper bound of their joint emission.
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

// Leaves out candidates, or sums them by multipoles, within the remaining tail error.
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

}  // namespace semblance::surfaces
