// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/join_copies.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <unordered_map>
#include <utility>

namespace semblance::surfaces {
namespace {

template <class Integer, std::size_t n>
std::uint64_t KeyOf(const std::array<Integer, n>& numbers) {
  std::uint64_t key = 0;
  for (const Integer x : numbers) {
    key = (key ^ static_cast<std::uint64_t>(x)) * 0x9E3779B97F4A7C15u;
    key ^= key >> 29;
  }
  return key;
}

struct KeyHash {
  template <class Key>
  std::size_t operator()(const Key& key) const {
    return static_cast<std::size_t>(KeyOf(key));
  }
};

double SamePlace_mm(const Box3& box) {
  const double largest = box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff();
  return std::max(1e-5 * box.diagonal().norm(), 4 * std::ldexp(largest, -23));
}

// A hash table of indices in index order. Its user compares what it finds, so keys may collide.
class IndexTable {
 public:
  explicit IndexTable(std::size_t size)
      : first_(std::bit_ceil(size + 1), -1), last_(first_.size(), -1), next_(size, -1) {}

  void Add(std::uint64_t key, std::int32_t index) {
    const std::size_t slot = key & (first_.size() - 1);
    (first_[slot] < 0 ? first_[slot] : next_[last_[slot]]) = index;
    last_[slot] = index;
  }
  // The first index with this key that `matches`; -1 if there is none.
  template <class Matches>
  std::int32_t Find(std::uint64_t key, const Matches& matches) const {
    std::int32_t index = first_[key & (first_.size() - 1)];
    while (index >= 0 && !matches(index)) {
      index = next_[index];
    }
    return index;
  }

 private:
  std::vector<std::int32_t> first_, last_, next_;
};

// Finds the place of each point: the first point that lies within same_mm and is a place itself.
std::vector<std::int32_t> FindPlaces(const std::vector<Vec3>& points, double same_mm) {
  constexpr double kCell = 50;  // cells so large that few points look into a second one
  using Cell = std::array<std::int64_t, 3>;
  const auto cell_of = [&](const Vec3& p) {
    return Cell{std::llround(p.x() / (kCell * same_mm)), std::llround(p.y() / (kCell * same_mm)),
                std::llround(p.z() / (kCell * same_mm))};
  };
  IndexTable table(points.size());
  std::vector<std::int32_t> places(points.size());
  for (std::size_t v = 0; v < points.size(); ++v) {
    const Vec3& p = points[v];
    const Cell low = cell_of(p - Vec3::Constant(same_mm)),
               high = cell_of(p + Vec3::Constant(same_mm));
    std::int32_t place = -1;
    for (std::int64_t z = low[2]; z <= high[2]; ++z) {
      for (std::int64_t y = low[1]; y <= high[1]; ++y) {
        for (std::int64_t x = low[0]; x <= high[0]; ++x) {
          const std::int32_t found = table.Find(KeyOf(Cell{x, y, z}), [&](std::int32_t other) {
            return (points[other] - p).squaredNorm() <= same_mm * same_mm;
          });
          place = found >= 0 && (place < 0 || found < place) ? found : place;
        }
      }
    }
    places[v] = place >= 0 ? place : static_cast<std::int32_t>(v);
    if (place < 0) {
      table.Add(KeyOf(cell_of(p)), places[v]);
    }
  }
  return places;
}

Triangle PlacesOf(const Triangle& t, const std::vector<std::int32_t>& places) {
  return {places[t[0]], places[t[1]], places[t[2]]};
}

bool HasTwoAlike(const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

// True if the order of the corners is that of the sorted corners, cyclically.
bool IsEven(const Triangle& t) { return (t[0] < t[1]) + (t[1] < t[2]) + (t[2] < t[0]) == 2; }

// The triangles that remain where several lie on each other.
struct Distinct {
  std::vector<Triangle> triangles;
  std::vector<bool> both_ways;  // per triangle: another one has the opposite orientation
};

Distinct DropRepeated(const TriMesh& mesh, const std::vector<std::int32_t>& places) {
  Distinct distinct;
  std::vector<Triangle> corners;  // of the distinct triangles: sorted places
  IndexTable table(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    const Triangle at = PlacesOf(t, places);
    Triangle sorted = at;
    std::ranges::sort(sorted);
    const std::int32_t first =
        table.Find(KeyOf(sorted), [&](std::int32_t other) { return corners[other] == sorted; });
    if (first < 0 || HasTwoAlike(at)) {
      table.Add(KeyOf(sorted), static_cast<std::int32_t>(corners.size()));
      corners.push_back(sorted);
      distinct.triangles.push_back(t);
      distinct.both_ways.push_back(false);
    } else if (IsEven(at) != IsEven(PlacesOf(distinct.triangles[first], places))) {
      distinct.both_ways[first] = true;
    }
  }
  return distinct;
}

using Edge = std::array<std::int32_t, 2>;

Edge Sorted(std::int32_t a, std::int32_t b) { return {std::min(a, b), std::max(a, b)}; }

// Joins vertices at the ends of border edges that lie on each other. Drops triangles that shrink to
// an edge. Returns the number of joined vertices.
std::size_t JoinBorders(TriMesh& mesh, const std::vector<std::int32_t>& places) {
  if (std::ranges::adjacent_find(places, std::greater_equal()) == places.end()) {
    return 0;  // all places differ
  }
  const std::vector<MeshEdge> border = BorderEdges(mesh);
  std::unordered_map<Edge, int, KeyHash> count;
  for (const auto& [a, b] : border) {
    ++count[Sorted(places[a], places[b])];
  }
  std::vector<bool> meets(mesh.points.size(), false);  // by place
  std::vector<bool> on_border(mesh.points.size(), false);
  for (const auto& [a, b] : border) {
    on_border[a] = on_border[b] = true;
    if (places[a] != places[b] && count[Sorted(places[a], places[b])] > 1) {
      meets[places[a]] = meets[places[b]] = true;
    }
  }
  std::vector<std::int32_t> joined_to(mesh.points.size(), -1);  // by place
  std::vector<std::int32_t> renamed(mesh.points.size());
  std::size_t joined = 0;
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    renamed[v] = static_cast<std::int32_t>(v);
    if (on_border[v] && meets[places[v]]) {
      std::int32_t& first = joined_to[places[v]];
      first = first < 0 ? renamed[v] : first;
      joined += first != renamed[v];
      renamed[v] = first;
    }
  }
  if (joined > 0) {
    for (Triangle& t : mesh.triangles) {
      t = PlacesOf(t, renamed);
    }
  }
  return joined;
}

// Turns triangles whose orientation is free, so that neighbours agree.
class Orientation {
 public:
  Orientation(TriMesh& mesh, std::vector<bool> is_free)
      : mesh_(mesh), is_free_(std::move(is_free)), done_(mesh.triangles.size(), false) {
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      for (int k = 0; k < 3; ++k) {
        const Triangle& c = mesh.triangles[t];
        at_edge_[Sorted(c[k], c[(k + 1) % 3])].push_back(t);
      }
    }
  }

  void Run() {
    std::vector<std::size_t> open;
    for (std::size_t t = 0; t < done_.size(); ++t) {
      if (!is_free_[t]) {
        done_[t] = true;
        open.push_back(t);
      }
    }
    Spread(std::move(open));
    for (std::size_t t = 0; t < done_.size(); ++t) {
      if (!done_[t]) {
        done_[t] = true;
        TurnOutwards(Spread({t}));
      }
    }
  }

 private:
  // Turns the free neighbours of `open` and theirs. Returns all triangles that it met.
  std::vector<std::size_t> Spread(std::vector<std::size_t> open) {
    for (std::size_t next = 0; next < open.size(); ++next) {
      const Triangle from = mesh_.triangles[open[next]];
      for (int k = 0; k < 3; ++k) {
        const std::int32_t a = from[k], b = from[(k + 1) % 3];
        const std::vector<std::size_t>& both = at_edge_[Sorted(a, b)];
        for (const std::size_t t : both) {
          if (both.size() == 2 && !done_[t]) {
            done_[t] = true;
            open.push_back(t);
            TurnIfAlong(a, b, mesh_.triangles[t]);
          }
        }
      }
    }
    return open;
  }

  // Neighbours run along their edge in opposite directions.
  static void TurnIfAlong(std::int32_t a, std::int32_t b, Triangle& t) {
    for (int k = 0; k < 3; ++k) {
      if (t[k] == a && t[(k + 1) % 3] == b) {
        std::swap(t[0], t[1]);
        return;
      }
    }
  }

  void TurnOutwards(const std::vector<std::size_t>& piece) {
    Vec3 middle = Vec3::Zero();
    double outward = 0;
    for (const std::size_t t : piece) {
      middle += TriangleCentroid(mesh_, mesh_.triangles[t]) / static_cast<double>(piece.size());
    }
    for (const std::size_t t : piece) {
      const Triangle& c = mesh_.triangles[t];
      outward += (TriangleCentroid(mesh_, c) - middle).dot(TriangleAreaVector(mesh_, c));
    }
    for (const std::size_t t : outward < 0 ? piece : std::vector<std::size_t>()) {
      std::swap(mesh_.triangles[t][0], mesh_.triangles[t][1]);
    }
  }

  TriMesh& mesh_;
  std::vector<bool> is_free_, done_;
  std::unordered_map<Edge, std::vector<std::size_t>, KeyHash> at_edge_;
};

void DropShrunk(TriMesh& mesh, std::vector<bool>& both_ways) {
  std::size_t kept = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!HasTwoAlike(mesh.triangles[t])) {
      mesh.triangles[kept] = mesh.triangles[t];
      both_ways[kept++] = both_ways[t];
    }
  }
  mesh.triangles.resize(kept);
  both_ways.resize(kept);
}

}  // namespace

std::vector<std::string> JoinCopies(TriMesh& mesh, const std::string& name) {
  std::vector<std::string> notes;
  const Box3 box = Bounds(mesh);
  if (mesh.triangles.empty() || !box.diagonal().allFinite()) {
    return notes;
  }
  const std::vector<std::int32_t> places = FindPlaces(mesh.points, SamePlace_mm(box));
  Distinct distinct = DropRepeated(mesh, places);
  const std::size_t all = mesh.triangles.size(), repeated = all - distinct.triangles.size();
  mesh.triangles = std::move(distinct.triangles);
  if (repeated > 0) {
    notes.push_back(fmt::format(
        "{}: {} of {} triangles lie on others, as in a mesh that holds copies of itself; each is "
        "used once",
        name, repeated, all));
  }
  const std::size_t joined = JoinBorders(mesh, places);
  if (joined > 0) {
    notes.push_back(
        fmt::format("{}: triangles that touch did not share their corners; {} corners are joined",
                    name, joined));
    DropShrunk(mesh, distinct.both_ways);
  }
  if (std::ranges::find(distinct.both_ways, true) != distinct.both_ways.end()) {
    Orientation(mesh, std::move(distinct.both_ways)).Run();
  }
  if (!notes.empty()) {
    DropUnusedPoints(mesh);
  }
  return notes;
}

}  // namespace semblance::surfaces
