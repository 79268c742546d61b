// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/template_face.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "problems/face/domain_grid.h"
#include "problems/face/head_formula.h"
#include "problems/subject/phantom_shape.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"

namespace semblance::problems {
namespace {

// The least-squares fit of one level's plain B-spline to a grid of samples of the formula.
ControlNet FitFormula(const HSplineShape& shape, int level) {
  constexpr int kGridPerPatch = 6;  // along each side; more cost time
  const DomainGrid grid{kGridPerPatch * shape.PatchesU(level) + 1,
                        kGridPerPatch * shape.PatchesV(level) + 1};
  std::vector<Vec3> samples;
  for (std::size_t k = 0; k < grid.size(); ++k) {
    const Vec2 uv = grid.UvAt(k);
    samples.push_back(HeadPoint(uv.x(), uv.y()));
  }
  return NetThrough(shape, level, grid, samples);
}

// Makes the net its own mirror image, so that both sides are rounded alike.
void MakeSymmetric(ControlNet& net) {
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; 2 * i < net.columns; ++i) {
      Vec3& right = net.At(i, j);
      Vec3& left = net.At(net.columns - 1 - i, j);
      const Vec3 mirrored(-right.x(), right.y(), right.z());
      left = (left + mirrored) / 2;
      right = Vec3(-left.x(), left.y(), left.z());
    }
  }
}

// ---------------------------------------------------------------------------------------------
// The surface and its features
// ---------------------------------------------------------------------------------------------

// Takes the vertices of the level's own least-squares fit where they differ by more than the
// tolerance.
void AddDetail(HSplineSurface& surface, int level, double tolerance_mm) {
  ControlNet target = FitFormula(surface.shape(), level);
  MakeSymmetric(target);
  ControlNet net = surface.Net(level);
  for (std::size_t k = 0; k < net.vertices.size(); ++k) {
    if ((target.vertices[k] - net.vertices[k]).norm() > tolerance_mm) {
      net.vertices[k] = target.vertices[k];
    }
  }
  surface.SetNet(level, net);
}

struct HeadFeature {
  const char* name;
  Sphere region;
};

const HeadFeature kHeadFeatures[] = {
    {"nose", {{0, -6, -36}, 26}},
    {"mouth", {{0, -4, -74}, 27}},
    {"eye_l", {{31.5, 14, -3}, 19}},
    {"eye_r", {{-31.5, 14, -3}, 19}},
};

// The vertices of levels >= 1 whose (u,v) is a point of the surface inside the region.
std::vector<VertexId> VerticesInside(const HSplineSurface& surface, const Sphere& region) {
  const HSplineShape& shape = surface.shape();
  std::vector<VertexId> inside;
  for (int level = 1; level <= shape.max_level; ++level) {
    for (int i = 0; i < shape.Columns(level); ++i) {
      for (int j = 0; j < shape.Rows(level); ++j) {
        const VertexId id{level, i, j};
        if (region.Contains(surface.Point(GrevillePoint(shape, id)))) {
          inside.push_back(id);
        }
      }
    }
  }
  return inside;
}

void CheckFormulaOptions(const FormulaTemplate& o) {
  const auto check = [](const char* name, double value, double least, double most) {
    if (!(value >= least && value <= most)) {
      throw InputError(
          fmt::format("template: {} is {}; it must lie in [{}, {}]", name, value, least, most));
    }
  };
  check("patches_u", o.patches_u, 4, 16);
  check("patches_v", o.patches_v, 4, 16);
  check("max_level", o.max_level, 0, 4);
  check("detail_tolerance_mm", o.detail_tolerance_mm, 0, 10);
  check("site_error", o.site_error, 0, 0.2);
}

void Disturb(double error, std::uint64_t random_seed, std::map<std::string, Vec2>& site_uv) {
  Random random(random_seed);
  for (auto& [site, uv] : site_uv) {
    for (int axis = 0; axis < 2; ++axis) {
      uv[axis] = std::clamp(uv[axis] + random.Uniform(-error, error), 0.0, 1.0);
    }
  }
}

}  // namespace

TemplateFace MakeTemplateFace(const FormulaTemplate& options) {
  CheckFormulaOptions(options);
  const HSplineShape shape{.patches_u = options.patches_u,
                           .patches_v = options.patches_v,
                           .max_level = options.max_level,
                           .reference = options.reference};
  ControlNet coarse = FitFormula(shape, 0);
  MakeSymmetric(coarse);
  HSplineSurface surface(shape, coarse);
  for (int level = 1; level <= options.max_level; ++level) {
    AddDetail(surface, level, options.detail_tolerance_mm);
  }
  TemplateFace face{.surface = std::move(surface), .site_uv = TemplateSites(), .features = {}};
  face.features = GenericHeadFeatures(face.surface);
  if (options.site_error > 0) {
    Disturb(options.site_error, options.site_random_seed, face.site_uv);
  }
  return face;
}

std::vector<TemplateFeature> GenericHeadFeatures(const HSplineSurface& surface) {
  std::vector<TemplateFeature> features;
  for (const HeadFeature& f : kHeadFeatures) {
    features.push_back({f.name, VerticesInside(surface, f.region), f.region});
  }
  return features;
}

std::vector<VertexId> FeatureVertices(const TemplateFace& face) {
  std::set<VertexId> vertices;
  for (const TemplateFeature& feature : face.features) {
    vertices.insert(feature.vertices.begin(), feature.vertices.end());
  }
  return {vertices.begin(), vertices.end()};
}

std::vector<Sphere> TemplateMasks(const TemplateFace& face) {
  std::vector<Sphere> masks;
  for (const TemplateFeature& feature : face.features) {
    if (feature.region) {
      masks.push_back(*feature.region);
    }
  }
  return masks;
}

Sphere TransformedSphere(const Sphere& sphere, const Similarity& to_from) {
  return {to_from * sphere.center, to_from.scale * sphere.radius_mm};
}

}  // namespace semblance::problems
