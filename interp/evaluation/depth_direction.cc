// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/evaluation/depth_direction.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "interp/dowels/dowel_area.h"

namespace semblance::interp {
namespace {

using CellKey = std::array<std::int32_t, 3>;

// The vertices sorted by cubes whose side is the radius, so that the vertices within the radius of
// a point lie in the 27 cubes around it.
class VertexGrid {
 public:
  VertexGrid(const std::vector<Vec3>& points, double size_mm) : points_(points), size_mm_(size_mm) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      entries_.push_back({CellKeyAt(points[i]), static_cast<int>(i)});
    }
    std::ranges::sort(entries_);
  }

  template <class Use>
  void ForEachWithin(const Vec3& p, Use&& use) const {
    const CellKey at = CellKeyAt(p);
    for (int dx = -1; dx <= 1; ++dx) {
      for (int dy = -1; dy <= 1; ++dy) {  // the three cubes along z are consecutive
        const CellKey low = {at[0] + dx, at[1] + dy, at[2] - 1};
        const CellKey high = {at[0] + dx, at[1] + dy, at[2] + 1};
        for (auto it = std::ranges::lower_bound(entries_, low, {}, &Entry::key);
             it != entries_.end() && it->key <= high; ++it) {
          if ((points_[it->vertex] - p).squaredNorm() <= size_mm_ * size_mm_) {
            use(it->vertex);
          }
        }
      }
    }
  }

 private:
  struct Entry {
    CellKey key;
    int vertex;
    auto operator<=>(const Entry&) const = default;
  };
  CellKey CellKeyAt(const Vec3& p) const {
    CellKey key;
    for (int axis = 0; axis < 3; ++axis) {
      key[axis] = static_cast<std::int32_t>(std::floor(p[axis] / size_mm_));
    }
    return key;
  }

  const std::vector<Vec3>& points_;
  double size_mm_;
  std::vector<Entry> entries_;
};

std::vector<Vec3> FindDirections(const MeshNormal&, const DepthInput& input, const RunContext&) {
  return {input.normals.begin(), input.normals.end()};
}

std::vector<Vec3> FindDirections(const SmoothedNormal& options, const DepthInput& input,
                                 const RunContext& run) {
  const std::vector<double> areas = VertexAreas(input.skull);
  const VertexGrid grid(input.skull.points, options.radius_mm);
  std::vector<Vec3> directions(input.skull.points.size());
  ForEachVertex(input, run, [&](std::size_t i) {
    Vec3 sum = Vec3::Zero();
    grid.ForEachWithin(input.skull.points[i], [&](int v) {
      if (input.normals[v].dot(input.normals[i]) > 0) {
        sum += areas[v] * input.normals[v];
      }
    });
    directions[i] = sum.norm() > 0 ? Vec3(sum.normalized()) : input.normals[i];
  });
  return directions;
}

std::vector<Vec3> FindDirections(const DowelDirection&, const DepthInput& input,
                                 const RunContext& run) {
  const std::vector<DowelArea> areas = DowelAreas(DowelDirection::kName, input);
  std::vector<Vec3> directions(input.normals.begin(), input.normals.end());
  ForEachVertex(input, run, [&](std::size_t i) {
    constexpr double kCancelled = 1e-6;
    const AreaPoint in = FindArea(areas, AreaDistance::kTriangle, input.skull.points[i]);
    Vec3 sum = Vec3::Zero();
    for (int k = 0; in.area != nullptr && k < 3; ++k) {
      sum += in.weights[k] * input.dowels[in.area->dowels[k]].direction;
    }
    if (sum.norm() > kCancelled) {
      directions[i] = sum.normalized();
    }
  });
  return directions;
}

}  // namespace

std::vector<Vec3> DepthDirections(const DepthDirection& direction, const DepthInput& input,
                                  const RunContext& run) {
  CheckDepthInput(input);
  run.ThrowIfStopped();
  return std::visit([&](const auto& options) { return FindDirections(options, input, run); },
                    direction);
}

}  // namespace semblance::interp
