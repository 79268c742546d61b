// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/template_face.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "problems/face/head_formula.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const TemplateFace& DefaultFace() {
  static const TemplateFace face = MakeTemplateFace({});
  return face;
}

Vec3 Mirrored(const Vec3& p) { return {-p.x(), p.y(), p.z()}; }

Vec3 PointOf(const std::string& site) {
  return DefaultFace().surface.Point(DefaultFace().site_uv.at(site));
}

// The distance of the surface from HeadPoint at the same (u,v), over a grid of samples_u x
// samples_v points (>= 2 each).
struct TemplateResidual {
  double rms_mm = kNaN;
  double max_mm = kNaN;
  Vec2 worst_uv = Vec2::Constant(kNaN);
};
TemplateResidual ResidualToFormula(const HSplineSurface& surface, int samples_u, int samples_v) {
  TemplateResidual residual{.rms_mm = 0, .max_mm = -1};
  for (int j = 0; j < samples_v; ++j) {
    for (int i = 0; i < samples_u; ++i) {
      const Vec2 uv(i / (samples_u - 1.0), j / (samples_v - 1.0));
      const double d = (surface.Point(uv) - HeadPoint(uv.x(), uv.y())).norm();
      residual.rms_mm += d * d;
      if (d > residual.max_mm) {
        residual.max_mm = d;
        residual.worst_uv = uv;
      }
    }
  }
  residual.rms_mm = std::sqrt(residual.rms_mm / (static_cast<double>(samples_u) * samples_v));
  return residual;
}

TEST(TemplateFace, StaysWithinHalfAMillimetreOfTheFormula) {
  const TemplateResidual residual = ResidualToFormula(DefaultFace().surface, 301, 301);
  EXPECT_LT(residual.rms_mm, 0.06);
  EXPECT_LT(residual.max_mm, 0.6);
  EXPECT_GT(residual.max_mm, residual.rms_mm);
}

TEST(TemplateFace, EachLevelOfDetailComesCloserToTheFormula) {
  double last = 1e9;
  for (int level = 0; level <= 3; ++level) {
    const TemplateFace face = MakeTemplateFace({.max_level = level});
    const double rms = ResidualToFormula(face.surface, 121, 121).rms_mm;
    EXPECT_LT(rms, last / 2) << level;
    last = rms;
  }
}

TEST(TemplateFace, IsMirrorSymmetric) {
  for (int j = 0; j <= 100; ++j) {
    for (int i = 0; i <= 100; ++i) {
      const double u = i / 200.0, v = j / 100.0;
      const Vec3 right = DefaultFace().surface.Point({u, v}),
                 left = DefaultFace().surface.Point({1 - u, v});
      ASSERT_LT((right - Mirrored(left)).norm(), 1e-9) << u << " " << v;
    }
  }
}

// This must hold for each level alone, because offsets are kept in the frames of the next coarser
// one.
TEST(TemplateFace, NormalsPointOutwardEverywhere) {
  const Vec3 inside(0, 95, -30);
  for (int level = 0; level <= 3; ++level) {
    const TemplateFace face = MakeTemplateFace({.max_level = level});
    for (int k = 0; k <= 200 * 200; ++k) {
      const SurfaceFrame frame = face.surface.Frame({k % 200 / 199.0, k / 200 / 200.0});
      ASSERT_GT(frame.Normal().dot((frame.point - inside).normalized()), 0.1) << level << " " << k;
    }
  }
}

TEST(TemplateFace, HasTheThirtyTwoSitesInsideTheDomain) {
  std::set<std::pair<double, double>> places;
  for (const std::string& code : StandardSiteCodes()) {
    ASSERT_TRUE(DefaultFace().site_uv.contains(code)) << code;
    const Vec2 uv = DefaultFace().site_uv.at(code);
    EXPECT_GT(uv.minCoeff(), 0.02) << code;
    EXPECT_LT(uv.maxCoeff(), 0.98) << code;
    places.insert({uv.x(), uv.y()});
  }
  EXPECT_EQ(DefaultFace().site_uv.size(), 32u);
  EXPECT_EQ(places.size(), 32u);
}

TEST(TemplateFace, SitesAreMirroredAndOnTheirSides) {
  for (const auto& [code, uv] : DefaultFace().site_uv) {
    if (code.ends_with("_l")) {
      const Vec2 right = DefaultFace().site_uv.at(code.substr(0, code.size() - 2) + "_r");
      EXPECT_EQ(right, Vec2(1 - uv.x(), uv.y())) << code;
      EXPECT_GT(PointOf(code).x(), 25) << code;
    } else if (!code.ends_with("_r")) {
      EXPECT_EQ(uv.x(), 0.5) << code;
      EXPECT_NEAR(PointOf(code).x(), 0, 1e-9) << code;
    }
  }
}

TEST(TemplateFace, MidlineSitesClimbTheProfile) {
  double last = 0;
  for (const char* code : {"me", "pg", "sm", "id", "pr", "mp", "rhi", "n", "g", "sg"}) {
    EXPECT_GT(DefaultFace().site_uv.at(code).y(), last) << code;
    last = DefaultFace().site_uv.at(code).y();
  }
}

TEST(TemplateFace, SitesKeepTheOrderOfTheirBones) {
  const auto y = [](const char* code) { return PointOf(code).y(); };
  const auto z = [](const char* code) { return PointOf(code).z(); };
  EXPECT_GT(z("fe_l"), z("mso_l") + 20);
  EXPECT_GT(z("mso_l"), z("mio_l") + 25);
  EXPECT_GT(z("mio_l"), z("lo_l") + 5);
  EXPECT_GT(z("lo_l"), z("im_l") + 3);
  EXPECT_GT(z("sM2_l"), z("mr_l"));
  EXPECT_GT(z("mr_l"), z("iM2_l"));
  EXPECT_GT(y("sgl_l"), y("zy_l") + 10);
  EXPECT_GT(y("go_l"), y("mr_l"));
  EXPECT_GT(y("mr_l"), y("sM2_l") + 15);
  EXPECT_GT(PointOf("lo_l").x(), PointOf("mio_l").x() + 8);
  EXPECT_NEAR(z("n") - z("me"), 120, 6);
  EXPECT_NEAR(PointOf("zy_l").x() - PointOf("zy_r").x(), 138, 8);
  EXPECT_NEAR(PointOf("go_l").x() - PointOf("go_r").x(), 117, 8);
}

TEST(TemplateFace, SitesDoNotDependOnThePatches) {
  const TemplateFace other = MakeTemplateFace({.patches_u = 6, .patches_v = 10, .max_level = 2});
  EXPECT_EQ(other.site_uv, DefaultFace().site_uv);
  EXPECT_EQ(other.surface.shape().patches_v, 10);
}

TEST(TemplateFace, FeaturesHaveVerticesOfTheirRegion) {
  std::vector<std::string> names;
  for (const TemplateFeature& feature : DefaultFace().features) {
    names.push_back(feature.name);
    EXPECT_GE(feature.vertices.size(), 40u) << feature.name;
    EXPECT_TRUE(std::is_sorted(feature.vertices.begin(), feature.vertices.end()));
    ASSERT_TRUE(feature.region.has_value());
    for (const VertexId& id : feature.vertices) {
      ASSERT_GE(id.level, 1);
      ASSERT_LE(id.level, 3);
      const ControlNet& net = DefaultFace().surface.Net(id.level);
      ASSERT_TRUE(id.i >= 0 && id.i < net.columns && id.j >= 0 && id.j < net.rows);
    }
  }
  const std::vector<VertexId> all = FeatureVertices(DefaultFace());
  EXPECT_EQ(std::set<VertexId>(all.begin(), all.end()).size(), all.size());
  EXPECT_GT(all.size(), DefaultFace().features[0].vertices.size());
  EXPECT_THAT(names, ElementsAre("nose", "mouth", "eye_l", "eye_r"));
}

TEST(TemplateFace, FeatureRegionsHoldTheirParts) {
  const auto region = [](int k) { return *DefaultFace().features[k].region; };
  Vec3 tip = Vec3::Zero();
  for (int j = 0; j <= 1000; ++j) {
    const Vec3 p = DefaultFace().surface.Point({0.5, j / 1000.0});
    tip = p.y() < tip.y() ? p : tip;
  }
  EXPECT_TRUE(region(0).Contains(tip));
  EXPECT_TRUE(region(1).Contains(PointOf("pr")));
  EXPECT_TRUE(region(1).Contains(PointOf("id")));
  EXPECT_FALSE(region(1).Contains(PointOf("pg")));
  EXPECT_FALSE(region(2).Contains(PointOf("fe_l")));
  EXPECT_FALSE(region(2).Contains(PointOf("mio_l")));
  EXPECT_EQ(region(3).center, Mirrored(region(2).center));
  EXPECT_EQ(TemplateMasks(DefaultFace()).size(), 4u);
}

TEST(TemplateFace, ASphereIsCarriedBySimilarity) {
  const Similarity s{.scale = 2, .rotation = Mat3::Identity(), .translation = {1, 2, 3}};
  const Sphere placed = TransformedSphere(Sphere{{1, 1, 1}, 4}, s);
  EXPECT_EQ(placed.center, Vec3(3, 4, 5));
  EXPECT_EQ(placed.radius_mm, 8);
}

TEST(TemplateFace, ALargerToleranceStoresLessDetail) {
  const auto detail = [](double tolerance_mm) {
    const TemplateFace face =
        MakeTemplateFace({.max_level = 2, .detail_tolerance_mm = tolerance_mm});
    return ResidualToFormula(face.surface, 101, 101).rms_mm;
  };
  EXPECT_LT(detail(0), detail(1));
}

TEST(TemplateFace, OffsetsInWorldAxesMakeTheSameFace) {
  const TemplateFace world = MakeTemplateFace({.reference = OffsetReference::kWorld});
  EXPECT_EQ(world.surface.shape().reference, OffsetReference::kWorld);
  EXPECT_NE(world.surface.Offsets(), DefaultFace().surface.Offsets());
  for (double u = 0.02; u < 1; u += 0.08) {
    for (double v = 0.02; v < 1; v += 0.08) {
      EXPECT_LT((world.surface.Point({u, v}) - DefaultFace().surface.Point({u, v})).norm(), 1e-9);
    }
  }
}

TEST(TemplateFace, OptionsOutOfRangeAreNamed) {
  try {
    MakeTemplateFace({.patches_u = 3});
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("patches_u is 3"));
  }
  EXPECT_THROW(MakeTemplateFace({.max_level = 5}), InputError);
  EXPECT_THROW(MakeTemplateFace({.detail_tolerance_mm = kNaN}), InputError);
}

}  // namespace
}  // namespace semblance::problems
