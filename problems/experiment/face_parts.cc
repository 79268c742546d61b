// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/face_parts.h"

#include <cmath>
#include <utility>
#include <variant>

#include "problems/face/domain_grid.h"
#include "surfaces/base/thin_plate.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

// Moves seeds from the triangles of the implicit face onto the surface itself. Triangles cut its
// curves short, by an amount that depends on the place of the grid's cells.
void LayOnField(const HSplineSurface& surface, const SeedOptions& options,
                const ImplicitSurface* field, std::vector<FitPoint>& seeds) {
  constexpr double kReach_mm = 2;
  if (field == nullptr) {
    return;
  }
  for (FitPoint& seed : seeds) {
    const Vec3 direction = surface.LevelFrame(options.direction_level, seed.uv).Normal();
    seed.position = FindOnLine(*field, seed.position, direction, kReach_mm).value_or(seed.position);
  }
}

}  // namespace

TemplateFace InSubjectFrame(const TemplateFace& generic, const Similarity& face_from_template) {
  TemplateFace placed = generic;
  placed.surface = Transformed(generic.surface, face_from_template);
  for (TemplateFeature& feature : placed.features) {
    if (feature.region) {
      feature.region = TransformedSphere(*feature.region, face_from_template);
    }
  }
  return placed;
}

SeedResult MakeSeeds(const HSplineSurface& surface, const MeshQuery& query, const FaceInput& in,
                     std::span<const Sphere> masks, const SeedSource& source) {
  const auto* const options = std::get_if<SeedOptions>(&source);
  if (options == nullptr) {
    return {.points = {}, .masked = 0, .missed = 0, .folded = 0};
  }
  SeedResult seeding = SeedDowels(surface, query, in.implicit, masks, *options);
  LayOnField(surface, *options, in.field, seeding.points);
  return seeding;
}

void MeasureResiduals(FaceFit& fitted) {
  FitResult& fit = fitted.fit;
  double all = 0, weight = 0, of_dowels = 0, dowel_weight = 0;
  fit.residual_mm.clear();
  for (std::size_t k = 0; k < fitted.target.points.size(); ++k) {
    const FitPoint& point = fitted.target.points[k];
    fit.residual_mm.push_back((fit.surface.Point(fit.uv[k]) - point.position).norm());
    const double squared = point.weight * fit.residual_mm[k] * fit.residual_mm[k];
    all += squared;
    weight += point.weight;
    if (point.role != PointRole::kSeed) {
      of_dowels += squared;
      dowel_weight += point.weight;
    }
  }
  fit.point_rms_mm = std::sqrt(all / weight);
  fit.dowel_rms_mm = std::sqrt(of_dowels / dowel_weight);
}

PointPairs FromSitesToTips(const HSplineSurface& surface, const FitTarget& dowels) {
  PointPairs pairs;
  for (const FitPoint& point : dowels.points) {
    pairs.from.push_back(surface.Point(point.uv));
    pairs.to.push_back(point.position);
  }
  return pairs;
}

HSplineSurface UnderThinPlate(const HSplineSurface& surface, const PointPairs& pairs,
                              double stiffness_mm) {
  std::vector<Vec3> samples;
  const ThinPlate plate = FitThinPlate(pairs.from, pairs.to, {}, {.stiffness_mm = stiffness_mm});
  const DomainGrid grid = MakeDomainGrid(surface.shape());
  for (std::size_t k = 0; k < grid.size(); ++k) {
    samples.push_back(plate(surface.Point(grid.UvAt(k))));
  }
  return SurfaceThrough(surface.shape(), grid, samples);
}

FaceFit Unfitted(HSplineSurface surface, const FitTarget& dowels) {
  FitResult fit{.surface = std::move(surface)};
  for (const FitPoint& point : dowels.points) {
    fit.uv.push_back(point.uv);
  }
  fit.restored_features = 0;
  fit.usable = true;
  FaceFit unfitted{{.points = {}, .masked = 0, .missed = 0, .folded = 0}, dowels, std::move(fit)};
  MeasureResiduals(unfitted);
  return unfitted;
}

}  // namespace semblance::problems
