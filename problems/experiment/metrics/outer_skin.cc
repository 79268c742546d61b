// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/metrics/outer_skin.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>

#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

using GridCell = std::array<int, 3>;

// The places that the ball's centre can reach: cells of a box, represented by their middles.
class ProbeGrid {
 public:
  ProbeGrid(const Box3& box, double probe_mm, const std::vector<CutPlane>& ends)
      : probe_mm_(probe_mm), cell_mm_(probe_mm / kCellsPerProbe) {
    Box3 room = box;
    room.min().array() -= probe_mm + 3 * cell_mm_;
    room.max().array() += probe_mm + 3 * cell_mm_;
    origin_ = room.min();
    for (int axis = 0; axis < 3; ++axis) {
      size_[axis] = static_cast<int>(std::ceil(room.sizes()[axis] / cell_mm_));
    }
    state_.assign(std::size_t(size_[0]) * size_[1] * size_[2], kFree);
    for (const CutPlane& end : ends) {
      CloseBeyond(end);
    }
  }

  // Bars all centres that are nearer to p than the ball's radius.
  void KeepOff(const Vec3& p) {
    ForRowsWithin(p, probe_mm_, [&](std::size_t first, std::size_t last, const Vec3&) {
      std::fill(state_.begin() + std::ptrdiff_t(first), state_.begin() + std::ptrdiff_t(last) + 1,
                kBarred);
      return false;
    });
  }

  // Moves the ball in from all free faces of the box.
  void Flood() {
    std::vector<Run> open;
    ForFaces([&](const GridCell& c) { Enter(c, open); });
    while (!open.empty()) {
      const Run run = open.back();
      open.pop_back();
      EnterBeside(run, run.y - 1, run.z, open);
      EnterBeside(run, run.y + 1, run.z, open);
      EnterBeside(run, run.y, run.z - 1, open);
      EnterBeside(run, run.y, run.z + 1, open);
    }
  }

  // True if the ball reached a place in which it touches p on the outer side of the normal.
  bool Touches(const Vec3& p, const Vec3& normal) const {
    const double reach_mm = probe_mm_ + std::numbers::sqrt3 * cell_mm_;
    if (IsReached(p + (probe_mm_ + 0.5 * cell_mm_) * normal)) {
      return true;  // the middle of that cell is within reach and outward: most of a skin ends here
    }
    return ForRowsWithin(
        p, reach_mm, [&](std::size_t first, std::size_t last, const Vec3& offset_of_first) {
          double outward = offset_of_first.dot(normal);
          for (std::size_t cell = first; cell <= last; ++cell, outward += cell_mm_ * normal.x()) {
            if (state_[cell] == kReached && outward > 0) {
              return true;
            }
          }
          return false;
        });
  }

 private:
  enum State : std::uint8_t { kFree, kBarred, kReached };
  static constexpr int kCellsPerProbe = 6;

  // Cells first..last of a row along x. Runs keep the flood's stack short and its memory close.
  struct Run {
    int first, last, y, z;
  };

  std::size_t IndexOf(const GridCell& c) const {
    return (std::size_t(c[2]) * size_[1] + c[1]) * size_[0] + c[0];
  }
  bool IsReached(const Vec3& p) const {
    GridCell cell;
    for (int axis = 0; axis < 3; ++axis) {
      cell[axis] = static_cast<int>(std::floor((p[axis] - origin_[axis]) / cell_mm_));
      if (cell[axis] < 0 || cell[axis] >= size_[axis]) {
        return false;
      }
    }
    return state_[IndexOf(cell)] == kReached;
  }
  Vec3 Middle(const GridCell& c) const {
    return origin_ + cell_mm_ * Vec3(c[0] + 0.5, c[1] + 0.5, c[2] + 0.5);
  }
  // Reaches a free cell, and the free cells that continue it along x.
  void Enter(const GridCell& c, std::vector<Run>& open) {
    std::uint8_t* const row = &state_[IndexOf({0, c[1], c[2]})];
    if (row[c[0]] != kFree) {
      return;
    }
    Run run{c[0], c[0], c[1], c[2]};
    while (run.first > 0 && row[run.first - 1] == kFree) {
      --run.first;
    }
    while (run.last + 1 < size_[0] && row[run.last + 1] == kFree) {
      ++run.last;
    }
    std::fill(row + run.first, row + run.last + 1, kReached);
    open.push_back(run);
  }
  // Enters the cells of another row that lie beside the run.
  void EnterBeside(const Run& run, int y, int z, std::vector<Run>& open) {
    if (y < 0 || y >= size_[1] || z < 0 || z >= size_[2]) {
      return;
    }
    const std::uint8_t* const row = &state_[IndexOf({0, y, z})];
    for (int x = run.first; x <= run.last; ++x) {
      if (row[x] == kFree) {
        Enter({x, y, z}, open);
      }
    }
  }
  void CloseBeyond(const CutPlane& end) {
    ForCells({0, 0, 0}, {size_[0] - 1, size_[1] - 1, size_[2] - 1}, [&](const GridCell& c) {
      if (end.Beyond_mm(Middle(c)) > 0) {
        state_[IndexOf(c)] = kBarred;
      }
      return false;
    });
  }

  // Calls visit(cell) from first to last, x fastest, until it returns true. Returns whether it did.
  template <class Visit>
  static bool ForCells(const GridCell& first, const GridCell& last, const Visit& visit) {
    for (int z = first[2]; z <= last[2]; ++z) {
      for (int y = first[1]; y <= last[1]; ++y) {
        for (int x = first[0]; x <= last[0]; ++x) {
          if (visit(GridCell{x, y, z})) {
            return true;
          }
        }
      }
    }
    return false;
  }
  // Calls visit(first, last, middle of first - p) for each row along x of cells whose middles are
  // closer to p than radius_mm, until it returns true. Returns whether it did.
  template <class Visit>
  bool ForRowsWithin(const Vec3& p, double radius_mm, const Visit& visit) const {
    const Vec3 at = (p - origin_) / cell_mm_ - Vec3::Constant(0.5);  // in cells, of middles
    const double radius = radius_mm / cell_mm_;
    const auto range = [&](int axis, double reach) {
      return std::pair(std::max(0, static_cast<int>(std::ceil(at[axis] - reach))),
                       std::min(size_[axis] - 1, static_cast<int>(std::floor(at[axis] + reach))));
    };
    const auto [z0, z1] = range(2, radius);
    const auto [y0, y1] = range(1, radius);
    for (int z = z0; z <= z1; ++z) {
      for (int y = y0; y <= y1; ++y) {
        const double rest =
            radius * radius - (z - at.z()) * (z - at.z()) - (y - at.y()) * (y - at.y());
        const auto [x0, x1] = range(0, rest > 0 ? std::sqrt(rest) : -1);
        if (x0 <= x1 && visit(IndexOf({x0, y, z}), IndexOf({x1, y, z}), Middle({x0, y, z}) - p)) {
          return true;
        }
      }
    }
    return false;
  }
  template <class Visit>
  void ForFaces(const Visit& visit) const {
    for (int axis = 0; axis < 3; ++axis) {
      for (const int at : {0, size_[axis] - 1}) {
        GridCell first = {0, 0, 0}, last = {size_[0] - 1, size_[1] - 1, size_[2] - 1};
        first[axis] = last[axis] = at;
        ForCells(first, last, [&](const GridCell& c) {
          visit(c);
          return false;
        });
      }
    }
  }

  double probe_mm_, cell_mm_;
  Vec3 origin_;
  GridCell size_ = {0, 0, 0};
  std::vector<std::uint8_t> state_;
};

// Visits points of the mesh: all corners, and more on large triangles. Every place of the surface
// lies within about half of spacing_mm of one of them.
template <class Visit>
void ForPointsOn(const TriMesh& mesh, double spacing_mm, const Visit& visit) {
  std::ranges::for_each(mesh.points, visit);
  for (const Triangle& t : mesh.triangles) {
    const Vec3 &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
    const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    const int n = static_cast<int>(std::ceil(longest / spacing_mm));
    for (int i = 0; i <= n && n > 1; ++i) {
      for (int j = 0; j <= n - i; ++j) {
        visit(Vec3((double(n - i - j) * a + double(i) * b + double(j) * c) / n));
      }
    }
  }
}

// Lids over the holes of a mesh: from the middle of each border, a triangle to each of its edges.
TriMesh CoverHoles(const TriMesh& mesh) {
  const std::vector<MeshEdge> border = BorderEdges(mesh);
  std::map<std::int32_t, std::int32_t> parent;  // of a border's vertices; its root is its own
  const auto root_of = [&](std::int32_t v) {
    while (parent.at(v) != v) {
      v = parent[v] = parent.at(parent.at(v));
    }
    return v;
  };
  for (const auto& [a, b] : border) {
    parent.try_emplace(a, a);
    parent.try_emplace(b, b);
    parent[root_of(a)] = root_of(b);
  }
  std::map<std::int32_t, std::vector<MeshEdge>> borders;  // by root
  for (const MeshEdge& edge : border) {
    borders[root_of(edge[0])].push_back(edge);
  }
  TriMesh lids;
  for (const auto& [root, edges] : borders) {
    Vec3 middle = Vec3::Zero();
    for (const auto& [a, b] : edges) {
      middle += (mesh.points[a] + mesh.points[b]) / (2.0 * static_cast<double>(edges.size()));
    }
    for (const auto& [a, b] : edges) {
      const auto first = static_cast<std::int32_t>(lids.points.size());
      lids.points.insert(lids.points.end(), {middle, mesh.points[a], mesh.points[b]});
      lids.triangles.push_back({first, first + 1, first + 2});
    }
  }
  return lids;
}

std::vector<CutPlane> FindEnds(const TriMesh& skin) {
  std::vector<CutPlane> ends = FindCutPlanes(skin);
  const std::vector<CutPlane> lids = FindLids(skin);
  ends.insert(ends.end(), lids.begin(), lids.end());
  return ends;
}

void CheckSize(const TriMesh& skin, double probe_mm) {
  constexpr double kLargestSize_probes = 1000;  // bounds the grid's memory
  const double size_mm = Bounds(skin).sizes().maxCoeff();
  if (skin.triangles.empty() || !(size_mm <= kLargestSize_probes * probe_mm)) {
    throw InputError(
        fmt::format("outer skin: a mesh of {} triangles, {:.4g} mm long, cannot be felt with a "
                    "probe of {} mm; give a head in mm, or a larger probe_mm",
                    skin.triangles.size(), size_mm, probe_mm));
  }
}

}  // namespace

OuterSkin FindOuterSkin(const TriMesh& skin, double probe_mm) {
  CheckSize(skin, probe_mm);
  OuterSkin result{std::vector<bool>(skin.points.size(), false), FindEnds(skin)};
  ProbeGrid grid(Bounds(skin), probe_mm, result.ends);
  for (const TriMesh& surface : {skin, CoverHoles(skin)}) {
    ForPointsOn(surface, probe_mm / 3, [&](const Vec3& p) { grid.KeepOff(p); });
  }
  grid.Flood();
  const std::vector<Vec3> normals = VertexNormals(skin);
  for (std::size_t v = 0; v < skin.points.size(); ++v) {
    result.outer[v] = grid.Touches(skin.points[v], normals[v]);
  }
  return result;
}

}  // namespace semblance::problems
