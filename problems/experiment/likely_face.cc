// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/likely_face.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "problems/experiment/face_parts.h"
#include "problems/face/hspline_prior.h"
#include "problems/face/prior_observations.h"
#include "problems/subject/condition_depths.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

// The model's points for dowels at sites that the prior lacks: under the points in which the rays
// of the dowels meet the placed template.
std::map<std::string, ModelPoint> OtherSites(const FitTarget& dowels, const LoadedPrior& prior) {
  std::map<std::string, ModelPoint> others;
  for (const FitPoint& point : dowels.points) {
    if (!prior.face.sites.contains(point.label)) {
      others[point.label] = prior.on_template.under[prior.on_template.grid.NearestTo(point.uv)];
    }
  }
  return others;
}

bool HasOtherSites(const FacePrior& prior, const ShapeTarget& target) {
  return std::ranges::any_of(target.tips,
                             [&](const ShapeTip& tip) { return !prior.sites.contains(tip.label); });
}

// Moves the model's points of sites that the prior lacks to the points of the estimated face that
// are nearest to the tips. They were found on a face that was only placed.
void Reproject(const ShapeEstimate& shape, const FacePrior& prior, ShapeTarget& target) {
  const MeshQuery query(TriMesh{shape.points, prior.model.mean.triangles});
  for (ShapeTip& tip : target.tips) {
    if (!prior.sites.contains(tip.label)) {
      const MeshPoint at = query.Closest(tip.position);
      tip.at = {at.triangle, at.weights};
    }
  }
}

// Estimates twice if the prior lacks a dowel's site. Only the second estimate computes the spread.
ShapeEstimate Estimate(const FacePrior& prior, const PriorUse& use, ShapeTarget& target,
                       const RunContext& context) {
  if (HasOtherSites(prior, target)) {
    const bool compute_spread = std::exchange(target.compute_spread, false);
    Reproject(EstimateShape(prior.model, target, use.estimate, context), prior, target);
    target.compute_spread = compute_spread;
  }
  return EstimateShape(prior.model, target, use.estimate, context);
}

// Without a pose of the subject no rule applies.
RuleMarks ApplySubjectRules(const FaceInput& in, const FacePrior& prior) {
  return in.subject.basis.sites ? ApplyRules(in.experiment.rules, in.subject.points,
                                             in.subject.basis.sites->skull_from_average, prior)
                                : RuleMarks();
}

}  // namespace

std::vector<std::uint64_t> ListDraws(const PriorUse& use, const UncertaintyOptions& options) {
  std::vector<std::uint64_t> random_seeds;
  if (use.draw > 0) {
    random_seeds.push_back(use.draw);
  }
  for (int k = 0; k < options.samples; ++k) {
    random_seeds.push_back(options.random_seed + k);
  }
  return random_seeds;
}

void WidenWhereNoDowelIs(const FacePrior& prior, std::span<const Dowel> dowels,
                         const TableDepthOptions& table, std::span<const Vec3> on_mean,
                         std::vector<double>& sigma_mm) {
  constexpr double kUsualDepth_mm = 10;  // stands for the unknown depth in PublishedSd_mm
  std::map<std::string, Vec3> places;
  for (const auto& [site, at] : prior.sites) {
    places[site] = FindPosition(at, prior.model.mean, prior.model.mean.points);
  }
  std::map<std::string, double> missing_mm;
  for (const auto& [site, place] : places) {
    if (std::ranges::find(dowels, site, &Dowel::site) == dowels.end()) {
      Dowel none;
      none.site = site;
      none.depth_mm = kUsualDepth_mm;
      missing_mm[site] = table.shared * PublishedSd_mm(none);
    }
  }
  for (std::size_t v = 0; v < sigma_mm.size() && !missing_mm.empty(); ++v) {
    const auto nearest = std::ranges::min_element(
        places, {}, [&](const auto& place) { return (place.second - on_mean[v]).squaredNorm(); });
    if (const auto missing = missing_mm.find(nearest->first); missing != missing_mm.end()) {
      sigma_mm[v] = std::hypot(sigma_mm[v], missing->second);
    }
  }
}

std::vector<HSplineSurface> MoveAsDrawn(const LoadedPrior& prior, const MadeFace& made) {
  std::vector<HSplineSurface> drawn;
  for (std::size_t k = 0; k < made.prior->drawn.size(); ++k) {
    drawn.push_back(
        MovedAsDrawn(made.fitted.fit.surface, *made.prior, k, prior.face, prior.on_template));
  }
  return drawn;
}

void TakeDraws(const PriorUse& use, std::vector<HSplineSurface> drawn, MadeFace& made) {
  if (use.draw > 0) {
    made.fitted.fit.surface = std::move(drawn.front());
    MeasureResiduals(made.fitted);
    drawn.erase(drawn.begin());
  }
  made.samples = std::move(drawn);
}

// A table's deviations are those of the population. The options split them into the errors that a
// person's depths share and the rest. Conditioned on known depths of this person, the deviations
// are the depths' own.
TableDepthOptions SplitTableError(const TableDepthOptions& table, const Experiment& experiment) {
  return IsConditioned(experiment.tissue) ? TableDepthOptions{.own = 1, .shared = 0} : table;
}

LikelyFace FindLikelyFace(const PriorUse& use, PlacedTemplate placed, const FaceInput& in,
                          const RunContext& context) {
  const LoadedPrior& prior = *in.prior;
  const std::vector<Dowel>& dowels = in.subject.dowels_on_bone;
  const TableDepthOptions parts = SplitTableError(use.table_depths, in.experiment);
  const TableDepthOptions* const table =
      in.experiment.tissue.depths == DepthSource::kTable ? &parts : nullptr;
  const TriMesh* const implicit = in.implicit.triangles.empty() ? nullptr : &in.implicit;
  ShapeTarget target =
      PriorTarget(prior.face, dowels, table, implicit, OtherSites(placed.dowels, prior));
  if (implicit != nullptr) {
    ImplicitSpread spread =
        ImplicitSpread_mm(use.implicit_spread, *implicit, in.shell, dowels, table, context.threads);
    target.bone = &in.shell;
    target.surface_sd_mm = std::move(spread.sd);
    target.surface_error_mm = std::move(spread.error);
  }
  RuleMarks rules = ApplySubjectRules(in, prior.face);
  target.marks = std::move(rules.marks);
  if (in.draws_faces) {
    target.draws = ListDraws(use, in.experiment.uncertainty);
  }
  target.compute_spread = in.tells_sigma || !target.draws.empty();
  ShapeEstimate shape = Estimate(prior.face, use, target, context);
  for (std::size_t k = 0; k < rules.rules.size(); ++k) {
    rules.rules[k].residual_mm = shape.mark_residual_mm[k];
  }
  if (table != nullptr) {
    WidenWhereNoDowelIs(prior.face, dowels, *table, prior.face.model.mean.points, shape.sigma_mm);
  }
  placed.face_from_template =
      Composed(shape.subject_from_model, prior.on_template.mean_from_template);
  placed.face = InSubjectFrame(in.generic, placed.face_from_template);
  placed.face.surface =
      MakeFaceSurface(shape, prior.face, prior.on_template, in.generic.surface.shape());
  FaceFit unfitted = Unfitted(placed.face.surface, placed.dowels);
  unfitted.fit.usable = shape.usable;
  return {{std::move(placed), std::move(unfitted), std::move(shape), std::move(rules.rules)},
          std::move(target)};
}

}  // namespace semblance::problems
