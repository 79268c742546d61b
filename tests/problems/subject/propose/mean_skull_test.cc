// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/propose/mean_skull.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "problems/subject/propose/propose_landmarks.h"
#include "problems/subject/sites.h"
#include "surfaces/base/random.h"

namespace semblance::problems {
namespace {

using ::testing::SizeIs;

// A skull of the population with its sites, in any pose.
struct DrawnSkull {
  TriMesh mesh;
  LandmarkFile truth;
};

DrawnSkull Draw(const MeanSkull& mean, std::uint64_t random_seed, const Similarity& pose) {
  Random random(random_seed);
  DrawnSkull drawn{mean.head.shell.mesh, {}};
  for (const std::vector<Vec3>& mode : mean.modes) {
    const double coefficient = random.Uniform(-1.5, 1.5);
    for (std::size_t v = 0; v < mode.size(); ++v) {
      drawn.mesh.points[v] += coefficient * mode[v];
    }
  }
  drawn.mesh = Transformed(drawn.mesh, pose);
  for (const SitePoint& s : mean.head.sites) {
    const MeshPoint at = mean.head.shell.surface.query().Closest(s.point);
    const Triangle& t = drawn.mesh.triangles[at.triangle];
    Landmark& landmark = drawn.truth.landmarks.emplace_back();
    landmark.site = s.site;
    landmark.MoveTo(at.weights[0] * drawn.mesh.points[t[0]] +
                    at.weights[1] * drawn.mesh.points[t[1]] +
                    at.weights[2] * drawn.mesh.points[t[2]]);
  }
  return drawn;
}

Similarity SmallMove() {
  return {.scale = 1.05,
          .rotation = Eigen::AngleAxisd(0.1, Vec3(1, 2, 1).normalized()).toRotationMatrix(),
          .translation = Vec3(20, -30, 100)};
}

TEST(MeanSkull, HasAllSitesOnItsBoneAndIsSymmetric) {
  const MeanSkull mean = ReadMeanSkull();
  EXPECT_THAT(mean.head.sites, SizeIs(32));
  const MeshQuery& bone = mean.head.shell.surface.query();
  for (const SitePoint& s : mean.head.sites) {
    EXPECT_LT(bone.Closest(s.point).distance_mm, 0.02) << s.site;
    EXPECT_GT(mean.head.SiteError_mm(s.site), 1) << s.site;
    EXPECT_LT((s.point - AverageSite(s.site)).norm(), 12) << s.site;
    const auto other = std::ranges::find(mean.head.sites, MirroredSite(s.site), &SitePoint::site);
    EXPECT_LT((Vec3(-s.point.x(), s.point.y(), s.point.z()) - other->point).norm(), 0.5) << s.site;
  }
  for (std::size_t v = 0; v < mean.head.shell.mesh.points.size(); v += 50) {
    const Vec3& p = mean.head.shell.mesh.points[v];
    EXPECT_LT(bone.Closest({-p.x(), p.y(), p.z()}).distance_mm, 3) << v;
  }
}

TEST(MeanSkull, ModesMoveEachVertexByMillimetres) {
  const MeanSkull mean = ReadMeanSkull();
  ASSERT_GE(mean.modes.size(), 8u);
  double last_mm = 100;
  for (const std::vector<Vec3>& mode : mean.modes) {
    ASSERT_EQ(mode.size(), mean.head.shell.mesh.points.size());
    double squares = 0;
    for (const Vec3& d : mode) {
      squares += d.squaredNorm() / static_cast<double>(mode.size());
    }
    EXPECT_LT(std::sqrt(squares), last_mm + 0.05) << "the largest mode comes first";
    last_mm = std::sqrt(squares);
  }
}

TEST(MeanSkull, TheModesFindTheShapeOfASkullOfThePopulation) {
  const MeanSkull mean = ReadMeanSkull();
  const DrawnSkull drawn = Draw(mean, 5, SmallMove());
  const SkullShell shell = AsShell(drawn.mesh);
  const AdaptedSkull adapted = AdaptMeanSkull(mean, shell, SmallMove(), {});
  double before_mm = 0, after_mm = 0;
  for (std::size_t k = 0; k < mean.head.sites.size(); ++k) {
    const Vec3 truth = drawn.truth.landmarks[k].Position();
    before_mm += (SmallMove() * mean.head.sites[k].point - truth).norm() / 32;
    after_mm += (adapted.skull_from_head * adapted.head.sites[k].point - truth).norm() / 32;
  }
  EXPECT_GT(before_mm, 3);
  EXPECT_LT(after_mm, 0.5 * before_mm);
}

TEST(MeanSkull, LandmarksAreProposedWithoutAReference) {
  const MeanSkull mean = ReadMeanSkull();
  const DrawnSkull drawn = Draw(mean, 7, SmallMove());
  const Proposal proposal = ProposeLandmarks(drawn.mesh, "skull.ply", mean, {});
  const ProposalComparison found = CompareProposal(ProposalFile(proposal, "head"), drawn.truth);
  EXPECT_GE(found.compared, 28);
  EXPECT_LT(found.median_mm, 2.5);
  EXPECT_LT(found.nine_tenths_mm, 5);
}

// The clicks turn the skull in any pose, without a search, and stay as they are.
TEST(MeanSkull, ThreeClicksGiveThePose) {
  const MeanSkull mean = ReadMeanSkull();
  const Similarity pose = {
      .scale = 0.95,
      .rotation = Eigen::AngleAxisd(2.5, Vec3(1, -1, 2).normalized()).toRotationMatrix(),
      .translation = Vec3(300, 0, 0)};
  const DrawnSkull drawn = Draw(mean, 8, pose);
  std::vector<SitePoint> clicks;
  for (const char* site : {"n", "zy_l", "zy_r"}) {
    clicks.push_back({site, drawn.truth.Find(site)->Position()});
  }
  const Proposal proposal = ProposeLandmarks(drawn.mesh, "skull.ply", mean, {}, clicks);
  const LandmarkFile file = ProposalFile(proposal, "head");
  EXPECT_EQ(file.Find("n"), nullptr);
  const ProposalComparison found = CompareProposal(file, drawn.truth);
  EXPECT_GE(found.compared, 25);
  EXPECT_LT(found.median_mm, 2.5);
  for (const Landmark& landmark : file.landmarks) {
    EXPECT_TRUE(landmark.doubt_mm) << landmark.site;
  }
}

TEST(MeanSkull, ClicksOfExchangedSidesAreRefused) {
  const MeanSkull mean = ReadMeanSkull();
  const DrawnSkull drawn = Draw(mean, 9, {});
  const std::vector<SitePoint> wrong = {{"n", drawn.truth.Find("me")->Position()},
                                        {"zy_l", drawn.truth.Find("zy_r")->Position()},
                                        {"zy_r", drawn.truth.Find("fe_l")->Position()}};
  EXPECT_THROW(ProposeLandmarks(drawn.mesh, "skull.ply", mean, {}, wrong), InputError);
}

}  // namespace
}  // namespace semblance::problems
