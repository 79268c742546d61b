// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/nested_surface.h"

#include <map>
#include <optional>

namespace semblance::fitting {
namespace {

// A displacement along the channels as a vector in space.
Vec3 InSpace(const NestedPoints& points, const GridValues& values, int i, int j) {
  Vec3 sum = Vec3::Zero();
  for (int c = 0; c < points.channels; ++c) {
    sum += values.Row(c, j)[i] * points.axes.col(c);
  }
  return sum;
}

// The offsets of a level's vertices from the next coarser surface, in its frame or the world's.
std::map<VertexId, std::optional<Vec3>> MakeOffsets(const NestedSpace& space, int level,
                                                    const NestedPoints& points,
                                                    const ControlNet& rest,
                                                    const GridValues& displacements,
                                                    const HSplineSurface& surface) {
  std::map<VertexId, std::optional<Vec3>> offsets;
  const NestedLevel& nested = space[level];
  const bool world = surface.shape().reference == OffsetReference::kWorld;
  for (int i = 0; i < rest.columns; ++i) {
    for (int j = 0; j < rest.rows; ++j) {
      if (nested.active[nested.layout.At(i, j)] == 0 || space.IsCovered(level, i, j)) {
        continue;
      }
      const VertexId vertex{level, i, j};
      const SurfaceFrame frame = surface.LevelFrame(level - 1, surface.GrevillePoint(vertex));
      const Vec3 way = rest.At(i, j) + InSpace(points, displacements, i, j) - frame.point;
      offsets.emplace_hint(offsets.end(), vertex, world ? way : Vec3(frame.axes.transpose() * way));
    }
  }
  return offsets;
}

}  // namespace

HSplineSurface MakeSurface(const HSplineSurface& start, const NestedSpace& space,
                           const NestedPoints& points, const NestedValues& displacements) {
  HSplineShape shape = start.shape();
  shape.max_level = space.finest();
  ControlNet net = start.Net(0);
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      net.At(i, j) += InSpace(points, displacements[0], i, j);
    }
  }
  HSplineSurface surface(shape, net);
  ControlNet rest = start.Net(0);
  for (int level = 1; level <= space.finest(); ++level) {
    rest = Refine(shape, rest, level - 1);
    surface.SetOffsets(MakeOffsets(space, level, points, rest, displacements[level], surface));
  }
  return surface;
}

}  // namespace semblance::fitting
