// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <limits>

#include "fitting/uncertainty/error_propagation.h"
#include "interp/evaluation/scores.h"
#include "interp/kriging/kriging_process.h"
#include "problems/experiment/uncertainty.h"
#include "problems/face/prior_observations.h"
#include "problems/subject/condition_depths.h"
#include "surfaces/base/parallel.h"
#include "surfaces/base/quantile.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

// The depth behind a point of the fit: its place on the skull, and its uncertainty by the dowels.
struct DepthBehind {
  Vec3 base = Vec3::Constant(kNaN);
  double dowels_sd_mm = 0;
  double depth_mm = kNaN;
};

bool FromTable(const Experiment& experiment) {
  return experiment.tissue.depths == DepthSource::kTable;
}

// The dowels with the deviation that their source states, else the option's, else the published
// one.
std::vector<Dowel> WithSd(std::vector<Dowel> dowels, const Experiment& experiment) {
  const double option_mm = experiment.uncertainty.dowel_sd_mm;
  for (Dowel& dowel : dowels) {
    if (!std::isfinite(dowel.sd_mm)) {
      dowel.sd_mm = FromTable(experiment) && option_mm == 0 ? PublishedSd_mm(dowel) : option_mm;
    }
  }
  return dowels;
}

// The dowels' deviations, weighted by inverse squared distance.
double SdNear(std::span<const Dowel> dowels, const Vec3& p) {
  double sum = 0, weights = 0;
  for (const Dowel& dowel : dowels) {
    const double weight = 1 / std::max((dowel.base - p).squaredNorm(), 1e-6);
    sum += weight * dowel.sd_mm;
    weights += weight;
  }
  return sum / weights;
}

// The corner of the shell that is nearest to a point on it.
std::int32_t NearestCorner(const TriMesh& shell, const MeshPoint& at) {
  const Triangle& t = shell.triangles[at.triangle];
  return *std::min_element(t.begin(), t.end(), [&](std::int32_t a, std::int32_t b) {
    return (shell.points[a] - at.position).squaredNorm() <
           (shell.points[b] - at.position).squaredNorm();
  });
}

// True if the scheme's deviations cover the dowels' errors alone. The deviations of the three
// other schemes also cover the error between dowels, which kriging states here already.
bool StatesDowelsAlone(const Experiment& experiment) {
  const DepthScheme scheme = WayToDepth(experiment);
  return !std::holds_alternative<SurfaceMatern>(scheme) &&
         !std::holds_alternative<AutoScheme>(scheme) &&
         !std::holds_alternative<PopulationDepth>(scheme);
}

std::vector<DepthBehind> DepthsBehind(const Experiment& experiment, const FitTarget& target,
                                      const DepthStage& stage, std::span<const Dowel> dowels,
                                      const RunContext& context) {
  const MeshQuery shell(stage.shell);
  std::vector<DepthBehind> depths(target.points.size());
  ParallelFor(depths.size(), context.threads, 64, [&](std::size_t k) {
    const FitPoint& point = target.points[k];
    const auto dowel = std::find_if(dowels.begin(), dowels.end(),
                                    [&](const Dowel& d) { return d.site == point.label; });
    if (dowel != dowels.end()) {
      depths[k] = {dowel->base, dowel->sd_mm, dowel->depth_mm};
      return;
    }
    const MeshPoint at = shell.Closest(point.position);
    const std::int32_t corner = NearestCorner(stage.shell, at);
    const double stated = StatesDowelsAlone(experiment) ? stage.depth.sd_mm[corner] : kNaN;
    depths[k] = {at.position, std::isfinite(stated) ? stated : SdNear(dowels, at.position),
                 stage.depth.depth_mm[corner]};
  });
  return depths;
}

// Adds sd_i sd_j times the correlation of depths at their bases, Matern 3/2 as kriging's default.
void AddSmoothErrors(std::span<const DepthBehind> depths, const std::vector<double>& sd_mm,
                     double length_mm, Eigen::MatrixXd& covariance) {
  for (std::size_t i = 0; i < depths.size(); ++i) {
    for (std::size_t j = 0; j < depths.size(); ++j) {
      const double between_mm = (depths[i].base - depths[j].base).norm();
      covariance(i, j) +=
          sd_mm[i] * sd_mm[j] * CorrelationAt(Covariance::kMatern32, between_mm, length_mm).value;
    }
  }
}

// Adds the difference of the scheme's depths from the likeliest ones, taken as one deviation.
void AddKnownError(std::span<const DepthBehind> depths, const Eigen::VectorXd& likeliest_mm,
                   Eigen::MatrixXd& covariance) {
  Eigen::VectorXd off(likeliest_mm.size());
  for (Eigen::Index k = 0; k < off.size(); ++k) {
    const double depth_mm = depths[k].depth_mm;
    off[k] = std::isfinite(depth_mm) ? depth_mm - likeliest_mm[k] : 0;
  }
  covariance += off * off.transpose();
}

// The deviations of a table's depths, split into the error that all depths of a person share and
// the rest.
struct SplitDeviations {
  Eigen::VectorXd shared_mm;
  std::vector<double> own_mm;
};

SplitDeviations Split(const Experiment& experiment, std::span<const DepthBehind> depths) {
  const bool at_large = FromTable(experiment) && !IsConditioned(experiment.tissue);
  const double shared = at_large ? experiment.uncertainty.shared : 0,
               own = at_large ? experiment.uncertainty.own : 1;
  SplitDeviations split{Eigen::VectorXd::Zero(std::ssize(depths)), {}};
  for (std::size_t k = 0; k < depths.size(); ++k) {
    const double sd_mm = depths[k].dowels_sd_mm;
    split.shared_mm[static_cast<Eigen::Index>(k)] = shared * sd_mm;
    split.own_mm.push_back(own * sd_mm);
  }
  return split;
}

// The covariance of the points' depths, mm^2. Sets the parameters of kriging in the result.
Eigen::MatrixXd DepthCovariance(const Experiment& experiment, const DepthInput& input,
                                std::span<const DepthBehind> depths, FaceUncertainty& result,
                                const RunContext& context) {
  const auto* const own = std::get_if<Kriging>(&experiment.interp);
  Kriging kriging = own == nullptr ? Kriging{.nugget_share = 0} : *own;
  const DepthProcess model = FitKriging(kriging, input, context);
  kriging.length_mm = result.depth_length_mm = model.length_mm;
  kriging.signal_mm = result.depth_signal_mm = model.signal_mm;
  std::vector<Vec3> bases;
  for (const DepthBehind& depth : depths) {
    bases.push_back(depth.base);
  }
  const SplitDeviations sd = Split(experiment, depths);
  DepthPosterior posterior = KrigingPosterior(kriging, input, bases, context);
  posterior.covariance += sd.shared_mm * sd.shared_mm.transpose();
  if (own == nullptr) {
    AddSmoothErrors(depths, sd.own_mm, model.length_mm, posterior.covariance);
    AddKnownError(depths, posterior.mean_mm, posterior.covariance);
  }
  return std::move(posterior.covariance);
}

PointErrors FindPointErrors(const Experiment& experiment, const DepthStage& stage,
                            const HSplineSurface& surface, const FitTarget& target,
                            FaceUncertainty& result, const RunContext& context) {
  const std::vector<Dowel> dowels = WithSd(stage.dowels_on_shell, experiment);
  DepthInput input = stage.Input();
  input.dowels = dowels;
  const std::vector<DepthBehind> depths = DepthsBehind(experiment, target, stage, dowels, context);
  Eigen::MatrixXd covariance = DepthCovariance(experiment, input, depths, result, context);
  PointErrors errors;
  std::vector<double> laid_mm;  // seeds alone
  for (const FitPoint& point : target.points) {
    const auto dowel = std::find_if(dowels.begin(), dowels.end(),
                                    [&](const Dowel& d) { return d.site == point.label; });
    errors.directions.push_back(dowel != dowels.end() ? dowel->direction
                                                      : surface.Normal(point.uv));
    laid_mm.push_back(point.role == PointRole::kSeed ? experiment.uncertainty.implicit_sd_mm : 0);
  }
  AddSmoothErrors(depths, laid_mm, result.depth_length_mm, covariance);
  errors.root = PivotedRoot(std::move(covariance));
  return errors;
}

int FinestLevel(const FitResult& fit) {
  int finest = 0;
  for (const LevelSummary& level : fit.levels) {
    finest = std::max(finest, level.level);
  }
  return finest;
}

// The terms of the last solve, with the hold that it needed (FitLevelHeld).
std::vector<Term> TermsOfLastSolve(const Experiment& experiment, const FitResult& fit) {
  std::vector<Term> terms = experiment.fit.terms;
  if (!fit.levels.empty() && fit.levels.back().hold > 0) {
    terms.emplace_back(PriorTerm{.weight = fit.levels.back().hold});
  }
  return terms;
}

FitTarget WithFinalUv(FitTarget target, const FitResult& fit) {
  for (std::size_t k = 0; k < target.points.size(); ++k) {
    target.points[k].uv = fit.uv[k];
  }
  return target;
}

// Adds the generic face's own misfit, which grows away from the points.
void AddTemplateMisfit(const UncertaintyOptions& o, const Tessellation& face,
                       const HSplineSurface& surface, const FitTarget& target,
                       std::vector<double>& sigma_mm, const RunContext& context) {
  std::vector<Vec3> points;
  for (const FitPoint& point : target.points) {
    points.push_back(surface.Point(point.uv));
  }
  ParallelFor(sigma_mm.size(), context.threads, 256, [&](std::size_t v) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Vec3& p : points) {
      nearest = std::min(nearest, (p - face.mesh.points[v]).squaredNorm());
    }
    const double unseen = 1 - std::exp(-nearest / (o.unseen_reach_mm * o.unseen_reach_mm));
    sigma_mm[v] = std::hypot(sigma_mm[v], o.template_sd_mm, o.unseen_sd_mm * std::sqrt(unseen));
  });
}

// Sigma at the vertices that share a patch of the finest level with a point of the fit, else NaN.
std::vector<double> WhereHeld(const std::vector<double>& sigma_mm, const std::vector<Vec2>& uv,
                              const FitTarget& target, const HSplineShape& shape, int level) {
  const int across = shape.PatchesU(level), up = shape.PatchesV(level);
  const auto patch = [&](const Vec2& at) {
    const auto cell = [](double x, int n) { return std::clamp(static_cast<int>(x * n), 0, n - 1); };
    return cell(at.x(), across) + across * cell(at.y(), up);
  };
  std::vector<char> held(static_cast<std::size_t>(across) * up, 0);
  for (const FitPoint& point : target.points) {
    held[patch(point.uv)] = 1;
  }
  std::vector<double> values;
  for (std::size_t v = 0; v < uv.size(); ++v) {
    values.push_back(held[patch(uv[v])] != 0 ? sigma_mm[v] : kNaN);
  }
  return values;
}

}  // namespace

FaceUncertainty MakeUncertainty(const Experiment& experiment, const DepthStage& stage,
                                const FittedFace& fitted, const RunContext& context) {
  const UncertaintyOptions& options = experiment.uncertainty;
  const HSplineSurface& surface = fitted.fit.surface;
  const FitTarget target = WithFinalUv(fitted.target, fitted.fit);
  const int level = FinestLevel(fitted.fit);
  FaceUncertainty result;
  const ErrorPropagation spread(
      surface, fitted.rest, target, level, TermsOfLastSolve(experiment, fitted.fit),
      FindPointErrors(experiment, stage, surface, target, result, context));
  for (const std::string_view name : spread.left_out()) {
    result.left_out.emplace_back(name);
  }
  result.prior_sd = spread.prior_sd();
  context.ThrowIfStopped();
  if (options.sigma) {
    result.sigma_mm = spread.Sigma(fitted.face.uv, fitted.face.normals);
    AddTemplateMisfit(options, fitted.face, surface, target, result.sigma_mm, context);
    const std::vector<double> held =
        WhereHeld(result.sigma_mm, fitted.face.uv, target, surface.shape(), level);
    const std::vector<WeightedValue> by_area = SortedValues(held, VertexAreas(fitted.face.mesh));
    result.median_mm = Quantile(by_area, 0.5);
    result.p95_mm = Quantile(by_area, 0.95);
  }
  result.samples = spread.Samples(options.samples, options.random_seed);
  return result;
}

namespace {

double CoverPart(const TrueSkin& skin, int part, std::vector<double> sigma,
                 const std::vector<double>& areas) {
  for (std::size_t v = 0; v < sigma.size(); ++v) {
    sigma[v] = skin.part[v] == part ? sigma[v] : kNaN;
  }
  return CoverageAt90(Coverage(skin.signed_mm, sigma, areas));
}

}  // namespace

SigmaCoverage MeasureCoverage(const TrueSkin& skin, const TriMesh& face,
                              std::span<const double> sigma_mm, std::span<const Sphere> masks,
                              const RunContext& context) {
  const MeshQuery query(face);
  std::vector<double> sigma(skin.mesh.points.size(), kNaN);
  ParallelFor(sigma.size(), context.threads, 256, [&](std::size_t v) {
    if (!std::isfinite(skin.signed_mm[v])) {
      return;
    }
    const MeshPoint at = query.Closest(skin.mesh.points[v]);
    const auto masked = [&](const Sphere& mask) { return mask.Contains(at.position); };
    if (std::none_of(masks.begin(), masks.end(), masked)) {
      sigma[v] = sigma_mm[NearestCorner(face, at)];
    }
  });
  const std::vector<double> areas = VertexAreas(skin.mesh);
  SigmaCoverage coverage{.curve = Coverage(skin.signed_mm, sigma, areas), .area_cm2 = 0};
  coverage.at_90 = CoverageAt90(coverage.curve);
  std::vector<double> errors(sigma.size(), kNaN);
  for (std::size_t v = 0; v < sigma.size(); ++v) {
    coverage.area_cm2 += std::isfinite(sigma[v]) ? areas[v] / 100 : 0;
    errors[v] = std::isfinite(sigma[v]) ? skin.signed_mm[v] : kNaN;
  }
  coverage.scores = ScoreDepths(errors, sigma, areas);
  for (std::size_t part = 0; !skin.part.empty() && part < kFaceParts.size(); ++part) {
    const double share = CoverPart(skin, static_cast<int>(part), sigma, areas);
    if (std::isfinite(share)) {
      coverage.of_part[kFaceParts[part]] = share;
    }
  }
  return coverage;
}

}  // namespace semblance::problems
