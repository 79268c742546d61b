// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/template_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "fitting/fit.h"
#include "problems/face/head_formula.h"
#include "problems/face/skin_distance.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline_query/hspline_project.h"

namespace semblance::problems {
namespace {

constexpr int kCoarsestEnd = 3, kFinestEnd = 6;  // levels at which the fit may end
constexpr double kLength_mm = 10;                // length scale of the smoothness term
// Just enough to hold parts without a match in place; more would hold back the matched parts too.
constexpr double kMembrane = 2e-4;
// Facial landmarks guide the coarse levels, in which the surface still slides. On finer levels the
// matches alone decide.
constexpr double kFacialWeight = 0.3;
constexpr int kLastLandmarkLevel = 2;
constexpr double kThinnest_mm = 0.02;  // shorter offsets are dropped: nobody sees them

struct LevelPlan {
  int rounds;            // of matching and fitting
  int samples;           // along each side of a patch
  double reach_mm;       // of a match
  double wavelength_mm;  // displacements of this wavelength (two patches) are halved
};

LevelPlan PlanLevel(int level) {
  constexpr LevelPlan kPlans[] = {{8, 6, 40, 80}, {6, 4, 20, 40}, {5, 3, 10, 20}, {4, 3, 6, 10},
                                  {3, 2, 4, 5},   {3, 2, 3, 2.5}, {2, 2, 3, 1.25}};
  return kPlans[level];
}

// The formula has no ears. Matches there would drag the cheek along.
bool InEar(const Vec2& uv) {
  constexpr double kMiddleY = 110, kMiddleZ = -40, kHalfWidth = 24, kHalfHeight = 56;  // mm
  const Vec3 p = HeadPoint(uv.x(), uv.y());
  return std::hypot((p.y() - kMiddleY) / kHalfWidth, (p.z() - kMiddleZ) / kHalfHeight) < 1;
}

FitTarget MakeTarget(const MatchGrid& grid) {
  FitTarget target;
  for (std::size_t k = 0; k < grid.uv.size(); ++k) {
    if (grid.skin[k] && !InEar(grid.uv[k])) {
      target.points.push_back({.label = {}, .position = grid.skin[k]->point, .uv = grid.uv[k]});
    }
  }
  return target;
}

std::vector<FitPoint> FacialPoints(const OuterHead& head) {
  const std::vector<std::string> facial = FacialLandmarkCodes();
  std::vector<FitPoint> points;
  for (const SkinLandmark& landmark : head.points) {
    if (std::ranges::find(facial, landmark.code) != facial.end()) {
      points.push_back({.label = landmark.code,
                        .position = landmark.point,
                        .uv = UvOnGenericHead(landmark.code),
                        .role = PointRole::kLandmark});
    }
  }
  return points;
}

FitOptions MakeFitOptions(int level, bool landmarks) {
  const double wave = PlanLevel(level).wavelength_mm / (2 * std::numbers::pi * kLength_mm);
  FitOptions options{
      .plan = ListedPlan{.schedule = {{level, 1}}},
      .terms = {PointTerm{}, SmoothnessTerm{.weight = std::pow(wave, 4), .length_mm = kLength_mm},
                MembraneTerm{.weight = kMembrane, .length_mm = kLength_mm}},
      .features = FreeFeatures{},
      .relaxation = NoRelaxation{},
      .solver = Solver::kFastest};
  if (landmarks) {
    options.terms.push_back(LandmarkTerm{.weight = kFacialWeight});
  }
  return options;
}

// The fit in progress.
class TemplateFitter {
 public:
  TemplateFitter(const OuterHead& head, TemplateFace start, const RunContext& context)
      : head_(head),
        context_(context),
        matcher_(head.skin),
        facial_(FacialPoints(head)),
        rest_(start.surface),
        surface_(std::move(start.surface)) {}

  TemplateLevel FitLevel(int level) {
    const LevelPlan plan = PlanLevel(level);
    TemplateLevel done{.level = level, .rounds = plan.rounds};
    for (int round = 0; round < plan.rounds; ++round) {
      context_.ThrowIfStopped();
      done.matched = FitRound(level, plan);
    }
    return done;
  }

  const HSplineSurface& surface() const { return surface_; }
  bool usable() const { return usable_; }  // whether every solution so far was

 private:
  // Returns the part of the samples that matched the skin.
  double FitRound(int level, const LevelPlan& plan) {
    const HSplineShape& shape = surface_.shape();
    const MatchGrid grid =
        MatchToSkin(surface_, matcher_, plan.samples * shape.PatchesU(level),
                    plan.samples * shape.PatchesV(level), plan.reach_mm, context_.threads);
    FitTarget target = MakeTarget(grid);
    if (target.points.empty()) {
      throw InputError("no point of the generic head finds skin near it; check the landmarks");
    }
    const double matched =
        static_cast<double>(target.points.size()) / static_cast<double>(grid.uv.size());
    const bool landmarks = level <= kLastLandmarkLevel && !facial_.empty();
    if (landmarks) {
      target.points.insert(target.points.end(), facial_.begin(), facial_.end());
    }
    const RunContext silent{.on_event = {}, .stop_token = {}, .threads = context_.threads};
    FitResult fit = Fit(surface_, rest_, target, {}, MakeFitOptions(level, landmarks), silent);
    usable_ = usable_ && fit.usable;
    surface_ = std::move(fit.surface);
    return matched;
  }

  const OuterHead& head_;
  const RunContext& context_;
  SkinMatcher matcher_;
  std::vector<FitPoint> facial_;
  HSplineSurface rest_, surface_;
  bool usable_ = true;
};

// The surface without negligible offsets and without empty levels.
HSplineSurface Thinned(const HSplineSurface& surface, int finest) {
  HSplineShape shape = surface.shape();
  shape.max_level = finest;
  HSplineSurface thin(shape, surface.Net(0));
  std::map<VertexId, std::optional<Vec3>> offsets;
  for (const auto& [id, offset] : surface.Offsets()) {
    if (id.level <= finest && offset.norm() > kThinnest_mm) {
      offsets[id] = offset;
    }
  }
  thin.SetOffsets(offsets);
  return thin;
}

std::map<std::string, TemplateSite> PlaceSites(const HSplineSurface& surface,
                                               const OuterHead& head) {
  std::map<std::string, TemplateSite> sites;
  for (const auto& [code, uv] : TemplateSites()) {
    sites[code].uv = uv;
  }
  for (const SkinLandmark& landmark : head.points) {
    const auto site = sites.find(landmark.code);
    if (site == sites.end()) {
      continue;
    }
    const Vec2 formula_uv = site->second.uv;
    const SurfaceProjection nearest = ProjectFrom(surface, landmark.point, formula_uv);
    site->second = {.uv = nearest.uv,
                    .from_landmark = true,
                    .drift_mm = (surface.Point(formula_uv) - landmark.point).norm(),
                    .error_mm = nearest.distance_mm};
  }
  return sites;
}

std::vector<TemplateFeature> UpToLevel(std::vector<TemplateFeature> features, int finest) {
  for (TemplateFeature& feature : features) {
    std::erase_if(feature.vertices, [&](const VertexId& id) { return id.level > finest; });
  }
  return features;
}

void CheckFitOptions(const TemplateFitOptions& o) {
  if (!(o.finest >= kCoarsestEnd && o.finest <= kFinestEnd)) {
    throw InputError(fmt::format("template: finest is {}; it must lie in [{}, {}]", o.finest,
                                 kCoarsestEnd, kFinestEnd));
  }
  if (!(std::isfinite(o.tolerance_mm) && o.tolerance_mm > 0)) {
    throw InputError(
        fmt::format("template: tolerance_mm is {}; it must be positive", o.tolerance_mm));
  }
}

std::vector<Vec2> SitePlaces() {
  std::vector<Vec2> places;
  for (const auto& [code, uv] : TemplateSites()) {
    places.push_back(uv);
  }
  return places;
}

// Fits one level after the other, until one meets the tolerance or all are done.
std::vector<TemplateLevel> FitLevels(const TemplateFitOptions& options,
                                     const TemplateDistance& distance, const RunContext& context,
                                     TemplateFitter& fitter) {
  std::vector<TemplateLevel> levels;
  for (int level = 0; level <= options.finest; ++level) {
    levels.push_back(fitter.FitLevel(level));
    const SkinDistance& to_skin = levels.back().face_to_skin =
        distance.FaceToSkin(fitter.surface(), context.threads);
    context.Report("template",
                   fmt::format("level {}: RMS {:.3f} mm over the face", level, to_skin.rms_mm),
                   (level + 1.0) / (options.finest + 1));
    if (level >= kCoarsestEnd && to_skin.rms_mm <= options.tolerance_mm &&
        distance.SkinToFace(fitter.surface(), context.threads).rms_mm <= options.tolerance_mm) {
      break;
    }
  }
  return levels;
}

// Measures the finished face.
void Measure(const OuterHead& head, const TemplateFitOptions& options,
             const TemplateDistance& distance, int threads, TemplateFit& fit) {
  const HSplineSurface& surface = fit.face.surface;
  for (TemplateLevel& level : fit.levels) {
    level.vertices = static_cast<int>(level.level == 0 ? surface.Net(0).vertices.size()
                                                       : surface.Offsets(level.level).size());
  }
  fit.sites = PlaceSites(surface, head);
  for (const auto& [code, site] : fit.sites) {
    fit.face.site_uv[code] = site.uv;
  }
  fit.face_to_skin = distance.FaceToSkin(surface, threads);
  fit.skin_to_face = distance.SkinToFace(surface, threads);
  fit.folds = CountFolds(surface, threads);
  fit.met = fit.face_to_skin.rms_mm <= options.tolerance_mm &&
            fit.skin_to_face.rms_mm <= options.tolerance_mm;
}

}  // namespace

TemplateFit FitTemplate(const OuterHead& head, const TemplateFitOptions& options,
                        const RunContext& context) {
  CheckFitOptions(options);
  TemplateFace start = WarpedGenericHead(head, options.finest);
  std::vector<TemplateFeature> features = start.features;
  TemplateFitter fitter(head, std::move(start), context);
  const TemplateDistance distance(head.skin, SitePlaces());
  std::vector<TemplateLevel> levels = FitLevels(options, distance, context, fitter);
  const int finest = levels.back().level;
  TemplateFit fit{.face = {.surface = Thinned(fitter.surface(), finest),
                           .site_uv = {},
                           .features = UpToLevel(std::move(features), finest)},
                  .levels = std::move(levels),
                  .sites = {},
                  .usable = fitter.usable()};
  Measure(head, options, distance, context.threads, fit);
  return fit;
}

}  // namespace semblance::problems
