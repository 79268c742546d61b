// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/recentre.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>

#include "interp/dowels/dowel.h"
#include "problems/face/prior_observations.h"
#include "problems/subject/sites.h"
#include "surfaces/base/parallel.h"
#include "surfaces/base/quantile.h"
#include "surfaces/hspline_query/hspline_project.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

Vec3 MirroredInX(const Vec3& p) { return {-p.x(), p.y(), p.z()}; }

// ---------------------------------------------------------------------------------------------
// Sites
// ---------------------------------------------------------------------------------------------

// Follows the skin closely and the dowels hardly: the dowels' places on the mean are what is
// sought.
ShapeFitOptions CloseFit() {
  ShapeFitOptions options;
  options.tip_normal_sd_mm = 5;
  options.tip_tangent_sd_mm = 15;
  options.surface_points = 1500;
  options.surface_worth = 1500;
  options.surface_sd_mm = 1;
  options.surface_loss_width = 2;
  options.rounds = 25;
  return options;
}

// The places of a head's tips on the mean, by site.
std::map<std::string, Vec3> FindPlaces(const FacePrior& prior, const KnownHead& head, double tip_mm,
                                       const RunContext& context) {
  ShapeTarget target = PriorTarget(prior, head.dowels, nullptr, &head.skin);
  target.features.clear();  // at the features, too, the skin is known
  const ShapeEstimate close = EstimateShape(prior.model, target, CloseFit(), context);
  const MeshQuery face(TriMesh{close.points, prior.model.mean.triangles}), skin(head.skin);
  std::map<std::string, Vec3> places;
  for (const Dowel& dowel : head.dowels) {
    if (skin.Closest(dowel.Tip()).distance_mm <= tip_mm) {
      const MeshPoint at = face.Closest(dowel.Tip());
      places[dowel.site] =
          FindPosition({at.triangle, at.weights}, prior.model.mean, prior.model.mean.points);
    }
  }
  return places;
}

// A weighted sum of places, all mirrored to one side.
struct Places {
  Vec3 sum = Vec3::Zero();
  double weight = 0;

  void Add(const Site& site, const Vec3& place, double w) {
    sum += w * (site.side == Side::kRight ? MirroredInX(place) : place);
    weight += w;
  }
};

// The mean place of each site over all heads and its present place.
std::map<std::string, Vec3> MeanSites(const FacePrior& prior,
                                      std::span<const std::map<std::string, Vec3>> heads,
                                      double site_prior) {
  std::map<std::string, Places> of_landmark;
  for (const Site& site : StandardSites()) {
    const double sides = site.side == Side::kMidline ? 2 : 1;  // a pair counts once per side
    for (const auto& head : heads) {
      if (const auto at = head.find(site.code); at != head.end()) {
        of_landmark[site.landmark].Add(site, at->second, sides);
      }
    }
  }
  std::map<std::string, Vec3> sites;
  for (const Site& site : StandardSites()) {
    const auto own = prior.sites.find(site.code);
    const auto seen = of_landmark.find(site.landmark);
    if (own == prior.sites.end() || seen == of_landmark.end()) {
      continue;
    }
    Places all = seen->second;
    all.Add(site, FindPosition(own->second, prior.model.mean, prior.model.mean.points), site_prior);
    Vec3 place = all.sum / all.weight;
    place.x() *= site.side == Side::kMidline ? 0 : 1;
    sites[site.code] = site.side == Side::kRight ? MirroredInX(place) : place;
  }
  return sites;
}

FacePrior WithSites(FacePrior prior, const std::map<std::string, Vec3>& sites) {
  const MeshQuery query(prior.model.mean);
  for (const auto& [site, place] : sites) {
    const MeshPoint at = query.Closest(place);
    prior.sites[site] = {at.triangle, at.weights};
  }
  return prior;
}

double MedianMove(const FacePrior& before, const FacePrior& after) {
  std::vector<double> moves;
  for (const auto& [site, at] : after.sites) {
    moves.push_back(
        (FindPosition(at, after.model.mean, after.model.mean.points) -
         FindPosition(before.sites.at(site), before.model.mean, before.model.mean.points))
            .norm());
  }
  return UpperMedian(moves);
}

// ---------------------------------------------------------------------------------------------
// Mean
// ---------------------------------------------------------------------------------------------

// The distance by which a head's skin lies outside its face by the prior, at each point of the
// model and in the model's mm. NaN if no skin lies in front of the point.
std::vector<double> Misfit(const FacePrior& prior, const KnownHead& head,
                           const RecentreOptions& options, const RunContext& context) {
  ShapeFitOptions dowels_alone;
  dowels_alone.surface_points = 0;
  const ShapeEstimate face = EstimateShape(
      prior.model, PriorTarget(prior, head.dowels, nullptr, nullptr), dowels_alone, context);
  const std::vector<Vec3> normals = VertexNormals({face.points, prior.model.mean.triangles});
  const MeshQuery skin(head.skin);
  std::vector<double> misfit_mm(face.points.size(), kNaN);
  ParallelFor(misfit_mm.size(), context.threads, 256, [&](std::size_t v) {
    const Vec3 way = skin.Closest(face.points[v]).position - face.points[v];
    const double along = way.dot(normals[v]), beside = (way - along * normals[v]).norm();
    if (beside <= options.gap_mm && std::abs(along) <= options.farthest_mm) {
      misfit_mm[v] = along / face.subject_from_model.scale;
    }
  });
  return misfit_mm;
}

// For each point of the model, the one nearest to its mirror image.
std::vector<int> Partners(const TriMesh& mean, const RunContext& context) {
  const MeshQuery query(mean);
  std::vector<int> partner(mean.points.size(), -1);
  ParallelFor(partner.size(), context.threads, 256, [&](std::size_t v) {
    const MeshPoint at = query.Closest(MirroredInX(mean.points[v]));
    int corner = 0;
    at.weights.maxCoeff(&corner);
    partner[v] = mean.triangles[at.triangle][corner];
  });
  return partner;
}

struct Sums {
  std::vector<double> sum, count;
};

Sums SumBothSides(const std::vector<std::vector<double>>& misfits,
                  const std::vector<int>& partner) {
  Sums sums{std::vector<double>(partner.size(), 0), std::vector<double>(partner.size(), 0)};
  for (const std::vector<double>& misfit_mm : misfits) {
    for (std::size_t v = 0; v < partner.size(); ++v) {
      for (const double value : {misfit_mm[v], misfit_mm[partner[v]]}) {
        sums.sum[v] += std::isfinite(value) ? value : 0;
        sums.count[v] += std::isfinite(value) ? 1 : 0;
      }
    }
  }
  return sums;
}

// The shift of each point along its normal: the Gaussian mean over its neighbourhood, shrunk
// towards 0 by options.mean_prior. Weights beyond 3 standard deviations are left out.
std::vector<double> Shifts(const TriMesh& mean, const Sums& sums, const RecentreOptions& options,
                           const RunContext& context) {
  const std::vector<double> areas = VertexAreas(mean);
  const double width = 2 * options.smooth_mm * options.smooth_mm, far = 4.5 * width;
  std::vector<double> shift_mm(mean.points.size(), 0);
  ParallelFor(shift_mm.size(), context.threads, 16, [&](std::size_t v) {
    double sum = 0, count = 0;
    for (std::size_t k = 0; k < mean.points.size(); ++k) {
      const double squared = (mean.points[k] - mean.points[v]).squaredNorm();
      if (squared <= far) {
        const double weight = areas[k] * std::exp(-squared / width);
        sum += weight * sums.sum[k];
        count += weight * (sums.count[k] + options.mean_prior);
      }
    }
    shift_mm[v] = count > 0 ? sum / count : 0;
  });
  return shift_mm;
}

// ---------------------------------------------------------------------------------------------
// Back to the template
// ---------------------------------------------------------------------------------------------

HSplineSurface Shifted(const TemplateFace& face, const FacePrior& prior,
                       const PriorOnTemplate& on_template, const std::vector<double>& shift_mm) {
  const std::vector<Vec3> normals = VertexNormals(prior.model.mean);
  const Similarity& place = on_template.mean_from_template;
  std::vector<Vec3> samples;
  for (std::size_t k = 0; k < on_template.under.size(); ++k) {
    const ModelPoint& under = on_template.under[k];
    const Triangle& t = prior.model.mean.triangles[under.triangle];
    Vec3 move = Vec3::Zero();
    for (int corner = 0; corner < 3; ++corner) {
      move += under.weights[corner] * shift_mm[t[corner]] * normals[t[corner]];
    }
    samples.emplace_back(face.surface.Point(on_template.grid.UvAt(k)) +
                         place.rotation.transpose() * move / place.scale);
  }
  return SurfaceThrough(face.surface.shape(), on_template.grid, samples);
}

std::map<std::string, Vec2> SiteUv(const TemplateFace& face, const PriorOnTemplate& on_template,
                                   const std::map<std::string, Vec3>& sites) {
  const SurfaceProjector projector(face.surface);
  const Similarity& place = on_template.mean_from_template;
  std::map<std::string, Vec2> uv = face.site_uv;
  for (const auto& [site, at] : sites) {
    uv[site] =
        projector.Project(place.rotation.transpose() * (at - place.translation) / place.scale).uv;
    uv[site].x() = SideOfSite(site) == Side::kMidline ? 0.5 : uv[site].x();
  }
  return uv;
}

}  // namespace

Recentred Recentre(const FacePrior& prior, const PriorOnTemplate& on_template,
                   const TemplateFace& face, std::span<const KnownHead> heads,
                   const RecentreOptions& options, const RunContext& context) {
  std::vector<std::map<std::string, Vec3>> places;
  for (const KnownHead& head : heads) {
    places.push_back(FindPlaces(prior, head, options.tip_mm, context));
  }
  const std::map<std::string, Vec3> sites = MeanSites(prior, places, options.site_prior);
  const FacePrior moved = WithSites(prior, sites);
  Recentred result{.face = face};
  result.face.site_uv = SiteUv(face, on_template, sites);
  result.sites_moved_mm = MedianMove(prior, moved);
  result.mean_moved_mm = result.mean_moved_most_mm = 0;
  if (!options.move_mean) {
    return result;
  }
  std::vector<std::vector<double>> misfits;
  for (const KnownHead& head : heads) {
    misfits.push_back(Misfit(moved, head, options, context));
  }
  const TriMesh& mean = prior.model.mean;
  const Sums sums = SumBothSides(misfits, Partners(mean, context));
  const std::vector<double> shift_mm = Shifts(mean, sums, options, context);
  result.face.surface = Shifted(face, prior, on_template, shift_mm);
  double squares = 0, seen = 0, most = 0;
  for (std::size_t v = 0; v < shift_mm.size(); ++v) {
    squares += sums.count[v] > 0 ? shift_mm[v] * shift_mm[v] : 0;
    seen += sums.count[v] > 0 ? 1 : 0;
    most = std::max(most, std::abs(shift_mm[v]));
  }
  result.mean_moved_mm = std::sqrt(squares / seen);
  result.mean_moved_most_mm = most;
  return result;
}

}  // namespace semblance::problems
