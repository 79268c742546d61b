// SPDX-License-Identifier: GPL-3.0-or-later
// Which emitters the points of a box have to sum one by one, which by multipoles, and which may be
// left out: a treecode over the emitters (Barnes & Hut 1986). For the implicit surface alone.
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

namespace semblance {

struct NeighbourList {
  // Runs of 4 or 8 emitters, in the tree's order: each the number of its first over its length.
  std::vector<std::int32_t> runs;
  std::vector<std::int32_t> multipoles;  // four at once, by number
  std::vector<ReachLanes> reaches;       // of the runs, where emitters are summed by distance
};

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

// Neighbour lists of cubes of a lattice. They are kept in a table of fixed size, where a new one
// may put out an old one: what is found for a point depends on the point alone.
class NeighbourListCache {
 public:
  using List = std::shared_ptr<const NeighbourList>;

  // cube_mm > 0.
  explicit NeighbourListCache(double cube_mm) : cube_mm_(cube_mm), sets_(kSets) {}

  // make(box) gives the list of a cube. Safe from several threads at once.
  template <class Make>
  List Find(const Vec3& p, const Make& make) const {
    const Vec3 cube = (p / cube_mm_).array().floor();
    Set& set = sets_[SetOf(cube)];
    {
      const std::lock_guard lock(set.mutex);
      for (const Slot& slot : set.slots) {
        if (slot.list && slot.cube == cube) {
          return slot.list;
        }
      }
    }
    List list = std::make_shared<const NeighbourList>(make(BoxOf(cube)));
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
  // Cubes that share a line of the table: with four of them, cubes of one surface, some tens of
  // thousands at most, seldom put each other out.
  struct Set {
    std::mutex mutex;
    std::array<Slot, 4> slots;
    std::size_t next = 0;  // that is filled
  };

  static std::size_t SetOf(const Vec3& cube) {
    std::uint64_t hash = 0;
    for (int axis = 0; axis < 3; ++axis) {
      hash += std::bit_cast<std::uint64_t>(cube[axis]);
      hash = (hash ^ (hash >> 30)) * 0xBF58476D1CE4E5B9ULL;  // splitmix64
      hash = (hash ^ (hash >> 27)) * 0x94D049BB133111EBULL;
      hash ^= hash >> 31;
    }
    return hash % kSets;
  }
  Box3 BoxOf(const Vec3& cube) const {
    const Vec3 low = cube_mm_ * cube;
    const Vec3 slack = Vec3::Constant(kRounding * (cube_mm_ + 1e-3 * low.cwiseAbs().maxCoeff()));
    return {low - slack, low + Vec3::Constant(cube_mm_) + slack};
  }

  double cube_mm_;
  mutable std::vector<Set> sets_;
};

}  // namespace semblance
