// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/hspline_prior.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "fitting/problem/placement.h"
#include "problems/face/ict_face.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/base/json_text.h"
#include "surfaces/base/parallel.h"
#include "surfaces/hspline_query/tessellate.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

constexpr double kFarthestRmsMm = 5;  // of a template from the mean that it was made from

Similarity PlaceBySites(const FacePrior& prior, const TemplateFace& face) {
  std::vector<Vec3> on_template, on_mean;
  for (const auto& [site, at] : prior.sites) {
    if (const auto uv = face.site_uv.find(site); uv != face.site_uv.end()) {
      on_template.push_back(face.surface.Point(uv->second));
      on_mean.push_back(FindPosition(at, prior.model.mean, prior.model.mean.points));
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

// Iterated closest points (Besl & McKay 1992), from the similarity of the sites and without far
// points.
Similarity PlaceByClosestPoints(const std::vector<Vec3>& samples, Similarity mean_from_template,
                                const MeshQuery& query, const RunContext& context) {
  constexpr int kFootRounds = 10;     // more cost time
  constexpr double kFarMm = 5;        // pairs that are farther apart do not count
  constexpr std::size_t kEvery = 29;  // every 29th sample is enough to place the template
  std::vector<Vec3> some;
  for (std::size_t k = 0; k < samples.size(); k += kEvery) {
    some.push_back(samples[k]);
  }
  for (int round = 0; round < kFootRounds; ++round) {
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
  PriorOnTemplate result{.grid = MakeDomainGrid(face.surface.shape()),
                         .under = {},
                         .beside = {},
                         .mean_from_template = {}};
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

HSplineSurface MakeFaceSurface(const ShapeEstimate& estimate, const FacePrior& prior,
                               const PriorOnTemplate& on_template, const HSplineShape& shape) {
  const Similarity& place = estimate.subject_from_model;
  std::vector<Vec3> samples;
  for (std::size_t k = 0; k < on_template.under.size(); ++k) {
    samples.emplace_back(FindPosition(on_template.under[k], prior.model.mean, estimate.points) +
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
                         FindPosition(on_template.under[k], prior.model.mean, moves));
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

std::vector<ShapePoint> SampleShape(const HSplineSurface& surface, const ShapeEstimate& estimate,
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

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kModesFormat = "semblance face prior";
constexpr double kUnitMm = 0.001;  // of the written numbers

Vec3 ValueAt(const ControlNet& net, const Stencil& stencil) {
  Vec3 sum = Vec3::Zero();
  for (int k = 0; k < 16; ++k) {
    sum += stencil.weight[k] * net.vertices[stencil.index[k]];
  }
  return sum;
}

// The displacements of one mode at the samples, in the template's frame.
std::vector<Vec3> SampleMode(const FacePrior& prior, const PriorOnTemplate& on_template,
                             Eigen::Index mode) {
  const Similarity& place = on_template.mean_from_template;
  std::vector<Vec3> moves;
  for (const ModelPoint& under : on_template.under) {
    const Triangle& t = prior.model.mean.triangles[under.triangle];
    Vec3 move = Vec3::Zero();
    for (int corner = 0; corner < 3; ++corner) {
      move +=
          under.weights[corner] * prior.model.modes.block<3, 1>(3 * Eigen::Index{t[corner]}, mode);
    }
    moves.emplace_back(place.rotation.transpose() * move / place.scale);
  }
  return moves;
}

// The parameters of the sample that is nearest to a point of the mean.
Vec2 NearestSample(const Vec3& p, const FacePrior& prior, const PriorOnTemplate& on_template) {
  std::size_t best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < on_template.under.size(); ++k) {
    const Vec3 at = FindPosition(on_template.under[k], prior.model.mean, prior.model.mean.points) +
                    on_template.beside[k];
    if (const double squared = (at - p).squaredNorm(); squared < least) {
      least = squared;
      best = k;
    }
  }
  return on_template.grid.UvAt(best);
}

Json NetJson(const ControlNet& net) {
  Json values = Json::array();
  for (const Vec3& v : net.vertices) {
    for (int axis = 0; axis < 3; ++axis) {
      values.push_back(std::llround(v[axis] / kUnitMm));
    }
  }
  return values;
}

ControlNet NetFrom(const Json& json, const HSplineShape& shape, int level) {
  ControlNet net{.columns = shape.Columns(level), .rows = shape.Rows(level), .vertices = {}};
  if (!std::ranges::all_of(json, [](const Json& value) { return value.is_number_integer(); })) {
    throw InputError("a mode has an entry that is not a whole number");
  }
  const auto values = json.get<std::vector<std::int64_t>>();
  if (values.size() != 3 * static_cast<std::size_t>(net.columns) * net.rows) {
    throw InputError(fmt::format("a mode has {} numbers; level {} of {} x {} patches needs {}",
                                 values.size(), level, shape.patches_u, shape.patches_v,
                                 3 * net.columns * net.rows));
  }
  for (std::size_t k = 0; k < values.size(); k += 3) {
    net.vertices.emplace_back(kUnitMm * static_cast<double>(values[k]),
                              kUnitMm * static_cast<double>(values[k + 1]),
                              kUnitMm * static_cast<double>(values[k + 2]));
  }
  return net;
}

HSplineModes ModesFrom(const Json& json) {
  if (json.at("format") != kModesFormat || json.at("version") != 1) {
    throw InputError(fmt::format("format and version must be \"{}\" and 1", kModesFormat));
  }
  HSplineModes modes;
  constexpr int kLimit = 4096;  // keeps the conversion exact; CheckShape checks the shape itself
  const auto whole = [&](const char* key) {
    const Json& value = json.at(key);
    if (!value.is_number_integer() || value < 0 || value > kLimit) {
      throw InputError(fmt::format("{} is {}; it must be a whole number from 0 to {}", key,
                                   value.dump(), kLimit));
    }
    return value.get<int>();
  };
  modes.shape = {.patches_u = whole("patches_u"),
                 .patches_v = whole("patches_v"),
                 .max_level = whole("level")};
  CheckShape(modes.shape);
  modes.level = modes.shape.max_level;
  for (const Json& feature : json.at("features")) {
    const auto uv = feature.at("uv").get<std::array<double, 2>>();
    const FeatureParameter at{{uv[0], uv[1]}, feature.at("clearance_mm").get<double>()};
    if (!(at.uv.minCoeff() >= 0 && at.uv.maxCoeff() <= 1 && at.clearance_mm >= 0)) {
      throw InputError("a feature has (u,v) outside [0,1] or a negative clearance");
    }
    modes.features.push_back(at);
  }
  for (const Json& mode : json.at("modes")) {
    modes.modes.push_back(NetFrom(mode, modes.shape, modes.level));
  }
  if (modes.modes.empty()) {
    throw InputError("there is no mode");
  }
  return modes;
}

// A mesh of the template with about 128 quads along each side.
Tessellation MakeMesh(const TemplateFace& face) {
  const HSplineShape& shape = face.surface.shape();
  const int patches = std::max(shape.PatchesU(shape.max_level), shape.PatchesV(shape.max_level));
  return Tessellate(face.surface, std::max(1, 128 / patches));
}

FacePrior Load(const NoPrior&, const TemplateFace&) {
  throw InputError("prior: none is named; a face of type prior needs one");
}

FacePrior Load(const IctPrior& source, const TemplateFace& face) {
  return MakePrior(HSplineModesFromJson(IctModes(), "the ICT face's modes"), face, source.count);
}

FacePrior Load(const ModesPrior& source, const TemplateFace&) { return LoadPrior(source); }

FacePrior Load(const HSplinePrior& source, const TemplateFace& face) {
  if (source.modes.empty()) {
    throw InputError("prior.modes: no file is named; `semblance prior` makes one");
  }
  const HSplineModes modes =
      HSplineModesFromJson(ReadFileBytes(source.modes), source.modes.string());
  return MakePrior(modes, face, source.count);
}

std::vector<std::filesystem::path> ListFiles(const NoPrior&) { return {}; }
std::vector<std::filesystem::path> ListFiles(const IctPrior&) { return {}; }
std::vector<std::filesystem::path> ListFiles(const ModesPrior& source) {
  return ModesPriorFiles(source);
}
std::vector<std::filesystem::path> ListFiles(const HSplinePrior& source) { return {source.modes}; }

}  // namespace

HSplineModes ModesOnTemplate(const FacePrior& prior, const PriorOnTemplate& on_template,
                             const TemplateFace& face, int level, int count, ModesMisfit* misfit) {
  HSplineModes result{.shape = face.surface.shape(), .level = level, .modes = {}, .features = {}};
  if (level < 0 || level > result.shape.max_level) {
    throw InputError(
        fmt::format("level {}; the template has levels 0 to {}", level, result.shape.max_level));
  }
  double squares = 0, most = 0, values = 0;
  for (Eigen::Index k = 0; k < std::min<Eigen::Index>(count, prior.model.Modes()); ++k) {
    const std::vector<Vec3> moves = SampleMode(prior, on_template, k);
    result.modes.push_back(NetThrough(result.shape, level, on_template.grid, moves));
    for (std::size_t s = 0; s < moves.size(); s += 7) {
      const Stencil stencil = StencilAt(result.shape, level, on_template.grid.UvAt(s));
      const double off = (ValueAt(result.modes.back(), stencil) - moves[s]).norm();
      squares += off * off;
      most = std::max(most, off);
      ++values;
    }
  }
  for (const ShapeFeature& feature : prior.features) {
    result.features.push_back(
        {NearestSample(feature.position, prior, on_template), feature.clearance_mm});
  }
  if (misfit != nullptr) {
    *misfit = {std::sqrt(squares / values), most};
  }
  return result;
}

std::string HSplineModesToJson(const HSplineModes& modes) {
  Json json{{"format", kModesFormat},
            {"version", 1},
            {"patches_u", modes.shape.patches_u},
            {"patches_v", modes.shape.patches_v},
            {"level", modes.level},
            {"unit_mm", kUnitMm},
            {"features", Json::array()},
            {"modes", Json::array()}};
  for (const FeatureParameter& feature : modes.features) {
    json["features"].push_back(
        {{"uv", {feature.uv.x(), feature.uv.y()}}, {"clearance_mm", feature.clearance_mm}});
  }
  for (const ControlNet& net : modes.modes) {
    json["modes"].push_back(NetJson(net));
  }
  return json.dump() + "\n";
}

HSplineModes HSplineModesFromJson(std::string_view text, std::string_view name) {
  try {
    return ModesFrom(ParseJson(text, name));
  } catch (const nlohmann::json::exception& error) {
    throw InputError(fmt::format("{}: not a file of modes: {}", name, JsonFault(error)));
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", name, error.what()));
  }
}

FacePrior MakePrior(const HSplineModes& modes, const TemplateFace& face, int count) {
  const HSplineShape& shape = face.surface.shape();
  if (shape.patches_u != modes.shape.patches_u || shape.patches_v != modes.shape.patches_v ||
      shape.closure != modes.shape.closure) {
    throw InputError(fmt::format(
        "prior: the modes are of a template of {} x {} patches, and this one has {} x {}; take the "
        "template that they were made for",
        modes.shape.patches_u, modes.shape.patches_v, shape.patches_u, shape.patches_v));
  }
  Tessellation mesh = MakeMesh(face);
  FacePrior prior;
  const Eigen::Index used = std::min<Eigen::Index>(count, std::ssize(modes.modes));
  prior.model.modes.resize(3 * std::ssize(mesh.uv), used);
  for (std::size_t v = 0; v < mesh.uv.size(); ++v) {
    const Stencil stencil = StencilAt(modes.shape, modes.level, mesh.uv[v]);
    for (Eigen::Index k = 0; k < used; ++k) {
      prior.model.modes.block<3, 1>(3 * static_cast<Eigen::Index>(v), k) =
          ValueAt(modes.modes[k], stencil);
    }
  }
  prior.model.mean = std::move(mesh.mesh);
  const MeshQuery query(prior.model.mean);
  for (const auto& [site, uv] : face.site_uv) {
    const MeshPoint at = query.Closest(face.surface.Point(uv));
    prior.sites[site] = {at.triangle, at.weights};
  }
  for (const FeatureParameter& feature : modes.features) {
    prior.features.push_back({face.surface.Point(feature.uv), feature.clearance_mm});
  }
  return prior;
}

FacePrior LoadPrior(const PriorSource& source, const TemplateFace& face) {
  return std::visit([&](const auto& given) { return Load(given, face); }, source);
}

std::vector<std::filesystem::path> PriorFiles(const PriorSource& source) {
  return std::visit([](const auto& given) { return ListFiles(given); }, source);
}

}  // namespace semblance::problems
