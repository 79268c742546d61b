// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/recentre.h"

#include <gtest/gtest.h>

#include <cmath>

#include "problems/face/hspline_prior.h"
#include "problems/face/template_source.h"

namespace semblance::problems {
namespace {

constexpr double kMovedMm = 1.5;

// Faces of a population. On the forehead its mean lies 1.5 mm outside the model's, and its glabella
// is 6 mm higher than the model's.
struct Heads {
  TemplateFace face = LoadTemplate(IctTemplate{});
  FacePrior prior = LoadPrior(IctPrior{.count = 3}, face);
  PriorOnTemplate on_template = LayOnTemplate(prior, face, {});
  Vec3 forehead = Vec3(0, -105, 75);
  TriMesh skin = prior.model.mean;
  std::vector<Dowel> dowels;
  Vec3 glabella;

  Heads() {
    const std::vector<Vec3> normals = VertexNormals(skin);
    for (std::size_t v = 0; v < skin.points.size(); ++v) {
      const double squared = (skin.points[v] - forehead).squaredNorm();
      skin.points[v] += kMovedMm * std::exp(-squared / (2 * 15 * 15)) * normals[v];
    }
    for (const auto& [site, at] : prior.sites) {
      Dowel dowel;
      dowel.site = site;
      dowel.direction = FindPosition(at, skin, normals).normalized();
      dowel.depth_mm = 5;
      Vec3 tip = FindPosition(at, prior.model.mean, prior.model.mean.points);
      tip.z() += site == "g" ? 6 : 0;
      if (site == "g") {
        glabella = tip;
      }
      dowel.base = tip - 5 * dowel.direction;
      if (site != "sg") {  // nothing holds the forehead
        dowels.push_back(dowel);
      }
    }
  }
};

TEST(Recentre, SitesGoToTheTipsAndTheMeanToTheSkin) {
  const Heads heads;
  const std::vector<KnownHead> known = {{.dowels = heads.dowels, .skin = heads.skin}};
  const Recentred result =
      Recentre(heads.prior, heads.on_template, heads.face, known, {.move_mean = true},
               {.on_event = {}, .stop_token = {}, .threads = 2});
  // A head of two sides against two points: half of the way.
  const double way = (result.face.surface.Point(result.face.site_uv.at("g")) -
                      heads.face.surface.Point(heads.face.site_uv.at("g")))
                         .z();
  EXPECT_NEAR(way, 3, 0.8);
  // The mean moves less than that, because the estimate's smooth rest follows the dowels nearby.
  const Vec2 uv(0.5, 0.8);
  const double moved = (result.face.surface.Point(uv) - heads.face.surface.Point(uv))
                           .dot(heads.face.surface.Normal(uv));
  EXPECT_GT(moved, 0.1);
  EXPECT_LT(moved, 0.5 * kMovedMm);
  EXPECT_NEAR(result.face.site_uv.at("n").x(), 0.5, 1e-12);
}

TEST(Recentre, ATipWithoutSkinDoesNotMoveItsSite) {
  const Heads heads;
  std::vector<bool> keep;
  for (const Triangle& t : heads.skin.triangles) {
    keep.push_back((heads.skin.points[t[0]] - heads.glabella).norm() > 15);
  }
  const std::vector<KnownHead> known = {{heads.dowels, Submesh(heads.skin, keep)}};
  const Recentred result = Recentre(heads.prior, heads.on_template, heads.face, known, {},
                                    {.on_event = {}, .stop_token = {}, .threads = 2});
  EXPECT_NEAR((result.face.site_uv.at("g") - heads.face.site_uv.at("g")).norm(), 0, 1e-12);
  EXPECT_EQ(result.face.surface.Offsets(), heads.face.surface.Offsets());  // move_mean is false
}

}  // namespace
}  // namespace semblance::problems
