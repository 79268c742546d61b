// SPDX-License-Identifier: GPL-3.0-or-later
// Which emitters the points of a box have to sum one by one, which by multipoles, and which may be
// left out: a treecode over the emitters (Barnes & Hut 1986). For the implicit surface alone.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "surfaces/emitters/emission_bounds.h"
#include "surfaces/emitters/emitter_multipole.h"
#include "surfaces/emitters/emitter_triangle.h"
#include "surfaces/emitters/neighbour_list_cache.h"

namespace semblance {

// Bounds over emitters begin .. end - 1.
struct EmitterNode {
  Box3 box;  // of the triangles and of where they are moved to
  Box3 normals;
  double lowest_mm =
      std::numeric_limits<double>::infinity();  // over planes through the box's center
  int begin = 0, end = 0;
  int left = -1, right = -1;  // -1 in a leaf
  double gain = 0;            // sum over its emitters
  double greatest_gain = 0;
};

// Whether emitters far from a box are summed as multipoles where they may be.
enum class FarField { kNone, kMultipole };

struct EmitterSearchOptions {
  Falloff falloff;
  int run = 0;              // how many emitters are summed or left out together: 4 or 8
  bool multipoles = false;  // for flat emitters of a whole power
  double tail_error = kNaN;
};

class EmitterSearch {
 public:
  // Puts the emitters in the order of its tree. Their gains are set.
  EmitterSearch(std::vector<EmitterTriangle>& emitters, const EmitterSearchOptions& options);

  // For points of the box: what is left out and the errors of the multipoles together are at most
  // the tail error; left_out: that sum.
  NeighbourList InBox(const Box3& box, FarField far, double& left_out) const;

  std::span<const MultipoleLanes> multipoles() const { return multipoles_; }

 private:
  struct QueryBox {
    const Box3& box;
    Vec3 center, half;
    bool by_multipoles;
  };
  // What a way down the tree leaves out or sums by multipoles, by how much that errs, and the
  // nodes that it leaves to be looked at one run after the other.
  struct Pruned {
    std::vector<std::int32_t> multipoles;
    double error = 0;
    std::vector<int> rest;
  };
  // Emitters that may be left out, or summed by multipoles, and by how much that errs.
  struct Candidate {
    int begin, end;
    double error;
    int multipoles = -1;  // four of them; -1: to be left out
  };

  void MakeMultipoles(const std::vector<EmitterTriangle>& emitters);
  Pruned Descend(const QueryBox& query, double least) const;
  bool Prune(int node, const QueryBox& query, double least, Pruned& pruned) const;
  double UpperBoundOfNode(const EmitterNode& node, const QueryBox& query) const;
  double MultipoleError(int node, const QueryBox& query) const;
  void AppendCandidates(int node, const QueryBox& query, std::vector<Candidate>& candidates) const;
  double AppendRuns(const EmitterNode& node, const QueryBox& query,
                    std::vector<Candidate>& candidates) const;
  NeighbourList Choose(const std::vector<Candidate>& candidates, Pruned pruned,
                       double& left_out) const;

  EmitterSearchOptions options_;
  std::vector<EmitterNode> nodes_;                // the root first
  std::vector<EmissionUpperBound> upper_bounds_;  // of each eight emitters
  std::vector<MultipoleLanes> multipoles_;        // of nodes; none where there are none
  std::vector<int> multipoles_of_;                // of each node; -1: none
};

}  // namespace semblance
