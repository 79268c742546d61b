// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/pipeline/dowel_target.h"

#include <optional>

#include "problems/subject/sites.h"
#include "surfaces/hspline_query/hspline_project.h"
#include "surfaces/hspline_query/tessellate.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance {
namespace {

std::optional<Vec2> KnownUv(const std::string& site, const TemplateFace& face,
                            const ExtraSites& sites) {
  if (const auto by_hand = sites.find(site); by_hand != sites.end() && by_hand->second.uv) {
    return Vec2((*by_hand->second.uv)[0], (*by_hand->second.uv)[1]);
  }
  const auto known = face.site_uv.find(site);
  return known == face.site_uv.end() ? std::nullopt : std::optional(known->second);
}

void Add(const Dowel& dowel, const Vec2& uv, FitTarget& target) {
  target.points.push_back(
      {.label = dowel.site, .position = dowel.Tip(), .uv = uv, .role = dowel.role});
  target.anchors.push_back({dowel.base, dowel.direction});
}

// Where dowels meet a surface that lies near their tips.
class Rays {
 public:
  explicit Rays(const HSplineSurface& surface)
      : surface_(surface),
        mesh_(Tessellate(surface, kQuadsPerPatch)),
        query_(mesh_.mesh),
        projector_(surface) {}

  Vec2 Meet(const Dowel& dowel) const {
    constexpr double kBack_mm = 20, kFar_mm = 80;
    const auto hit =
        query_.FirstHit(dowel.base - kBack_mm * dowel.direction, dowel.direction, kFar_mm);
    if (!hit) {
      return projector_.Project(dowel.Tip()).uv;
    }
    int corner = 0;
    hit->weights.maxCoeff(&corner);
    return ProjectFrom(surface_, hit->position,
                       mesh_.uv[mesh_.mesh.triangles[hit->triangle][corner]])
        .uv;
  }

 private:
  static constexpr int kQuadsPerPatch = 4;
  const HSplineSurface& surface_;
  Tessellation mesh_;
  MeshQuery query_;
  SurfaceProjector projector_;
};

}  // namespace

FitTarget KnownDowels(std::span<const Dowel> dowels, const TemplateFace& face,
                      const ExtraSites& sites) {
  FitTarget target;
  for (const Dowel& dowel : dowels) {
    if (const auto uv = KnownUv(dowel.site, face, sites)) {
      Add(dowel, *uv, target);
    }
  }
  return target;
}

Similarity PlaceOnDowels(const TemplateFace& generic, const FitTarget& known,
                         const PlacementOptions& options) {
  std::vector<Vec3> on_template, on_subject;
  for (const FitPoint& point : known.points) {
    on_template.push_back(generic.surface.Point(point.uv));
    on_subject.push_back(point.position);
  }
  return PlaceTemplate(on_template, on_subject, {}, options);
}

FitTarget AllDowels(std::span<const Dowel> dowels, const TemplateFace& placed,
                    const ExtraSites& sites) {
  FitTarget target;
  std::optional<Rays> rays;
  for (const Dowel& dowel : dowels) {
    std::optional<Vec2> uv = KnownUv(dowel.site, placed, sites);
    if (!uv && !IsStandardSite(dowel.site)) {
      uv = (rays ? *rays : rays.emplace(placed.surface)).Meet(dowel);
    }
    if (uv) {
      Add(dowel, *uv, target);
    }
  }
  return target;
}

}  // namespace semblance
