// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline/feature.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/splines.h"

namespace semblance::surfaces {
namespace {

using ::testing::HasSubstr;
using testing::RandomSurface;
using testing::SmoothSurface;

// Level 0 mirrored by (u,v) -> (1 - u, v), x -> -x.
HSplineSurface MirroredLevelZero(const HSplineSurface& surface) {
  const HSplineShape& shape = surface.shape();
  ControlNet net = surface.Net(0);
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      const int from = (shape.patches_u + 2 - i) % net.columns;
      net.At(i, j) = Vec3(-1, 1, 1).cwiseProduct(surface.Net(0).At(from, j));
    }
  }
  return HSplineSurface(shape, net);
}

TEST(Feature, ABlendThatIsNoFiniteNumberIsRefused) {
  const HSplineShape shape{.patches_u = 4, .patches_v = 4, .max_level = 2};
  const Feature feature = ExtractFeature(RandomSurface(shape, 1), "a");
  const std::vector<Feature> features = {feature, feature};
  EXPECT_NO_THROW(BlendFeatures("b", features, std::vector{0.5, 0.5}));
  for (const std::vector<double>& weights :
       {std::vector{1e308, 1e308}, std::vector{1e308, 0.0}, std::vector{kNaN, 1.0}}) {
    Feature large = feature;
    large.offsets.begin()->second *= 1e3;
    EXPECT_THROW(BlendFeatures("b", std::vector{large, large}, weights), InputError);
  }
}

class FeatureLaws : public ::testing::TestWithParam<HSplineShape> {
 protected:
  HSplineSurface Face(std::uint64_t random_seed) const {
    return RandomSurface(GetParam(), random_seed);
  }
};

TEST_P(FeatureLaws, AWholeFeatureGivesTheFaceBackToTheBit) {
  const HSplineSurface face = Face(1);
  const Feature feature = ExtractFeature(face, "all");
  EXPECT_EQ(feature.offsets, face.Offsets());
  HSplineSurface smooth = SmoothSurface(GetParam(), 1);
  ApplyFeature(feature, smooth);
  EXPECT_EQ(smooth.Net(GetParam().max_level).vertices, face.Net(GetParam().max_level).vertices);
}

TEST_P(FeatureLaws, ARegionHoldsItsVerticesAndNoOthers) {
  const HSplineSurface face = Face(2);
  const FeatureRegion region{.lowest_u = 0.7, .highest_u = 0.2, .highest_v = 0.6, .first_level = 2};
  const Feature feature = ExtractFeature(face, "nose", region);
  for (const auto& [vertex, offset] : face.Offsets()) {
    const Vec2 uv = face.GrevillePoint(vertex);
    const bool inside = vertex.level >= 2 && (uv.x() >= 0.7 || uv.x() <= 0.2) && uv.y() <= 0.6;
    EXPECT_EQ(feature.offsets.contains(vertex), inside);
  }
  EXPECT_FALSE(feature.offsets.empty());
}

TEST_P(FeatureLaws, BlendingOneAndZeroIsTheFirst) {
  const std::vector<Feature> both = {ExtractFeature(Face(3), "one"),
                                     ExtractFeature(Face(4), "two")};
  const FeatureBlend blend = BlendFeatures("one", both, std::vector<double>{1, 0});
  EXPECT_EQ(blend.feature, both[0]);
  EXPECT_TRUE(blend.warnings.empty());
}

TEST_P(FeatureLaws, BlendsAreLinearAndExtrapolationGivesAWarning) {
  const std::vector<Feature> both = {ExtractFeature(Face(3), "one"),
                                     ExtractFeature(Face(4), "two")};
  const FeatureBlend blend = BlendFeatures("mix", both, std::vector<double>{0.25, 1.5});
  ASSERT_EQ(blend.warnings.size(), 1u);
  EXPECT_THAT(blend.warnings[0], HasSubstr("feature two: the weight 1.5"));
  const auto at = [](const Feature& feature, const VertexId& vertex) -> Vec3 {
    const auto found = feature.offsets.find(vertex);
    return found == feature.offsets.end() ? Vec3::Zero() : found->second;
  };
  for (const auto& [vertex, offset] : blend.feature.offsets) {
    EXPECT_LT((offset - 0.25 * at(both[0], vertex) - 1.5 * at(both[1], vertex)).norm(), 1e-14);
  }
  for (const Feature& feature : both) {
    for (const auto& [vertex, offset] : feature.offsets) {
      EXPECT_TRUE(blend.feature.offsets.contains(vertex));
    }
  }
}

TEST_P(FeatureLaws, MirroringTwiceIsTheIdentity) {
  const Feature feature = ExtractFeature(Face(5), "ear");
  EXPECT_NE(MirrorFeature(feature), feature);
  EXPECT_EQ(MirrorFeature(MirrorFeature(feature)), feature);
}

TEST_P(FeatureLaws, AMirroredFeatureOnTheMirroredFaceIsTheFaceInTheMirror) {
  const HSplineSurface face = Face(6);
  HSplineSurface mirrored = MirroredLevelZero(face);
  ApplyFeature(MirrorFeature(ExtractFeature(face, "all")), mirrored);
  Random random(6);
  for (int k = 0; k < 100; ++k) {
    const Vec2 uv(random.Uniform(0, 1), random.Uniform(0, 1));
    const Vec3 expected = Vec3(-1, 1, 1).cwiseProduct(face.Point({1 - uv.x(), uv.y()}));
    EXPECT_LT((mirrored.Point(uv) - expected).norm(), 1e-10);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Shapes, FeatureLaws,
    ::testing::Values(
        HSplineShape{.patches_u = 4, .patches_v = 5, .max_level = 3},
        HSplineShape{
            .patches_u = 5, .patches_v = 4, .max_level = 2, .closure = Closure::kPeriodicU},
        HSplineShape{
            .patches_u = 4, .patches_v = 4, .max_level = 2, .reference = OffsetReference::kWorld}));

TEST(Feature, WhatDoesNotFitIsRefusedAndNothingChanges) {
  const HSplineShape shape{.patches_u = 4, .patches_v = 4, .max_level = 2};
  const Feature feature = ExtractFeature(RandomSurface(shape, 1), "nose");
  HSplineSurface other = SmoothSurface({.patches_u = 5, .patches_v = 4, .max_level = 2}, 1);
  EXPECT_THROW(ApplyFeature(feature, other), InputError);
  HSplineSurface shallow = SmoothSurface({.patches_u = 4, .patches_v = 4, .max_level = 1}, 1);
  EXPECT_THROW(ApplyFeature(feature, shallow), InputError);
  EXPECT_TRUE(shallow.Offsets().empty() && other.Offsets().empty());
  const std::vector<Feature> both = {feature, ExtractFeature(other, "other")};
  EXPECT_THROW(BlendFeatures("mix", both, std::vector<double>{1, 1}), InputError);
  EXPECT_THROW(BlendFeatures("mix", both, std::vector<double>{1}), InputError);
  EXPECT_THROW(BlendFeatures("mix", {&feature, 1}, std::vector<double>{kNaN}), InputError);
  EXPECT_THROW(ExtractFeature(other, "../nose"), InputError);
}

}  // namespace
}  // namespace semblance::surfaces
