// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/prior/hspline_prior.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "problems/face_template/ict_face.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/base/json_text.h"
#include "surfaces/hspline_query/tessellate.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFormat = "semblance face prior";
constexpr double kUnitMm = 0.001;

Vec3 ValueAt(const ControlNet& net, const Stencil& stencil) {
  Vec3 sum = Vec3::Zero();
  for (int k = 0; k < 16; ++k) {
    sum += stencil.weight[k] * net.vertices[stencil.index[k]];
  }
  return sum;
}

// The displacements of one mode at the samples, in the template's frame.
std::vector<Vec3> DisplacementsOf(const FacePrior& prior, const PriorOnTemplate& on_template,
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
    const Vec3 at = PositionOf(on_template.under[k], prior.model.mean, prior.model.mean.points) +
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
  if (json.at("format") != kFormat || json.at("version") != 1) {
    throw InputError(fmt::format("format and version must be \"{}\" and 1", kFormat));
  }
  HSplineModes modes;
  constexpr int kMost = 4096;  // patches of level 0, as everywhere
  const auto whole = [&](const char* key) {
    const Json& value = json.at(key);
    if (!value.is_number_integer() || value < 0 || value > kMost) {
      throw InputError(fmt::format("{} is {}; it must be a whole number from 0 to {}", key,
                                   value.dump(), kMost));
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
Tessellation MeshOf(const TemplateFace& face) {
  const HSplineShape& shape = face.surface.shape();
  const int patches = std::max(shape.PatchesU(shape.max_level), shape.PatchesV(shape.max_level));
  return Tessellate(face.surface, std::max(1, 128 / patches));
}

FacePrior Load(const NoPrior&, const TemplateFace&) {
  throw InputError("prior: none is named; a face of type prior needs one");
}

FacePrior Load(const IctPrior& source, const TemplateFace& face) {
  return PriorOf(HSplineModesFromJson(IctModes(), "the ICT face's modes"), face, source.count);
}

FacePrior Load(const ModesPrior& source, const TemplateFace&) { return LoadPrior(source); }

FacePrior Load(const HSplinePrior& source, const TemplateFace& face) {
  if (source.modes.empty()) {
    throw InputError("prior.modes: no file is named; `semblance prior` makes one");
  }
  const HSplineModes modes =
      HSplineModesFromJson(ReadFileBytes(source.modes), source.modes.string());
  return PriorOf(modes, face, source.count);
}

std::vector<std::filesystem::path> FilesOfSource(const NoPrior&) { return {}; }
std::vector<std::filesystem::path> FilesOfSource(const IctPrior&) { return {}; }
std::vector<std::filesystem::path> FilesOfSource(const ModesPrior& source) {
  return ModesPriorFiles(source);
}
std::vector<std::filesystem::path> FilesOfSource(const HSplinePrior& source) {
  return {source.modes};
}

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
    const std::vector<Vec3> moves = DisplacementsOf(prior, on_template, k);
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
  Json json{{"format", kFormat},
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

FacePrior PriorOf(const HSplineModes& modes, const TemplateFace& face, int count) {
  const HSplineShape& shape = face.surface.shape();
  if (shape.patches_u != modes.shape.patches_u || shape.patches_v != modes.shape.patches_v ||
      shape.closure != modes.shape.closure) {
    throw InputError(fmt::format(
        "prior: the modes are of a template of {} x {} patches, and this one has {} x {}; take the "
        "template that they were made for",
        modes.shape.patches_u, modes.shape.patches_v, shape.patches_u, shape.patches_v));
  }
  Tessellation mesh = MeshOf(face);
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
  return std::visit([](const auto& given) { return FilesOfSource(given); }, source);
}

}  // namespace semblance
