// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/prior/prior_surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fitting/problem/placement.h"
#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance {
namespace {

constexpr double kFarthestRmsMm = 5;

Similarity PlaceBySites(const FacePrior& prior, const TemplateFace& face) {
  std::vector<Vec3> on_template, on_mean;
  for (const auto& [site, at] : prior.sites) {
    if (const auto uv = face.site_uv.find(site); uv != face.site_uv.end()) {
      on_template.push_back(face.surface.Point(uv->second));
      on_mean.push_back(PositionOf(at, prior.model.mean, prior.model.mean.points));
    }
  }
  return PlaceTemplate(on_template, on_mean);
}

std::vector<MeshPoint> ClosestPoints(const std::vector<Vec3>& points, const Similarity& to_from,
                                     const MeshQuery& query, const RunContext& context) {
  std::vector<MeshPoint> closest(points.size());
  ParallelFor(points.size(), context.threads, 256,
              [&](std::size_t k) { closest[k] = query.Closest(to_from * points[k]); });
  return closest;
}

// Iterated closest points (Besl & McKay 1992) from the sites' similarity, without far ones.
Similarity PlaceByClosestPoints(const std::vector<Vec3>& samples, Similarity mean_from_template,
                                const MeshQuery& query, const RunContext& context) {
  constexpr int kRounds = 10;
  constexpr double kFarMm = 5;
  constexpr std::size_t kEvery = 29;  // samples are many
  std::vector<Vec3> some;
  for (std::size_t k = 0; k < samples.size(); k += kEvery) {
    some.push_back(samples[k]);
  }
  for (int round = 0; round < kRounds; ++round) {
    std::vector<Vec3> from, to;
    const std::vector<MeshPoint> closest = ClosestPoints(some, mean_from_template, query, context);
    for (std::size_t k = 0; k < some.size(); ++k) {
      if (closest[k].distance_mm < kFarMm) {
        from.push_back(some[k]);
        to.push_back(closest[k].position);
      }
    }
    if (from.size() >= 10) {
      mean_from_template = PlaceTemplate(from, to);
    }
  }
  return mean_from_template;
}

}  // namespace

Similarity Composed(const Similarity& outer, const Similarity& inner) {
  Similarity result;
  result.scale = outer.scale * inner.scale;
  result.rotation = outer.rotation * inner.rotation;
  result.translation = outer * inner.translation;
  return result;
}

PriorOnTemplate LayOnTemplate(const FacePrior& prior, const TemplateFace& face,
                              const RunContext& context) {
  PriorOnTemplate result{
      .grid = GridOf(face.surface.shape()), .under = {}, .beside = {}, .mean_from_template = {}};
  std::vector<Vec3> samples(result.grid.size());
  for (std::size_t k = 0; k < samples.size(); ++k) {
    samples[k] = face.surface.Point(result.grid.UvAt(k));
  }
  const MeshQuery query(prior.model.mean);
  result.mean_from_template =
      PlaceByClosestPoints(samples, PlaceBySites(prior, face), query, context);
  double sum = 0;
  const std::vector<MeshPoint> closest =
      ClosestPoints(samples, result.mean_from_template, query, context);
  for (std::size_t k = 0; k < samples.size(); ++k) {
    result.under.push_back({closest[k].triangle, closest[k].weights});
    result.beside.emplace_back(result.mean_from_template * samples[k] - closest[k].position);
    sum += closest[k].distance_mm * closest[k].distance_mm;
  }
  result.rms_mm = std::sqrt(sum / static_cast<double>(samples.size()));
  if (!(result.rms_mm <= kFarthestRmsMm)) {
    throw InputError(
        fmt::format("prior: the template is {:.1f} mm (RMS) from the model's mean; make a template "
                    "from the mean with `semblance template`",
                    result.rms_mm));
  }
  return result;
}

HSplineSurface SurfaceOf(const ShapeEstimate& estimate, const FacePrior& prior,
                         const PriorOnTemplate& on_template, const HSplineShape& shape) {
  const Similarity& place = estimate.subject_from_model;
  std::vector<Vec3> samples;
  for (std::size_t k = 0; k < on_template.under.size(); ++k) {
    samples.emplace_back(PositionOf(on_template.under[k], prior.model.mean, estimate.points) +
                         place.scale * (place.rotation * on_template.beside[k]));
  }
  return SurfaceThrough(shape, on_template.grid, samples);
}

HSplineSurface MovedAsDrawn(const HSplineSurface& face, const ShapeEstimate& estimate,
                            std::size_t draw, const FacePrior& prior,
                            const PriorOnTemplate& on_template) {
  std::vector<Vec3> moves = estimate.drawn.at(draw), samples;
  for (std::size_t v = 0; v < moves.size(); ++v) {
    moves[v] -= estimate.points[v];
  }
  for (std::size_t k = 0; k < on_template.under.size(); ++k) {
    samples.emplace_back(face.Point(on_template.grid.UvAt(k)) +
                         PositionOf(on_template.under[k], prior.model.mean, moves));
  }
  return SurfaceThrough(face.shape(), on_template.grid, samples);
}

std::vector<double> SigmaAt(std::span<const Vec2> uv, const ShapeEstimate& estimate,
                            const FacePrior& prior, const PriorOnTemplate& on_template) {
  std::vector<double> sigma_mm;
  for (const Vec2& at : uv) {
    const ModelPoint& under = on_template.under[on_template.grid.NearestTo(at)];
    const Triangle& t = prior.model.mean.triangles[under.triangle];
    sigma_mm.push_back(under.weights[0] * estimate.sigma_mm[t[0]] +
                       under.weights[1] * estimate.sigma_mm[t[1]] +
                       under.weights[2] * estimate.sigma_mm[t[2]]);
  }
  return sigma_mm;
}

std::vector<ShapePoint> ShapePointsOf(const HSplineSurface& surface, const ShapeEstimate& estimate,
                                      const FacePrior& prior, const PriorOnTemplate& on_template) {
  constexpr int kSide = 64;  // two along each side of a patch of level 2 of 16 patches a side
  std::vector<Vec2> uv;
  for (int k = 0; k < kSide * kSide; ++k) {
    uv.emplace_back((k % kSide + 0.5) / kSide, (k / kSide + 0.5) / kSide);
  }
  const std::vector<double> sigma_mm = SigmaAt(uv, estimate, prior, on_template);
  std::vector<ShapePoint> points;
  for (std::size_t k = 0; k < uv.size(); ++k) {
    const SurfaceFrame frame = surface.Frame(uv[k]);
    if (const double area = frame.du.cross(frame.dv).norm(); area > 0) {
      points.push_back(
          {.uv = uv[k], .position = surface.Point(uv[k]), .sd_mm = sigma_mm[k], .share = area});
    }
  }
  return points;
}

std::vector<Sphere> FeaturesOn(const ShapeEstimate& estimate, const FacePrior& prior) {
  const std::vector<Vec3>& mean = prior.model.mean.points;
  std::vector<Sphere> features;
  for (const ShapeFeature& feature : prior.features) {
    const auto nearest =
        std::min_element(mean.begin(), mean.end(), [&](const Vec3& a, const Vec3& b) {
          return (a - feature.position).squaredNorm() < (b - feature.position).squaredNorm();
        });
    features.push_back({.center = estimate.points[nearest - mean.begin()],
                        .radius_mm = estimate.subject_from_model.scale * feature.clearance_mm});
  }
  return features;
}

}  // namespace semblance
