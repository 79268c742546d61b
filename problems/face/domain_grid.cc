// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/domain_grid.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

using Matrix = Eigen::MatrixXd;

enum class Along { kU, kV };

// Returns (A'A)^-1 A', which maps the samples of a line of the grid to its B-spline vertices. Row s
// of A holds the weights of the vertices at sample s. Summed over the other direction, the weights
// of a surface's stencil are those of the line.
Matrix LeastSquares(const HSplineShape& shape, int level, Along along, int samples) {
  const int columns = shape.Columns(level);
  Matrix rows = Matrix::Zero(samples, along == Along::kU ? columns : shape.Rows(level));
  for (int s = 0; s < samples; ++s) {
    const double t = static_cast<double>(s) / (samples - 1);
    const Stencil stencil = StencilAt(shape, level, along == Along::kU ? Vec2(t, 0) : Vec2(0, t));
    for (int k = 0; k < 16; ++k) {
      const int vertex = stencil.index[k];
      rows(s, along == Along::kU ? vertex % columns : vertex / columns) += stencil.weight[k];
    }
  }
  return (rows.transpose() * rows).ldlt().solve(rows.transpose());
}

}  // namespace

std::size_t DomainGrid::NearestTo(const Vec2& uv) const {
  const auto cell = [](double t, int count) {
    return static_cast<std::size_t>(std::lround(std::clamp(t, 0.0, 1.0) * (count - 1)));
  };
  return cell(uv.x(), columns) + columns * cell(uv.y(), rows);
}

double DomainGrid::Interpolate(std::span<const double> values, const Vec2& uv) const {
  const double x = uv.x() * (columns - 1), y = uv.y() * (rows - 1);
  const int i = std::clamp(static_cast<int>(x), 0, columns - 2);
  const int j = std::clamp(static_cast<int>(y), 0, rows - 2);
  const auto at = [&](int column, int row) { return values[column + row * columns]; };
  const auto mix = [](double a, double b, double share) { return (1 - share) * a + share * b; };
  return mix(mix(at(i, j), at(i + 1, j), x - i), mix(at(i, j + 1), at(i + 1, j + 1), x - i), y - j);
}

DomainGrid MakeDomainGrid(const HSplineShape& shape) {
  constexpr int kPerPatch = 3;
  constexpr int kLeastPatches = 32;  // coarse surfaces are sampled as if they had so many
  if (shape.closure != Closure::kOpen) {
    throw InputError(fmt::format("template: the surface is {}; a prior needs one that is open",
                                 EnumNames(shape.closure)[static_cast<int>(shape.closure)]));
  }
  const auto samples = [=](int patches) {
    return kPerPatch * std::max(patches, kLeastPatches) + 1;
  };
  return {samples(shape.PatchesU(shape.max_level)), samples(shape.PatchesV(shape.max_level))};
}

ControlNet NetThrough(const HSplineShape& shape, int level, const DomainGrid& grid,
                      std::span<const Vec3> samples) {
  const Matrix along_u = LeastSquares(shape, level, Along::kU, grid.columns);
  const Matrix along_v = LeastSquares(shape, level, Along::kV, grid.rows);
  ControlNet net{.columns = static_cast<int>(along_u.rows()),
                 .rows = static_cast<int>(along_v.rows()),
                 .vertices = {}};
  net.vertices.resize(static_cast<std::size_t>(net.columns) * net.rows);
  using Strided = Eigen::Map<const Matrix, 0, Eigen::Stride<Eigen::Dynamic, 3>>;
  for (int axis = 0; axis < 3; ++axis) {
    const Strided values(samples.front().data() + axis, grid.columns, grid.rows,
                         Eigen::Stride<Eigen::Dynamic, 3>(3 * Eigen::Index{grid.columns}, 3));
    const Matrix vertices = along_u * values * along_v.transpose();
    for (int j = 0; j < net.rows; ++j) {
      for (int i = 0; i < net.columns; ++i) {
        net.At(i, j)[axis] = vertices(i, j);
      }
    }
  }
  return net;
}

HSplineSurface SurfaceThrough(const HSplineShape& shape, const DomainGrid& grid,
                              std::span<const Vec3> samples, double tolerance_mm) {
  HSplineSurface surface(shape, NetThrough(shape, 0, grid, samples));
  for (int level = 1; level <= shape.max_level; ++level) {
    const ControlNet target = NetThrough(shape, level, grid, samples);
    ControlNet net = surface.Net(level);
    for (std::size_t k = 0; k < net.vertices.size(); ++k) {
      if ((target.vertices[k] - net.vertices[k]).norm() > tolerance_mm) {
        net.vertices[k] = target.vertices[k];
      }
    }
    surface.SetNet(level, net);
  }
  return surface;
}

}  // namespace semblance::problems
