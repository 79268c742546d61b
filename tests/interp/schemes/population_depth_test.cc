// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/schemes/population_depth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "interp/schemes/people.h"
#include "interp/schemes/radial_basis.h"
#include "surfaces/base/error.h"
#include "surfaces/base/quantile.h"
#include "tests/testing/dowel_scenes.h"

namespace semblance::interp {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::NanSensitiveDoubleEq;
using ::testing::Pointwise;

// A person whose bone is the mean bone, moved by a similarity: one thorn per point, a closed
// tetrahedron whose outer side lies in the bone's surface.
struct Person {
  TriMesh bone;
  std::vector<Vec3> normals;
  std::vector<Dowel> dowels;
  DowelNetwork network;
  const TriMesh* filled_from = nullptr;

  // builds: how many standard deviations of build the dowels are thicker than people's mean.
  explicit Person(double builds = 0, const Similarity& place = {}) {
    for (const PeoplePoint& point : CarriedPeople().bone) {
      AddThorn(point, place);
    }
    for (const auto& [site, point] : CarriedPeople().sites) {
      if (IsBesideTheHead(site)) {
        continue;  // in the fossa a dowel would stand below a filled skull
      }
      const double log_mm = point.depth.mean + builds * point.depth.loading * point.depth.sd;
      dowels.push_back(
          {site, place * point.position, place.rotation * point.normal, std::exp(log_mm)});
    }
  }

  // True for the sites that no published table has.
  static bool IsBesideTheHead(const std::string& site) {
    const std::string landmark = WithoutSide(site);
    return landmark == "ut" || landmark == "tf" || landmark == "ma" || landmark == "pa";
  }

  void AddThorn(const PeoplePoint& point, const Similarity& place) {
    constexpr double kRadius_mm = 2, kDeep_mm = 4;
    const Vec3 a = point.normal.unitOrthogonal(), b = point.normal.cross(a);
    const int first = static_cast<int>(bone.points.size());
    for (int k = 0; k < 3; ++k) {
      const double angle = 2 * EIGEN_PI * k / 3;
      bone.points.push_back(
          place * (point.position + kRadius_mm * (std::cos(angle) * a + std::sin(angle) * b)));
    }
    bone.points.push_back(place * (point.position - kDeep_mm * point.normal));
    normals.insert(normals.end(), 4, place.rotation * point.normal);
    for (const Triangle& t : {Triangle{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}}) {
      bone.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
  }

  // Apices stay in the bone when their outer sides are lifted off it.
  static bool IsApex(std::size_t vertex) { return vertex % 4 == 3; }

  DepthInput Input() const { return {bone, normals, dowels, network, {}, filled_from}; }
  DepthField Depth(const PopulationDepth& options = {}, int threads = 1) const {
    RunContext run;
    run.threads = threads;
    return InterpolateDepth(options, Input(), run);
  }
};

Similarity TurnedAndLarger() {
  Similarity place;
  place.scale = 1.08;
  place.rotation = Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  place.translation = Vec3(100, -50, 30);
  return place;
}

double MedianRatio(const DepthField& a, const DepthField& b) {
  std::vector<double> ratios;
  for (std::size_t v = 0; v < a.depth_mm.size(); ++v) {
    if (std::isfinite(a.depth_mm[v]) && std::isfinite(b.depth_mm[v])) {
      ratios.push_back(a.depth_mm[v] / b.depth_mm[v]);
    }
  }
  EXPECT_GT(ratios.size(), a.depth_mm.size() / 2);
  return UpperMedian(ratios);
}

TEST(CarryToSubject, FindsTheMeanBoneWhereItStands) {
  const Similarity place = TurnedAndLarger();
  const Person person(0, place);
  const std::vector<SubjectPoint> points =
      CarryToSubject(CarriedPeople(), person.Input(), RunContext{}).points;
  ASSERT_EQ(points.size(), CarriedPeople().bone.size());
  std::vector<double> off_mm;
  for (std::size_t i = 0; i < points.size(); ++i) {
    off_mm.push_back((points[i].on_skull - place * CarriedPeople().bone[i].position).norm());
    EXPECT_EQ(points[i].gap_mm, 0);
  }
  EXPECT_LT(UpperMedian(off_mm), 0.5);
}

TEST(CarryToSubject, FindsTheSitesOfTheTempleFromOtherLandmarks) {
  const Similarity place = TurnedAndLarger();
  const Person person(0, place);
  const std::map<std::string, Vec3> sites =
      CarryToSubject(CarriedPeople(), person.Input(), RunContext{}).sites;
  for (const char* const site : {"ut_l", "ut_r", "tf_l", "tf_r"}) {
    ASSERT_TRUE(sites.contains(site)) << site;
    EXPECT_LT((sites.at(site) - place * CarriedPeople().sites.at(site).position).norm(), 2) << site;
  }
}

TEST(PopulationDepth, APersonWithPeoplesMeanHasItEverywhereForEveryRange) {
  const Person person;
  const DepthField near = person.Depth({.range_mm = 5}), far = person.Depth({.range_mm = 80});
  std::vector<double> off;
  for (std::size_t i = 0; i < CarriedPeople().bone.size(); ++i) {
    const std::size_t v = 4 * i;  // a corner of its outer side
    if (near.status[v] == DepthStatus::kAssigned) {
      EXPECT_NEAR(near.depth_mm[v], far.depth_mm[v], 0.01 * far.depth_mm[v]);
      off.push_back(std::abs(std::log(near.depth_mm[v]) - CarriedPeople().bone[i].depth.mean));
    }
  }
  ASSERT_GT(off.size(), 1000U);
  EXPECT_LT(UpperMedian(off), 0.1);  // neighbouring points are averaged
}

TEST(PopulationDepth, AHeavierPersonIsThickerBetweenTheDowels) {
  const DepthField mean = Person().Depth(), heavy = Person(2).Depth(), thin = Person(-2).Depth();
  EXPECT_GT(MedianRatio(heavy, mean), 1.15);
  EXPECT_LT(MedianRatio(thin, mean), 0.87);
}

TEST(PopulationDepth, OneDeviatingDowelMovesItsPlaceAlmostToItsDepth) {
  Person person;
  const DepthField before = person.Depth();
  Dowel& zy = *std::ranges::find(person.dowels, "zy_l", &Dowel::site);
  std::size_t nearest = 0;
  for (std::size_t v = 0; v < person.bone.points.size(); ++v) {
    if ((person.bone.points[v] - zy.base).norm() < (person.bone.points[nearest] - zy.base).norm()) {
      nearest = v;
    }
  }
  zy.depth_mm *= 1.5;
  const DepthField after = person.Depth();
  const double moved = std::log(after.depth_mm[nearest] / before.depth_mm[nearest]);
  EXPECT_GT(moved, 0.5 * std::log(1.5));
  EXPECT_LT(moved, 1.1 * std::log(1.5));
  zy.sd_mm = 100;  // so uncertain that the others decide
  EXPECT_NEAR(person.Depth().depth_mm[nearest], before.depth_mm[nearest],
              0.15 * before.depth_mm[nearest]);
}

// Given the places, the logarithm of depth is linear in those of the dowels' depths.
TEST(PopulationDepth, TheEffectsOfTwoDowelsMultiply) {
  const auto depth = [](double zy, double go) {
    Person person;
    std::ranges::find(person.dowels, "zy_l", &Dowel::site)->depth_mm *= zy;
    std::ranges::find(person.dowels, "go_l", &Dowel::site)->depth_mm *= go;
    return person.Depth();
  };
  const DepthField none = depth(1, 1), zy = depth(1.3, 1), go = depth(1, 0.8),
                   both = depth(1.3, 0.8);
  int compared = 0;
  for (std::size_t v = 0; v < none.depth_mm.size(); ++v) {
    if (std::isfinite(none.sd_mm[v])) {  // where people alone decide
      const double product = zy.depth_mm[v] * go.depth_mm[v] / none.depth_mm[v];
      EXPECT_NEAR(both.depth_mm[v], product, 1e-9 * product);
      ++compared;
    }
  }
  EXPECT_GT(compared, 1000);
}

// The field is radial_basis's, and a note says why.
void ExpectFallback(const Person& person, const std::string& why) {
  const DepthField field = person.Depth();
  const DepthField other = InterpolateDepth(RadialBasis{.max_angle_deg = 90}, person.Input(), {});
  EXPECT_THAT(field.depth_mm, Pointwise(NanSensitiveDoubleEq(), other.depth_mm));
  ASSERT_EQ(field.shares.size(), 1U);
  EXPECT_EQ(field.shares[0].scheme, "radial_basis");
  EXPECT_THAT(field.notes, ElementsAre(HasSubstr(why)));
}

TEST(PopulationDepth, LandmarksAwayFromTheBoneLeaveItToRadialBasis) {
  Person person;
  for (Dowel& dowel : person.dowels) {
    dowel.base.y() += 40;
  }
  ExpectFallback(person, "points of people's facial bone");
}

TEST(PopulationDepth, FiveSitesLeaveItToRadialBasis) {
  Person person;
  person.dowels.resize(5);
  ExpectFallback(person, "5 dowels stand at sites whose depth in people is known");
}

TEST(PopulationDepth, SitesOfThePlaneInTheMiddleLeaveItToRadialBasis) {
  Person person;
  std::erase_if(person.dowels,
                [](const Dowel& dowel) { return dowel.site.find('_') != std::string::npos; });
  ASSERT_GE(person.dowels.size(), 6U);
  ExpectFallback(person, "almost in one plane");
}

// Fills a person's bone by a gap, for vertices that `here` accepts.
template <class Here>
Person Filled(const Person& bone, double gap_mm, Here here) {
  Person filled = bone;
  filled.filled_from = &bone.bone;
  for (std::size_t v = 0; v < filled.bone.points.size(); ++v) {
    filled.bone.points[v] += (here(v) && !Person::IsApex(v) ? gap_mm : 0) * filled.normals[v];
  }
  return filled;
}

TEST(PopulationDepth, TheGapOfAFilledSkullIsTakenOff) {
  constexpr double kGap_mm = 6;
  const Person bone;
  const auto in_fossa = [&](std::size_t v) {
    return std::abs(bone.bone.points[v].x()) > 45 && bone.bone.points[v].z() > 20 &&
           bone.bone.points[v].y() > -75;
  };
  const Person filled = Filled(bone, kGap_mm, in_fossa);
  const DepthField from_bone = bone.Depth(), from_shell = filled.Depth();
  std::vector<double> taken_off_mm;
  for (std::size_t v = 0; v < filled.bone.points.size(); ++v) {
    if (in_fossa(v) && !Person::IsApex(v) && from_bone.depth_mm[v] > 2 * kGap_mm) {
      taken_off_mm.push_back(from_bone.depth_mm[v] - from_shell.depth_mm[v]);
    }
  }
  ASSERT_GT(taken_off_mm.size(), 50U);
  EXPECT_NEAR(UpperMedian(taken_off_mm), kGap_mm, 1);
}

TEST(PopulationDepth, HalfOfTheDepthBetweenDowelsIsLeftWhereTheGapIsDeeperThanTheTissue) {
  const Person bone;
  const Person filled = Filled(bone, 9, [](std::size_t) { return true; });
  const DepthField field = filled.Depth();
  const DepthField between =
      InterpolateDepth(RadialBasis{.max_angle_deg = 90}, filled.Input(), RunContext{});
  int at_least = 0;
  for (std::size_t v = 0; v < field.depth_mm.size(); ++v) {
    EXPECT_FALSE(field.depth_mm[v] < 1) << field.depth_mm[v];  // NaN where the bone turns away
    at_least += std::abs(field.depth_mm[v] - between.depth_mm[v] / 2) < 1e-9;
  }
  EXPECT_GT(at_least, 20);
}

// The wall behind an opening lies deeper than any tissue would fill.
TEST(PopulationDepth, AHollowBehindTheFaceTakesNothingOff) {
  const Person person;
  Person open = person;
  const Vec3 cheek = CarriedPeople().sites.at("mio_l").position;
  const auto near = [&](std::size_t v) {
    return (person.bone.points[v / 4 * 4] - cheek).norm() < 12;
  };
  Person hollow = person;
  for (std::size_t v = 0; v < hollow.bone.points.size(); ++v) {
    hollow.bone.points[v] -= (near(v) ? 25 : 0) * hollow.normals[v];
  }
  open.filled_from = &hollow.bone;
  const DepthField with = open.Depth(), without = person.Depth();
  int compared = 0;
  for (std::size_t v = 0; v < with.depth_mm.size(); ++v) {
    if (near(v) && !Person::IsApex(v) && std::isfinite(with.depth_mm[v])) {
      EXPECT_NEAR(with.depth_mm[v], without.depth_mm[v], 0.35 * without.depth_mm[v]);
      ++compared;
    }
  }
  EXPECT_GT(compared, 20);
}

TEST(PopulationDepth, TurnsWithTheHeadAndGrowsNotWithIt) {
  Similarity turn = TurnedAndLarger();
  turn.scale = 1;
  const DepthField still = Person(1).Depth(), turned = Person(1, turn).Depth();
  for (std::size_t v = 0; v < still.depth_mm.size(); ++v) {
    ASSERT_EQ(still.status[v], turned.status[v]);
    if (std::isfinite(still.depth_mm[v])) {
      EXPECT_NEAR(still.depth_mm[v], turned.depth_mm[v], 1e-6);
    }
  }
}

TEST(PopulationDepth, HasTheSameBytesForAnyOrderOfDowelsAndAnyNumberOfThreads) {
  Person person(0.7);
  const DepthField one = person.Depth();
  std::ranges::reverse(person.dowels);
  const DepthField other = person.Depth({}, 3);
  for (std::size_t v = 0; v < one.depth_mm.size(); ++v) {
    EXPECT_TRUE(one.depth_mm[v] == other.depth_mm[v] ||
                (std::isnan(one.depth_mm[v]) && std::isnan(other.depth_mm[v])));
  }
}

TEST(PopulationDepth, StatesAnSdThatGrowsAwayFromTheDowels) {
  const DepthField field = Person().Depth();
  std::vector<double> shares;
  for (std::size_t v = 0; v < field.sd_mm.size(); ++v) {
    if (std::isfinite(field.sd_mm[v])) {
      shares.push_back(field.sd_mm[v] / field.depth_mm[v]);
      EXPECT_GT(shares.back(), 0);
    }
  }
  ASSERT_GT(shares.size(), 1000U);
  const auto [least, most] = std::ranges::minmax(shares);
  EXPECT_LT(least, 0.15);
  EXPECT_GT(most, 2 * least);
}

TEST(ReadPeople, NamesTheLineOfABadRow) {
  const auto error = [](const std::string& row) {
    try {
      ReadPeople(
          "site,x_mm,y_mm,z_mm,normal_x,normal_y,normal_z,log_mean,log_sd,loading\n"
          ",1,2,3,0,0,1,2,0.3,0.4\n" +
              row,
          "people.csv");
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string("no error");
  };
  EXPECT_EQ(error("g,1,2,3,0,0,1,2,0.3,0.4\n"), "no error");
  EXPECT_THAT(error(",1,2,3,0,0,1,2,0,0.4\n"), HasSubstr("people.csv:3: the normal must not be"));
  EXPECT_THAT(error(",1,2,3,0,0,1,2,0.3,1.4\n"), HasSubstr("people.csv:3"));
  EXPECT_THAT(error("g,1,2,3,0,0,1,2,0.3,0.4\ng,1,2,3,0,0,1,2,0.3,0.4\n"),
              HasSubstr("site g has a second row"));
}

}  // namespace
}  // namespace semblance::interp
