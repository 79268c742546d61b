// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/marching/marching_cubes.h"

#include <algorithm>
#include <utility>

namespace semblance::surfaces {
namespace {

using Loop = std::vector<std::uint8_t>;  // edges in order
using CaseTriangles = std::vector<std::array<std::uint8_t, 3>>;

// The corners of the six faces, each in cyclic order, counter-clockwise seen from outside the cell.
constexpr std::array<std::array<int, 4>, 6> kFaces = {
    {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};

int EdgeBetween(int a, int b) {
  const auto found = std::find_if(kCellEdges.begin(), kCellEdges.end(), [&](const CellEdge& e) {
    return e.from == std::min(a, b) && e.to == std::max(a, b);
  });
  return static_cast<int>(found - kCellEdges.begin());
}

bool Inside(int mask, int corner) { return mask >> corner & 1; }

// next[e] is the edge that follows crossed edge e on its loop. Around each face, a loop enters
// where a run of inside corners begins and leaves where this run ends. This separates diagonal
// inside corners.
std::array<int, 12> LinkCrossings(int mask) {
  std::array<int, 12> next;
  next.fill(-1);
  for (const auto& face : kFaces) {
    for (int c = 0; c < 4; ++c) {
      if (Inside(mask, face[c]) || !Inside(mask, face[(c + 1) % 4])) {
        continue;
      }
      int last = (c + 1) % 4;  // the last corner of the inside run
      while (Inside(mask, face[(last + 1) % 4])) {
        last = (last + 1) % 4;
      }
      // The loop crosses this face from the run's end to its beginning.
      next[EdgeBetween(face[last], face[(last + 1) % 4])] = EdgeBetween(face[c], face[(c + 1) % 4]);
    }
  }
  return next;
}

bool ShareFace(int edge_a, int edge_b) {
  for (const auto& face : kFaces) {
    const auto on_face = [&](int edge) {
      return std::count(face.begin(), face.end(), kCellEdges[edge].from) +
                 std::count(face.begin(), face.end(), kCellEdges[edge].to) ==
             2;
    };
    if (on_face(edge_a) && on_face(edge_b)) {
      return true;
    }
  }
  return false;
}

// Triangulates loop[first..last] with the fewest diagonals in a face of the cell, and returns their
// number.
int Triangulate(const Loop& loop, int first, int last, CaseTriangles& triangles) {
  if (last - first < 2) {
    return 0;
  }
  const bool is_side = last - first == static_cast<int>(loop.size()) - 1;
  const int own = !is_side && ShareFace(loop[first], loop[last]) ? 1 : 0;
  int fewest = 100;
  CaseTriangles best;
  for (int middle = first + 1; middle < last; ++middle) {
    CaseTriangles trial = {{loop[first], loop[last], loop[middle]}};
    const int bad =
        own + Triangulate(loop, first, middle, trial) + Triangulate(loop, middle, last, trial);
    if (bad < fewest) {
      fewest = bad;
      best = std::move(trial);
    }
  }
  triangles.insert(triangles.end(), best.begin(), best.end());
  return fewest;
}

std::vector<Loop> CaseLoops(int mask) {
  std::array<int, 12> next = LinkCrossings(mask);
  std::vector<Loop> loops;
  for (int start = 0; start < 12; ++start) {
    Loop loop;
    for (int e = start; e >= 0 && next[e] >= 0;) {
      loop.push_back(static_cast<std::uint8_t>(e));
      e = std::exchange(next[e], -1);
    }
    if (!loop.empty()) {
      loops.push_back(std::move(loop));
    }
  }
  return loops;
}

CaseTriangles TriangulateCase(int mask) {
  CaseTriangles triangles;
  for (const Loop& loop : CaseLoops(mask)) {
    Triangulate(loop, 0, static_cast<int>(loop.size()) - 1, triangles);
  }
  return triangles;
}

std::array<EdgeBits, 12> JoinedEdges(int mask) {
  std::array<EdgeBits, 12> joined{};
  for (const Loop& loop : CaseLoops(mask)) {
    EdgeBits bits = 0;
    for (const std::uint8_t e : loop) {
      bits |= EdgeBits(1 << e);
    }
    for (const std::uint8_t e : loop) {
      joined[e] = bits;
    }
  }
  return joined;
}

// One entry per case.
template <class OfCase>
auto AllCases(const OfCase& of_case) {
  std::array<decltype(of_case(0)), 256> cases;
  for (int mask = 0; mask < 256; ++mask) {
    cases[mask] = of_case(mask);
  }
  return cases;
}

}  // namespace

const std::array<std::vector<std::array<std::uint8_t, 3>>, 256>& MarchingCubesCases() {
  static const auto kCases = AllCases(TriangulateCase);
  return kCases;
}

const std::array<std::array<EdgeBits, 12>, 256>& MarchingCubesLoops() {
  static const auto kLoops = AllCases(JoinedEdges);
  return kLoops;
}

}  // namespace semblance::surfaces
