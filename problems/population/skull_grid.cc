// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/population/skull_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "problems/face_template/skin_distance.h"
#include "problems/face_template/template_placement.h"
#include "problems/subject/average_skull.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"

namespace semblance {
namespace {

constexpr int kFormulaLevels = 3;  // the finest of the generic head's detail

// The mean of a mesh's normals around a point, by area, of those that face as the nearest does.
class MeanNormals {
 public:
  MeanNormals(const TriMesh& mesh, double radius_mm)
      : points_(mesh.points),
        normals_(VertexNormals(mesh)),
        areas_(VertexAreas(mesh)),
        order_(mesh.points.size()),
        radius_mm_(radius_mm) {
    std::iota(order_.begin(), order_.end(), 0);
    std::ranges::stable_sort(order_, {}, [this](std::size_t v) { return points_[v].x(); });
  }

  // facing: unit. Zero if no normal faces so.
  Vec3 At(const Vec3& p, const Vec3& facing) const {
    const auto x_of = [this](std::size_t v) { return points_[v].x(); };
    const auto first = std::ranges::lower_bound(order_, p.x() - radius_mm_, {}, x_of);
    Vec3 sum = Vec3::Zero();
    for (auto v = first; v != order_.end() && x_of(*v) <= p.x() + radius_mm_; ++v) {
      const bool near = (points_[*v] - p).squaredNorm() <= radius_mm_ * radius_mm_;
      if (near && normals_[*v].dot(facing) > 0) {
        sum += areas_[*v] * normals_[*v];
      }
    }
    return sum.norm() > 0 ? Vec3(sum.normalized()) : Vec3(Vec3::Zero());
  }

 private:
  std::vector<Vec3> points_, normals_;
  std::vector<double> areas_;
  std::vector<std::size_t> order_;  // of the vertices, by x
  double radius_mm_;
};

std::vector<SkinLandmark> StandardPoints(const LandmarkFile& file) {
  std::vector<SkinLandmark> points;
  for (const Landmark& landmark : file.landmarks) {
    if (IsStandardSite(landmark.site)) {
      points.push_back(
          {landmark.site, Vec3(landmark.point[0], landmark.point[1], landmark.point[2])});
    }
  }
  return points;
}

SkullSites SitesOf(const std::vector<SkinLandmark>& landmarks) {
  std::vector<SitePoint> sites;
  for (const SkinLandmark& landmark : landmarks) {
    sites.push_back({landmark.code, landmark.point});
  }
  return CompleteSites(sites);
}

}  // namespace

SkullGrid LayGrid(const TriMesh& skull, const LandmarkFile& landmarks, const DenseOptions& options,
                  const RunContext& context) {
  constexpr std::size_t kFewest = 4;
  const OuterHead head{.skin = skull, .points = StandardPoints(landmarks), .notes = {}};
  if (head.points.size() < kFewest) {
    throw InputError(
        fmt::format("{}: {} landmarks at standard sites; the grid over the skull needs "
                    "at least {}",
                    landmarks.subject, head.points.size(), kFewest));
  }
  const TemplateFace generic = WarpedGenericHead(head, kFormulaLevels);
  const MatchGrid match = MatchToSkin(generic.surface, SkinMatcher(skull), options.columns,
                                      options.rows, options.reach_mm, context.threads);
  const SkullSites sites = SitesOf(head.points);
  const MeanNormals normals(skull, options.normal_radius_mm);
  SkullGrid grid{.uv = match.uv,
                 .bone = std::vector<Vec3>(match.uv.size(), Vec3::Constant(kNaN)),
                 .normals = std::vector<Vec3>(match.uv.size(), Vec3::Zero()),
                 .in_average = std::vector<Vec3>(match.uv.size(), Vec3::Constant(kNaN))};
  ParallelFor(match.uv.size(), context.threads, 64, [&](std::size_t k) {
    if (match.skin[k]) {
      grid.bone[k] = match.skin[k]->point;
      grid.normals[k] = normals.At(grid.bone[k], match.normals[k]);
      grid.in_average[k] = sites.InAverage(grid.bone[k]);
    }
  });
  return grid;
}

}  // namespace semblance
