// SPDX-License-Identifier: GPL-3.0-or-later
// Which emitters the points of a box have to sum, which may be summed together, and which left out.
// For the implicit surface alone.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "surfaces/emitters/emitter_cluster.h"
#include "surfaces/emitters/emitter_kernel.h"
#include "surfaces/emitters/emitter_reach.h"
#include "surfaces/emitters/emitter_tree.h"
#include "surfaces/emitters/near_emitters.h"

namespace semblance {

// Whether emitters far from a box are summed as clusters where their kernel has such.
enum class FarField { kNone, kClusters };

class EmitterSearch {
 public:
  // Puts the emitters in its order. tail_error: >= 0.
  EmitterSearch(std::vector<EmitterTriangle>& emitters, const Kernel& kernel, double tail_error);

  // For points of the box: what is left out and the errors of the clusters together are at most the
  // tail error; left_out: that sum.
  template <class EmitterKernel>
  NearEmitters InBox(const EmitterKernel& kernel, const Box3& box, FarField far,
                     double& left_out) const;

  std::span<const ClusterBatch> clusters() const { return clusters_; }

 private:
  struct Place {
    const Box3& box;
    Vec3 center, half;
    bool clustered;
  };
  // What a way down the tree settles, by how much that errs, and the nodes that it leaves.
  struct Settled {
    std::vector<std::int32_t> clusters;
    double error = 0;
    std::vector<int> rest;
  };
  // Emitters that may be left out, or summed by clusters, and by how much that errs.
  struct Candidate {
    int begin, end;
    double error;
    int clusters = -1;  // batch; -1: to be left out
  };

  template <class EmitterKernel>
  Settled Descend(const EmitterKernel& kernel, const Place& place, double least) const;
  template <class EmitterKernel>
  double MostOf(const EmitterKernel& kernel, const EmitterNode& node, const Place& place) const;
  // Infinity where the node has no clusters.
  double ClusterError(int node, const Place& place) const;
  // run: how many emitters are left out together.
  void AppendCandidates(int node, int run, const ReachFall& fall, const Place& place,
                        std::vector<Candidate>& candidates) const;
  double AppendRuns(const EmitterNode& node, int run, const ReachFall& fall, const Place& place,
                    std::vector<Candidate>& candidates) const;
  NearEmitters Choose(const std::vector<Candidate>& candidates, int run, Settled settled,
                      double& left_out) const;

  // Clusters are worth their budget where they err so much less than to leave the emitters out.
  static constexpr double kWorth = 0.25;

  EmitterTree tree_;
  std::vector<EmitterReach> reaches_;   // of the tree's batches
  std::vector<ClusterBatch> clusters_;  // of its nodes; none where the kernel has none
  std::vector<int> clusters_of_;        // of each node, the batch; -1: none
  int power_ = -1;                      // of the clusters
  double tail_error_;
};

template <class EmitterKernel>
NearEmitters EmitterSearch::InBox(const EmitterKernel& kernel, const Box3& box, FarField far,
                                  double& left_out) const {
  const Place place{box, box.center(), 0.5 * box.sizes(),
                    far == FarField::kClusters && !clusters_.empty()};
  // Of the tail error, for one node: a first guess that nearly always does.
  double least = (place.clustered ? 1.0 / 512 : 1.0 / 128) * tail_error_;
  Settled settled;
  do {
    settled = Descend(kernel, place, least);
    least /= 8;
  } while (settled.error > 0.5 * tail_error_);
  std::vector<Candidate> candidates;
  for (const int node : settled.rest) {
    AppendCandidates(node, EmitterKernel::kRun, kernel.Reach(), place, candidates);
  }
  return Choose(candidates, EmitterKernel::kRun, std::move(settled), left_out);
}

// Nodes that may be left out, or summed by clusters, at an error of at most `least` each.
template <class EmitterKernel>
EmitterSearch::Settled EmitterSearch::Descend(const EmitterKernel& kernel, const Place& place,
                                              double least) const {
  constexpr double kHopeless = 4;  // nodes that emit more are too near for clusters
  Settled settled;
  const auto settle = [&](int n) {
    const double most = MostOf(kernel, tree_.nodes()[n], place);
    if (most <= least) {
      settled.error += most;
      return true;
    }
    const bool may = place.clustered && most < kHopeless * tail_error_;
    const double error = may ? ClusterError(n, place) : most;
    if (error > least || error > kWorth * most) {
      return false;
    }
    settled.error += error;
    settled.clusters.push_back(clusters_of_[n]);
    return true;
  };
  const int few = (place.clustered ? 2 : 4) * EmitterReach::kLanes;
  tree_.Descend(few, settle, [&settled](int n) { settled.rest.push_back(n); });
  return settled;
}

// The most that a node's emitters together give in the box.
template <class EmitterKernel>
double EmitterSearch::MostOf(const EmitterKernel& kernel, const EmitterNode& node,
                             const Place& place) const {
  const double height = node.MostHeight(place.center, place.half);
  if (height <= 0) {
    return 0;
  }
  const double distance2 = node.box.squaredExteriorDistance(place.box);
  if (distance2 <= 0) {
    return std::numeric_limits<double>::infinity();
  }
  const double share = kernel.Most(distance2, height);
  return node.greatest_gain * share < (1 - kRounding) * kernel.Cut() ? 0 : node.gain * share;
}

}  // namespace semblance
