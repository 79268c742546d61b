// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/height_field.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "surfaces/base/error.h"
#include "surfaces/base/quantile.h"

namespace semblance::problems {
namespace {

// The distance between the 2 % and 98 % quantiles of one coordinate.
double Spread(std::span<const Vec3> positions, int coordinate) {
  constexpr std::size_t kSample = 100'000;  // bounds the memory
  constexpr double kTail = 0.02;
  std::vector<double> values;
  for (std::size_t k = 0; k < positions.size();
       k += std::max<std::size_t>(positions.size() / kSample, 1)) {
    values.push_back(positions[k][coordinate]);
  }
  return Quantile(values, 1 - kTail) - Quantile(values, kTail);
}

}  // namespace

double HeightFactor(std::span<const Vec3> positions) {
  // Trades slopes, which change the lengths of u and v (0.25: by at most 3 %), for digits.
  constexpr double kShare = 0.25;
  const double height = Spread(positions, 2),
               place = std::max(Spread(positions, 0), Spread(positions, 1));
  return height > 0 && place > 0 ? kShare * place / height : 1;
}

void ScaleHeights(double factor, std::span<Vec3> positions) {
  for (Vec3& p : positions) {
    p.z() *= factor;
  }
}

HSplineSurface WithScaledHeights(const HSplineSurface& surface, double factor) {
  if (surface.shape().reference != OffsetReference::kWorld) {
    throw InputError("heights: the surface's offsets do not lie along x, y and z");
  }
  ControlNet net = surface.Net(0);
  ScaleHeights(factor, net.vertices);
  HSplineSurface scaled(surface.shape(), net);
  for (int level = 1; level <= surface.shape().max_level; ++level) {
    std::map<VertexId, std::optional<Vec3>> offsets;
    for (const auto& [vertex, offset] : surface.Offsets(level)) {
      offsets.emplace_hint(offsets.end(), vertex,
                           Vec3(offset.x(), offset.y(), factor * offset.z()));
    }
    scaled.SetOffsets(offsets);
  }
  return scaled;
}

void ScaleHeights(double factor, FitResult& fit) {
  fit.surface = WithScaledHeights(fit.surface, factor);
  for (double& distance : fit.residual_mm) {
    distance *= factor;
  }
  fit.point_rms_mm *= factor;
  fit.dowel_rms_mm *= factor;
  for (LevelSummary& level : fit.levels) {
    level.rms_before_mm *= factor;
    level.rms_after_mm *= factor;
  }
  if (!fit.automatic) {
    return;
  }
  AutoReport& report = *fit.automatic;
  for (double* const length :
       {&report.noise_mm, &report.neighbour_noise_mm, &report.closer_noise_mm,
        &report.held_out_rms_mm, &report.by_weight.light_mm, &report.by_weight.heavy_mm,
        &report.run_offset_mm, &report.lattice_mm}) {
    *length *= factor;
  }
  for (NestedRound& round : report.rounds) {
    round.rms_mm *= factor;
    round.held_out_rms_mm *= factor;
  }
}

std::optional<GraphMap> GraphMap::Of(const HSplineSurface& surface) {
  constexpr int kPlaces = 4;       // along u and v
  constexpr double kExact = 1e-7;  // of the lengths; files keep at least as many digits
  if (surface.shape().ClosedU()) {
    return std::nullopt;
  }
  const auto at = [&](double u, double v) -> Vec2 { return surface.Point({u, v}).head<2>(); };
  GraphMap map;
  map.origin_ = at(0, 0);
  Eigen::Matrix2d xy_from_uv;
  xy_from_uv << at(1, 0) - map.origin_, at(0, 1) - map.origin_;
  map.lengths_ = Vec2(xy_from_uv.col(0).norm(), xy_from_uv.col(1).norm());
  if (!(std::abs(xy_from_uv.determinant()) > kExact * map.lengths_.prod())) {
    return std::nullopt;
  }
  for (int i = 0; i <= kPlaces; ++i) {
    for (int j = 0; j <= kPlaces; ++j) {
      const Vec2 uv = Vec2(i, j) / kPlaces, xy = at(uv.x(), uv.y());
      if (!((xy - map.origin_ - xy_from_uv * uv).norm() < kExact * map.lengths_.norm())) {
        return std::nullopt;
      }
      map.box_.extend(xy);
    }
  }
  map.uv_from_xy_ = xy_from_uv.inverse();
  return map;
}

}  // namespace semblance::problems
