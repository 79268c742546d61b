// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/dowel_projection.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "interp/dowels/dowel_area.h"
#include "problems/subject/sites.h"
#include "surfaces/hspline_query/hspline_project.h"
#include "surfaces/hspline_query/tessellate.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

constexpr double kMaxShift_mm = 40;  // of the shell from a dowel's base or tip, along the dowel

// The length of a dowel that lies under the shell; 0 if its base does not.
double GapUnderShell(const Dowel& dowel, const TriMesh& shell, const MeshQuery& query) {
  double gap = 0;
  for (const MeshPoint& hit : query.AllHits(dowel.base, dowel.direction, kMaxShift_mm)) {
    const Triangle& t = shell.triangles[hit.triangle];
    const bool leaves = TriangleAreaVector(shell, t).dot(dowel.direction) > 0;
    gap = leaves && hit.distance_mm <= dowel.depth_mm ? std::max(gap, hit.distance_mm) : gap;
  }
  return gap;
}

// For a dowel that ends inside the shell, the distance from its base to the first way out along it.
// 0 for other dowels.
double WayOut(const Dowel& dowel, const TriMesh& shell, const MeshQuery& query) {
  const auto hit = query.FirstHit(dowel.Tip(), dowel.direction, kMaxShift_mm);
  const bool inside =
      hit && TriangleAreaVector(shell, shell.triangles[hit->triangle]).dot(dowel.direction) > 0;
  return inside ? dowel.depth_mm + hit->distance_mm : 0;
}

// The height of the shell over the base, along the dowel, whether the dowel ends under the shell or
// not.
double HeightOfShell(const Dowel& dowel, const TriMesh& shell, const MeshQuery& query) {
  const double beyond = WayOut(dowel, shell, query);
  return beyond > 0 ? beyond : GapUnderShell(dowel, shell, query);
}

// A place at which the shell is too high.
struct Dimple {
  Vec3 at, inward;
  double depth_mm = 0, radius_mm = 0;

  // The depth at a point; 0 beyond the radius.
  double DepthAt(const Vec3& p) const {
    const double r2 = (p - at).squaredNorm() / (radius_mm * radius_mm);
    return r2 < 1 ? depth_mm * (1 - r2) * (1 - r2) : 0;
  }
};

// The distance from p along `inward` to the bone, at most at_most_mm. The search starts a little
// outside p, so that it is 0 on the bone whatever side of the bone rounding puts p on.
double RoomOverBone(const Vec3& p, const Vec3& inward, double at_most_mm, const MeshQuery& bone) {
  constexpr double kBack_mm = 0.5;
  const auto hit = bone.FirstHit(p - kBack_mm * inward, inward, at_most_mm + kBack_mm);
  return hit ? std::max(0.0, hit->distance_mm - kBack_mm) : at_most_mm;
}

std::vector<Dimple> FindDimples(std::span<const Dowel> dowels, const TriMesh& shell,
                                double press_mm) {
  const MeshQuery query(shell);
  std::vector<Dimple> dimples;
  for (const Dowel& dowel : dowels) {
    const double height = HeightOfShell(dowel, shell, query),
                 wanted = dowel.depth_mm - std::min(press_mm, dowel.depth_mm);
    if (height > wanted) {
      const double depth = height - wanted;
      dimples.push_back({dowel.base + height * dowel.direction, -dowel.direction, depth,
                         std::max(10.0, 2.5 * depth)});
    }
  }
  return dimples;
}

}  // namespace

TriMesh IndentShell(TriMesh shell, std::span<const Dowel> dowels_on_bone, const TriMesh& bone,
                    double press_mm) {
  const std::vector<Dimple> dimples =
      press_mm > 0 ? FindDimples(dowels_on_bone, shell, press_mm) : std::vector<Dimple>();
  if (dimples.empty()) {
    return shell;
  }
  const MeshQuery query(bone);
  for (Vec3& p : shell.points) {
    const auto deepest = std::ranges::max_element(
        dimples, {}, [&p](const Dimple& dimple) { return dimple.DepthAt(p); });
    if (const double depth = deepest->DepthAt(p); depth > 0) {
      p += RoomOverBone(p, deepest->inward, depth, query) * deepest->inward;
    }
  }
  return shell;
}

ProjectedDowels ProjectOntoShell(std::span<const Dowel> dowels_on_bone, const TriMesh& shell,
                                 const MeshQuery& query, double least_depth_mm) {
  constexpr double kLeastNoted_mm = 1;  // smaller gaps are not worth a note
  ProjectedDowels result;
  for (Dowel dowel : dowels_on_bone) {
    const double beyond = WayOut(dowel, shell, query);
    const double gap = HeightOfShell(dowel, shell, query);
    if (beyond > 0) {
      result.notes.push_back(fmt::format(
          "site {}: the dowel of {:.1f} mm ends {:.1f} mm under the shell; there the "
          "shell gets {:.1f} mm",
          DescribeSite(dowel.site), dowel.depth_mm, beyond - dowel.depth_mm, least_depth_mm));
    } else if (gap >= kLeastNoted_mm) {
      result.notes.push_back(
          fmt::format("site {}: the shell lies {:.1f} mm over the bone; of {:.1f} mm of tissue "
                      "{:.1f} mm are outside it",
                      DescribeSite(dowel.site), gap, dowel.depth_mm,
                      std::max(dowel.depth_mm - gap, least_depth_mm)));
    }
    dowel.base += gap * dowel.direction;
    dowel.depth_mm = std::max(dowel.depth_mm - gap, std::min(least_depth_mm, dowel.depth_mm));
    result.dowels_on_shell.push_back(dowel);
  }
  return result;
}

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

// Finds the points in which dowels meet a surface near their tips.
class Rays {
 public:
  explicit Rays(const HSplineSurface& surface)
      : surface_(surface),
        mesh_(Tessellate(surface, kQuadsPerPatch)),
        query_(mesh_.mesh),
        projector_(surface) {}

  Vec2 Meet(const Dowel& dowel) const {
    constexpr double kBack_mm = 20, kFar_mm = 80;  // the ray starts under the base
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

// Interpolates (u,v) over the areas of the dowels whose (u,v) is known.
class KnownAreas {
 public:
  KnownAreas(std::span<const Dowel> dowels, const DowelNetwork& network, const TemplateFace& placed,
             const ExtraSites& sites)
      : is_closed_(placed.surface.shape().ClosedU()) {
    std::vector<std::size_t> unknown;
    for (std::size_t k = 0; k < dowels.size(); ++k) {
      if (const auto uv = KnownUv(dowels[k].site, placed, sites)) {
        uv_.push_back(*uv);
      } else {
        unknown.push_back(k);
      }
    }
    const ShownDowels known = LeaveOutDowels(dowels, network, unknown);
    if (!known.network.areas.empty()) {
      areas_ = DowelAreas("inserted_uv", {TriMesh(), {}, known.dowels, known.network});
    }
  }

  std::optional<Vec2> At(const Vec3& p) const {
    const AreaPoint at = FindArea(areas_, AreaDistance::kTriangle, p);
    if (at.area == nullptr) {
      return std::nullopt;
    }
    const Vec2 first = uv_[at.area->dowels[0]];
    Vec2 uv = first;
    for (int k = 1; k < 3; ++k) {
      Vec2 step = uv_[at.area->dowels[k]] - first;
      step.x() -= is_closed_ ? std::round(step.x()) : 0;  // the short way round
      uv += at.weights[k] * step;
    }
    uv.x() -= is_closed_ ? std::floor(uv.x()) : 0;
    return uv;
  }

 private:
  bool is_closed_;
  std::vector<Vec2> uv_;  // of the known dowels
  std::vector<DowelArea> areas_;
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

FitTarget AllDowels(std::span<const Dowel> dowels, const DowelNetwork& network,
                    const TemplateFace& placed, const Experiment& experiment) {
  FitTarget target;
  std::optional<KnownAreas> areas;
  if (experiment.inserted_uv == InsertedUv::kNeighbours) {
    areas.emplace(dowels, network, placed, experiment.sites);
  }
  std::optional<Rays> rays;
  for (const Dowel& dowel : dowels) {
    std::optional<Vec2> uv = KnownUv(dowel.site, placed, experiment.sites);
    if (!uv && !IsStandardSite(dowel.site)) {
      uv = areas ? areas->At(dowel.base) : std::nullopt;
      uv = uv ? uv : (rays ? *rays : rays.emplace(placed.surface)).Meet(dowel);
    }
    if (uv) {
      Add(dowel, *uv, target);
    }
  }
  return target;
}

}  // namespace semblance::problems
