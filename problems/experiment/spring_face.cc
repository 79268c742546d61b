// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/spring_face.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "problems/experiment/face_parts.h"
#include "problems/face/domain_grid.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

DomainGrid GridOfNet(const HSplineShape& shape, int level) {
  if (level > shape.max_level) {
    throw InputError(fmt::format("face.level: the template has no level {}; its finest is {}",
                                 level, shape.max_level));
  }
  return {.columns = 2 * (shape.patches_u << level) + 1,
          .rows = 2 * (shape.patches_v << level) + 1};
}

std::vector<Vec3> PointsOn(const HSplineSurface& surface, const DomainGrid& grid) {
  std::vector<Vec3> points;
  for (std::size_t k = 0; k < grid.size(); ++k) {
    points.push_back(surface.Point(grid.UvAt(k)));
  }
  return points;
}

// Vertices inside a feature are free. Vertices there with a neighbour outside are its
// edge, which is locked.
void HoldFeatures(std::span<const Sphere> features, SpringNet& net) {
  const auto inside = [&](int i, int j) {
    return std::ranges::any_of(features, [&](const Sphere& feature) {
      return feature.Contains(net.at_rest[i + j * net.columns]);
    });
  };
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      if (!inside(i, j)) {
        continue;
      }
      const bool edge = i == 0 || j == 0 || i + 1 == net.columns || j + 1 == net.rows ||
                        !inside(i - 1, j) || !inside(i + 1, j) || !inside(i, j - 1) ||
                        !inside(i, j + 1);
      net.holds[i + j * net.columns] = edge ? SpringHold::kLocked : SpringHold::kFree;
    }
  }
}

// The net on the start, with the lengths of the placed template.
SpringNet MakeNet(const HSplineSurface& start, const PlacedTemplate& placed,
                  const DomainGrid& grid) {
  SpringNet net{.columns = grid.columns,
                .rows = grid.rows,
                .vertices = PointsOn(start, grid),
                .at_rest = PointsOn(placed.face.surface, grid),
                .holds = std::vector(grid.size(), SpringHold::kHeld)};
  HoldFeatures(TemplateMasks(placed.face), net);
  for (const FitPoint& dowel : placed.dowels.points) {
    net.holds[grid.NearestTo(dowel.uv)] = SpringHold::kLocked;
  }
  return net;
}

// The start, moved by a B-spline of the level through the moves of the net.
HSplineSurface MovedByNet(const HSplineSurface& start, const DomainGrid& grid, int level,
                          const std::vector<Vec3>& before, const std::vector<Vec3>& after) {
  std::vector<Vec3> moves;
  for (std::size_t k = 0; k < before.size(); ++k) {
    moves.push_back(after[k] - before[k]);
  }
  const ControlNet net = NetThrough(start.shape(), level, grid, moves);
  const DomainGrid fine = MakeDomainGrid(start.shape());
  std::vector<Vec3> samples = PointsOn(start, fine);
  for (std::size_t k = 0; k < samples.size(); ++k) {
    samples[k] += StencilAt(start.shape(), level, fine.UvAt(k)).Apply(net);
  }
  return SurfaceThrough(start.shape(), fine, samples);
}

LevelSummary AsLevel(const SpringSummary& springs, int level, std::size_t vertices) {
  return {.level = level,
          .fraction = 1,
          .terms = springs.terms,
          .iterations = springs.iterations,
          .free_vertices = static_cast<int>(vertices) - springs.locked,
          .max_move_mm = springs.max_move_mm,
          .solver = "ceres",
          .termination = springs.termination,
          .usable = springs.usable};
}

}  // namespace

MadeFace MakeSpringFace(const SpringFace& options, PlacedTemplate placed, const FaceInput& in,
                        const RunContext& context) {
  const HSplineSurface& generic = placed.face.surface;
  const DomainGrid grid = GridOfNet(generic.shape(), options.level);
  const HSplineSurface start = UnderThinPlate(generic, FromSitesToTips(generic, placed.dowels), 0);
  SpringNet net = MakeNet(start, placed, grid);
  const std::vector<Vec3> before = net.vertices;
  const SpringSummary springs = RelaxSprings(in.implicit, in.shell, options.springs, net, context);
  FaceFit fitted =
      Unfitted(MovedByNet(start, grid, options.level, before, net.vertices), placed.dowels);
  fitted.fit.usable = springs.usable;
  fitted.fit.levels = {AsLevel(springs, options.level, net.vertices.size())};
  return {std::move(placed), std::move(fitted), {}};
}

}  // namespace semblance::problems
