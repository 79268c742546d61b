// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/propose/propose_landmarks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "problems/subject/phantom.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr int kRings = 45;

Phantom PhantomOf(std::uint64_t random_seed) {
  return MakePhantom({.random_seed = random_seed, .rings = kRings});
}

const std::vector<ReferenceHead>& OneReference() {
  static const std::vector<ReferenceHead> heads = [] {
    std::vector<ReferenceHead> one;
    one.push_back(PhantomReference(11));
    return one;
  }();
  return heads;
}

Proposal ProposeAt(const Similarity& pose, int threads) {
  return ProposeLandmarks(Transformed(PhantomOf(4).skull, pose), "skull.ply", OneReference(),
                          {.on_event = {}, .stop_token = {}, .threads = threads});
}

// The phantom where it was made, by one thread.
const Proposal& PlainProposal() {
  static const Proposal proposal = ProposeAt({}, 1);
  return proposal;
}

// The phantom moved, turned and scaled.
const Similarity& OtherPose() {
  static const Similarity pose = [] {
    Random random(9);
    const Mat3 turn = Eigen::AngleAxisd(2.1, random.Direction()).toRotationMatrix();
    return Similarity{.scale = 1.08, .rotation = turn, .translation = random.InBox(-200, 200)};
  }();
  return pose;
}
const Proposal& MovedProposal() {
  static const Proposal proposal = ProposeAt(OtherPose(), 2);
  return proposal;
}

LandmarkFile Truth(const Phantom& phantom, const Similarity& pose) {
  LandmarkFile file;
  for (const PhantomSite& s : phantom.sites) {
    const Vec3 p = pose * s.base;
    Landmark landmark;
    landmark.site = s.site;
    landmark.point = {p.x(), p.y(), p.z()};
    file.landmarks.push_back(landmark);
  }
  return file;
}

std::string ErrorOf(const TriMesh& skull) {
  try {
    const std::vector<ReferenceHead>& references = OneReference();
    ProposeLandmarks(skull, "skull.ply", references, {});
  } catch (const InputError& e) {
    return e.what();
  }
  return "no error";
}

TEST(ProposeLandmarks, FindsTheSitesOfAMovedAndScaledHead) {
  const Proposal& proposal = MovedProposal();
  EXPECT_THAT(proposal.absent, IsEmpty());
  const ProposalComparison found =
      CompareProposal(ProposalFile(proposal, "head"), Truth(PhantomOf(4), OtherPose()));
  EXPECT_EQ(found.compared, 32);
  EXPECT_LT(found.median_mm, 3);
  EXPECT_LT(found.nine_tenths_mm, 6);
  EXPECT_LT(found.most_mm, 10);
}

TEST(ProposeLandmarks, MarkersPointOutwardsInTheFrameOfTheSkull) {
  const Phantom phantom = PhantomOf(4);
  const LandmarkFile file = ProposalFile(MovedProposal(), "head");
  Vec3 middle = Vec3::Zero();
  for (const PhantomSite& s : phantom.sites) {
    middle += OtherPose() * s.base / static_cast<double>(phantom.sites.size());
  }
  ASSERT_FALSE(file.landmarks.empty());
  for (const Landmark& l : file.landmarks) {
    ASSERT_TRUE(l.normal) << l.site;
    const Vec3 direction(l.normal->data());
    EXPECT_NEAR(direction.norm(), 1, 1e-9) << l.site;
    EXPECT_GT(direction.dot(l.Position() - middle), 0) << l.site;
  }
}

TEST(ProposeLandmarks, DoesNotDependOnThreadsThorough) {
  const Proposal &one = PlainProposal(), two = ProposeAt({}, 2);
  ASSERT_EQ(one.sites.size(), two.sites.size());
  for (std::size_t k = 0; k < one.sites.size(); ++k) {
    EXPECT_EQ(one.sites[k].point, two.sites[k].point);
    EXPECT_EQ(one.sites[k].confidence, two.sites[k].confidence);
  }
}

TEST(ProposeLandmarks, RecognisesRasAndWritesItToTheFile) {
  const Phantom phantom = PhantomOf(4);
  const Similarity ras = {.scale = 1,
                          .rotation = Vec3(-1, -1, 1).asDiagonal().toDenseMatrix(),
                          .translation = Vec3::Zero()};
  const std::vector<ReferenceHead>& references = OneReference();
  const Proposal proposal =
      ProposeLandmarks(Transformed(phantom.skull, ras), "skull.ply", references, {});
  EXPECT_EQ(ProposalFile(proposal, "head").axes, "RAS");
  EXPECT_THAT(proposal.notes, ElementsAre(HasSubstr("the skull is RAS")));
  const auto left = std::ranges::find(proposal.sites, "zy_l", &ProposedSite::site);
  ASSERT_NE(left, proposal.sites.end());
  EXPECT_LT(left->point.x(), -30);  // in the file's frame
}

// A mirrored skull is a skull too, and its left sites are on its left.
TEST(ProposeLandmarks, SidesAreNeverExchanged) {
  TriMesh mirrored = PhantomOf(4).skull;
  for (Vec3& p : mirrored.points) {
    p.x() = -p.x();
  }
  for (Triangle& t : mirrored.triangles) {
    std::swap(t[1], t[2]);
  }
  const std::vector<ReferenceHead>& references = OneReference();
  for (const ProposedSite& s : ProposeLandmarks(mirrored, "skull.ply", references, {}).sites) {
    const double side = SideOfSite(s.site) == Side::kLeft    ? 1
                        : SideOfSite(s.site) == Side::kRight ? -1
                                                             : 0;
    EXPECT_GE(side * s.point.x(), side == 0 ? 0 : 15) << s.site;
  }
}

TEST(ProposeLandmarks, MissingBoneGivesAbsentSites) {
  const Phantom phantom = PhantomOf(4);
  std::vector<bool> keep;
  for (const Triangle& t : phantom.skull.triangles) {
    keep.push_back(TriangleCentroid(phantom.skull, t).z() > -72);
  }
  const std::vector<ReferenceHead>& references = OneReference();
  const Proposal proposal =
      ProposeLandmarks(Submesh(phantom.skull, keep), "skull.ply", references, {});
  for (const char* site : {"pg", "me"}) {
    EXPECT_NE(std::ranges::find(proposal.absent, site, &AbsentLandmark::site),
              proposal.absent.end())
        << site;
  }
  EXPECT_NE(std::ranges::find(proposal.sites, "g", &ProposedSite::site), proposal.sites.end());
}

TEST(ProposeLandmarks, AMeshThatIsNoSkullGivesOneClearLine) {
  EXPECT_THAT(ErrorOf({}), HasSubstr("skull.ply: the mesh has no triangles"));
  const TriMesh skull = PhantomOf(4).skull;
  EXPECT_THAT(ErrorOf(testing::SphereMesh(Vec3(0, 80, 0), 95, 60)),
              HasSubstr("skull.ply: its shape does not determine its pose"));
  const Similarity aside = {.scale = 1, .rotation = Mat3::Identity(), .translation = {170, 0, 0}};
  const TriMesh two = testing::Joined(skull, Transformed(skull, aside));
  EXPECT_THAT(ErrorOf(two), HasSubstr("skull.ply: it has two bodies as large as a skull"));
  EXPECT_THROW(ProposeLandmarks(skull, "skull.ply", {}, {}), InputError);
}

TEST(ProposeLandmarks, MoreConfidentSitesHaveSmallerErrors) {
  for (const ProposedSite& s : PlainProposal().sites) {
    EXPECT_GT(s.confidence, 0) << s.site;
    EXPECT_LT(s.confidence, 1) << s.site;
    EXPECT_GE(s.expected_error_mm, OneReference()[0].site_error_mm) << s.site;
  }
}

TEST(ReferenceHead, MirroredTwiceIsUnchanged) {
  const ReferenceHead head = PhantomReference(3);
  const ReferenceHead back = Mirrored(Mirrored(head));
  ASSERT_EQ(back.sites.size(), head.sites.size());
  for (std::size_t k = 0; k < head.sites.size(); ++k) {
    EXPECT_EQ(back.sites[k].site, head.sites[k].site);
    EXPECT_EQ(back.sites[k].point, head.sites[k].point);
  }
  EXPECT_EQ(back.shell.mesh.triangles, head.shell.mesh.triangles);
  EXPECT_GT(SignedVolume(Mirrored(head).shell.mesh), 0);
}

using ::testing::HasSubstr;

LandmarkFile FileOf(const std::vector<std::pair<std::string, double>>& x_of_site) {
  LandmarkFile file;
  for (const auto& [site, x] : x_of_site) {
    Landmark landmark;
    landmark.site = site;
    landmark.point = {x, 0, 0};
    file.landmarks.push_back(landmark);
  }
  return file;
}

TEST(CompareProposal, GivesDistancesAndTheirQuantiles) {
  const ProposalComparison c = CompareProposal(FileOf({{"g", 1}, {"n", 4}, {"pg", 2}}),
                                               FileOf({{"g", 0}, {"n", 0}, {"pg", 0}}));
  EXPECT_EQ(c.compared, 3);
  EXPECT_EQ(c.median_mm, 2);
  EXPECT_EQ(c.nine_tenths_mm, 4);
  EXPECT_EQ(c.most_mm, 4);
}

TEST(CompareProposal, NotesSitesOfOneFileAndDoesNotCountThem) {
  const ProposalComparison c =
      CompareProposal(FileOf({{"g", 1}, {"n", 4}}), FileOf({{"g", 0}, {"pg", 0}}));
  EXPECT_EQ(c.compared, 1);
  const std::string text = FormatComparison(c);
  EXPECT_THAT(text, HasSubstr("proposed, and not placed by hand"));
  EXPECT_THAT(text, HasSubstr("placed by hand, and not proposed"));
  EXPECT_THAT(text, HasSubstr("1 sites: median 1.0 mm"));
}

TEST(CompareProposal, NoCommonSiteIsAnError) {
  EXPECT_THROW(CompareProposal(FileOf({{"g", 1}}), FileOf({{"n", 1}})), InputError);
}

}  // namespace

}  // namespace semblance::problems
