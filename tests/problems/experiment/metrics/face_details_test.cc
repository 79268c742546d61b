// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/metrics/face_details.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "problems/experiment/experiment_config.h"
#include "problems/run.h"
#include "problems/subject/phantom.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

using testing::Plate;

TriMesh PlateAt(double z) {
  TriMesh plate = Plate(40, 10);
  for (Vec3& p : plate.points) {
    p.z() = z;
  }
  return plate;
}

TEST(SiteErrors, AreMeasuredAlongTheDowel) {
  const Vec3 up(0, 0, 1), slanted = Vec3(0.6, 0, 0.8);
  const std::vector<Dowel> landmarks = {{.site = "g", .base = {11, 17, 0}, .direction = up},
                                        {.site = "n", .base = {11, 17, 0}, .direction = slanted},
                                        {.site = "pg", .base = {500, 0, 0}, .direction = up},
                                        {.site = "me", .base = {11, 17, 0}}};
  for (const double face_at : {7.0, -2.0}) {
    const auto errors = MeasureSites(PlateAt(4), PlateAt(face_at), landmarks);
    ASSERT_EQ(errors.size(), 3u);  // one has no direction
    EXPECT_NEAR(errors[0].true_mm, 4, 1e-9);
    EXPECT_NEAR(errors[0].Error_mm(), face_at - 4, 1e-9);
    EXPECT_NEAR(errors[1].true_mm, 5, 1e-9);
    EXPECT_NEAR(errors[1].Error_mm(), (face_at - 4) / 0.8, 1e-9);
    EXPECT_TRUE(std::isnan(errors[2].Error_mm()));
  }
}

TEST(SiteErrors, TrueDepthsOfAPhantomAreFound) {
  const Phantom head = MakePhantom({.rings = 100});
  std::vector<Dowel> landmarks;
  for (const PhantomSite& s : head.sites) {
    landmarks.push_back({.site = s.site, .base = s.base, .direction = s.normal});
  }
  const auto errors = MeasureSites(head.face, head.face, landmarks);
  for (std::size_t k = 0; k < errors.size(); ++k) {
    EXPECT_NEAR(errors[k].true_mm, head.sites[k].depth_mm, 0.25) << errors[k].site;
    EXPECT_NEAR(errors[k].Error_mm(), 0, 1e-9);
  }
}

// A phantom has hardly a nose; here it gets one.
TriMesh WithNose(TriMesh face) {
  for (Vec3& p : face.points) {
    const Vec3 off = (p - Vec3(0, 0, -30)) / 12;
    p.y() -= p.y() < 40 ? 30 * std::exp(-off.x() * off.x() - off.z() * off.z()) : 0;
  }
  return face;
}

TEST(FeaturePoints, TheNoseTipMovesWithTheFace) {
  const Phantom head = MakePhantom({.rings = 60});
  std::vector<SitePoint> points;
  for (const PhantomSite& s : head.sites) {
    points.push_back({s.site, s.base});
  }
  const SkullSites sites = CompleteSites(points);
  const TriMesh truth = WithNose(head.face);
  const Similarity moved{1, Mat3::Identity(), {1, -2, 2}};
  const auto found = MeasureFeaturePoints(truth, Transformed(truth, moved), sites);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].name, "nose_tip");
  EXPECT_NEAR(found[0].on_truth.z(), -30, 5);
  EXPECT_NEAR(found[0].Error_mm(), 3, 0.01);
  TriMesh receding = head.face;  // foremost at the lips
  for (Vec3& p : receding.points) {
    p.y() += p.z();
  }
  EXPECT_TRUE(MeasureFeaturePoints(truth, receding, sites).empty());
}

double StrainOfFeatures(const std::string& rule, StageCache& cache) {
  const auto config = std::filesystem::path(SEMBLANCE_SOURCE_DIR) / "configs/phantom.yaml";
  const std::vector<std::string> overrides = {"subject.rings=30", "implicit.resolution=36",
                                              "seeds.level=1", "uncertainty.sigma=false",
                                              fmt::format("fit.features={}", rule)};
  const RunResult result = Run(ReadConfig<Experiment>(config, overrides), {}, &cache);
  const FeatureDistortion& all = *(result.features.end() - 2);
  EXPECT_EQ(all.part, "features");
  return all.distortion.rms_strain;
}

// The coarse level strains features, because it has too few vertices to bend only around them.
// Their finer vertices undo some of that, the less the more they are held
// (docs/explanation/fit.md).
TEST(FeatureDistortion, TheMoreTheirOffsetsAreHeldTheMoreFeaturesAreStrainedThorough) {
  StageCache cache(8);
  const auto strain = [&](const char* rule) { return StrainOfFeatures(rule, cache); };
  const double free = strain("free"), weighted = strain("weighted"), frozen = strain("frozen"),
               restored = strain("restore");
  EXPECT_LT(free, weighted);
  EXPECT_LT(weighted, frozen);
  EXPECT_LT(frozen, restored);
}

}  // namespace
}  // namespace semblance::problems
