// SPDX-License-Identifier: GPL-3.0-or-later
// A treecode over the emitters (Barnes & Hut 1986). For the points of a box it decides which
// emitters to sum one by one, which to sum by multipoles, and which to leave out, within an error
// bound. Used by the implicit surface only.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "surfaces/emitters/distance_kernel.h"
#include "surfaces/emitters/emission_bounds.h"
#include "surfaces/emitters/emitter_multipole.h"
#include "surfaces/emitters/emitter_triangle.h"

namespace semblance::surfaces {

struct NeighbourList {
  // Runs of 4 or 8 emitters in the tree's order, given by (index of first emitter) / (run length).
  std::vector<std::int32_t> runs;
  std::vector<std::int32_t> multipoles;  // indices of groups of four
  std::vector<ReachLanes> reaches;       // per run, for the thesis's emitters
};

// A node of the tree: emitters begin .. end - 1, with bounds of their emission.
struct EmitterNode {
  Box3 box;      // around the triangles and their places of emission
  Box3 normals;  // around the unit normals
  double lowest_mm = std::numeric_limits<double>::infinity();  // lowest plane along its normal,
                                                               // from the box's center
  int begin = 0, end = 0;
  int left = -1, right = -1;  // children; -1 in a leaf
  double gain = 0;            // sum of gains
  double greatest_gain = 0;
};

// The use of multipoles for emitters far from a box.
enum class FarField { kNone, kMultipole };

struct EmitterSearchOptions {
  Falloff falloff;
  int run = 0;              // emitters that are summed or left out together: 4 or 8
  bool multipoles = false;  // only for flat emitters with an integer power
  double tail_error = kNaN;
};

class EmitterSearch {
 public:
  // Reorders the emitters, whose gains must be set, into the order of the tree.
  EmitterSearch(std::vector<EmitterTriangle>& emitters, const EmitterSearchOptions& options);

  // Chooses the emitters for points of the box. The omitted emissions and the errors of multipoles
  // sum to at most the tail error; left_out returns the bound of that sum.
  NeighbourList InBox(const Box3& box, FarField far, double& left_out) const;

  std::span<const MultipoleLanes> multipoles() const { return multipoles_; }

 private:
  struct QueryBox {
    const Box3& box;
    Vec3 center, half;
    bool by_multipoles;
  };
  // The result of a descent: nodes summed by multipoles, the error of these and of omitted nodes,
  // and the nodes whose runs need a closer look.
  struct Pruned {
    std::vector<std::int32_t> multipoles;
    double error = 0;
    std::vector<int> rest;
  };
  // Emitters that may be left out or summed by multipoles, with the error of doing so.
  struct Candidate {
    int begin, end;
    double error;
    int multipoles = -1;  // index of a group; -1: to be left out
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
  std::vector<EmitterNode> nodes_;                // root first
  std::vector<EmissionUpperBound> upper_bounds_;  // per eight emitters
  std::vector<MultipoleLanes> multipoles_;        // groups of four, per node that has them
  std::vector<int> multipoles_of_;                // per node; -1 if it has none
};

// Caches neighbour lists per cube of a lattice, in a table of fixed size in which a new list may
// replace an old one. The list found for a point depends on the point only.
class NeighbourListCache {
 public:
  using List = std::shared_ptr<const NeighbourList>;

  // cube_mm > 0.
  explicit NeighbourListCache(double cube_mm) : cube_mm_(cube_mm), sets_(kSets) {}

  // Returns the list of p's cube, and computes it by make(box) if it is not cached. Thread-safe.
  template <class Make>
  List Find(const Vec3& p, const Make& make) const {
    const Vec3 cube = (p / cube_mm_).array().floor();
    Set& set = sets_[SetIndex(cube)];
    {
      const std::lock_guard lock(set.mutex);
      for (const Slot& slot : set.slots) {
        if (slot.list && slot.cube == cube) {
          return slot.list;
        }
      }
    }
    List list = std::make_shared<const NeighbourList>(make(CubeBox(cube)));
    const std::lock_guard lock(set.mutex);
    set.slots[set.next] = {cube, list};
    set.next = (set.next + 1) % set.slots.size();
    return list;
  }

 private:
  static constexpr std::size_t kSets = 8192;

  struct Slot {
    Vec3 cube = Vec3::Zero();
    List list;
  };
  // Cubes with the same hash. Four slots suffice that the cubes of one surface, some ten thousands
  // at most, seldom replace each other (with one slot each list was computed six times).
  struct Set {
    std::mutex mutex;
    std::array<Slot, 4> slots;
    std::size_t next = 0;  // slot to fill next
  };

  static std::size_t SetIndex(const Vec3& cube) {
    std::uint64_t hash = 0;
    for (int axis = 0; axis < 3; ++axis) {
      hash += std::bit_cast<std::uint64_t>(cube[axis]);
      hash = (hash ^ (hash >> 30)) * 0xBF58476D1CE4E5B9ULL;  // splitmix64
      hash = (hash ^ (hash >> 27)) * 0x94D049BB133111EBULL;
      hash ^= hash >> 31;
    }
    return hash % kSets;
  }
  Box3 CubeBox(const Vec3& cube) const {
    const Vec3 low = cube_mm_ * cube;
    const Vec3 slack = Vec3::Constant(kRounding * (cube_mm_ + 1e-3 * low.cwiseAbs().maxCoeff()));
    return {low - slack, low + Vec3::Constant(cube_mm_) + slack};
  }

  double cube_mm_;
  mutable std::vector<Set> sets_;
};

}  // namespace semblance::surfaces
