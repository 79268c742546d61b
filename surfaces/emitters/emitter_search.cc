// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/emitters/emitter_search.h"

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>
#include <variant>

namespace semblance {
namespace {

std::vector<EmitterReach> MakeReaches(const std::vector<EmitterTriangle>& emitters) {
  constexpr std::size_t kLanes = EmitterReach::kLanes;
  std::vector<EmitterReach> batches((emitters.size() + kLanes - 1) / kLanes);
  for (std::size_t e = 0; e < emitters.size(); ++e) {
    batches[e / kLanes].Set(static_cast<int>(e % kLanes), emitters[e]);
  }
  return batches;
}

// Of the four parts of a node of up to 4 * part emitters.
ClusterBatch ClustersOf(std::span<const EmitterTriangle> emitters, std::size_t part, int power) {
  ClusterBatch batch;
  for (int lane = 0; lane * part < emitters.size(); ++lane) {
    const std::size_t begin = lane * part, count = std::min(part, emitters.size() - begin);
    batch.Set(lane, ClusterOf(emitters.subspan(begin, count), power - 3), power);
  }
  return batch;
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

// Takes what together is at most `budget` from the least of some numbers >= 0: sets each of these
// to 0 and returns their sum. By powers of 2, so that nothing is sorted.
double TakeLeast(double budget, std::vector<double>& most) {
  if (!(budget > 0)) {
    return 0;
  }
  constexpr int kPowers = 40;
  const auto exponent = [](double value) {
    return static_cast<int>(std::bit_cast<std::uint64_t>(value) >> 52);
  };
  const int first = exponent(budget);
  std::array<double, kPowers> sums{};  // [n]: of numbers of about budget / 2^n
  for (const double value : most) {
    const int power = first - exponent(value);
    if (power >= 0) {
      sums[std::min(power, kPowers - 1)] += value;
    }
  }
  int last = kPowers;
  double taken = 0;
  while (last > 0 && taken + sums[last - 1] <= budget) {
    taken += sums[--last];
  }
  for (double& value : most) {
    value = first - exponent(value) >= last ? 0 : value;
  }
  return taken;
}

}  // namespace

EmitterSearch::EmitterSearch(std::vector<EmitterTriangle>& emitters, const Kernel& kernel,
                             double tail_error)
    : tree_(emitters), reaches_(MakeReaches(emitters)), tail_error_(tail_error) {
  const auto* flat = std::get_if<FlatKernel>(&kernel);
  if (flat == nullptr || !flat->Batches() || tail_error == 0) {
    return;
  }
  power_ = flat->Power();
  for (const EmitterNode& node : tree_.nodes()) {
    const int part = PartOf(node, static_cast<int>(emitters.size()));
    clusters_of_.push_back(part > 0 ? static_cast<int>(clusters_.size()) : -1);
    if (part > 0) {
      clusters_.push_back(
          ClustersOf(std::span(emitters).subspan(node.begin, node.end - node.begin), part, power_));
    }
  }
}

double EmitterSearch::ClusterError(int node, const Place& place) const {
  const int batch = clusters_of_[node];
  return batch < 0 ? std::numeric_limits<double>::infinity()
                   : clusters_[batch].ErrorInBox(place.center, place.half, power_);
}

void EmitterSearch::AppendCandidates(int node, int run, const ReachFall& fall, const Place& place,
                                     std::vector<Candidate>& candidates) const {
  constexpr double kLittle = 0.01, kNear = 32;  // of the tail error: clusters are of no use
  const EmitterNode& of = tree_.nodes()[node];
  const std::size_t first = candidates.size();
  const double most = AppendRuns(of, run, fall, place, candidates);
  if (!place.clustered || most < kLittle * tail_error_ || most > kNear * tail_error_) {
    return;
  }
  const double error = ClusterError(node, place);
  if (error < kWorth * most) {
    candidates.resize(first);
    candidates.push_back({of.begin, of.end, error, clusters_of_[node]});
  }
}

// Returns the most that all of them emit.
double EmitterSearch::AppendRuns(const EmitterNode& node, int run, const ReachFall& fall,
                                 const Place& place, std::vector<Candidate>& candidates) const {
  constexpr int kBatch = EmitterReach::kLanes;
  EmitterReach::Lanes most;
  double sum = 0;
  for (int batch = node.begin; batch < node.end; batch += kBatch) {
    MostInBox(reaches_[batch / kBatch], place.center, place.half, fall, most);
    for (int begin = batch; begin < std::min(batch + kBatch, node.end); begin += run) {
      const int end = std::min(begin + run, node.end);
      const auto lane = most.begin() + (begin - batch);
      candidates.push_back({begin, end, std::accumulate(lane, lane + (end - begin), 0.0)});
      sum += candidates.back().error;
    }
  }
  return sum;
}

// Leaves out, or sums by clusters, what together errs by at most what is left of the tail error.
NearEmitters EmitterSearch::Choose(const std::vector<Candidate>& candidates, int run,
                                   Settled settled, double& left_out) const {
  std::vector<double> errors;
  for (const Candidate& candidate : candidates) {
    errors.push_back(candidate.error);
  }
  left_out = settled.error + TakeLeast(tail_error_ - settled.error, errors);
  NearEmitters near{{}, std::move(settled.clusters), {}};
  for (std::size_t n = 0; n < candidates.size(); ++n) {
    const Candidate& candidate = candidates[n];
    if (errors[n] > 0) {
      for (int begin = candidate.begin; begin < candidate.end; begin += run) {
        near.runs.push_back(begin / run);
      }
    } else if (candidate.clusters >= 0) {
      near.clusters.push_back(candidate.clusters);
    }
  }
  return near;
}

}  // namespace semblance
