// SPDX-License-Identifier: GPL-3.0-or-later
// A correct face passes all checks, each kind of bad face fails the check that is meant for it, and
// the values agree with closed forms.
#include "problems/experiment/plausibility.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <numbers>

#include "problems/experiment/experiment_config.h"
#include "problems/run.h"
#include "surfaces/base/random.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance::problems {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// ---------------------------------------------------------------------------------------------
// A phantom's face, and ways to spoil it
// ---------------------------------------------------------------------------------------------

// All that JudgeFace reads, as values that a test may change.
struct Example {
  HSplineSurface surface, generic;
  TriMesh skull, shell;
  std::vector<Dowel> dowels;
  std::optional<SkullSites> pose;
  FitTarget target;
  FitResult fit;
  std::optional<Tessellation> face = {};  // none: that of the surface

  Plausibility Judge(int threads = 1, const PlausibilityLimits& limits = {}) const {
    RunContext context;
    context.threads = threads;
    const Tessellation own = face ? *face : Tessellate(surface, kFaceQuadsPerPatch);
    return JudgeFace({.surface = surface,
                      .face = own,
                      .generic = generic,
                      .skull = skull,
                      .origin = {},
                      .shell = shell,
                      .dowels = dowels,
                      .pose = pose,
                      .target = target,
                      .fit = fit},
                     limits, context);
  }
};

const RunResult& GoodRun() {
  static const RunResult run = Run(
      ReadConfig<Experiment>(SEMBLANCE_SOURCE_DIR "/configs/phantom.yaml",
                             std::vector<std::string>{"subject.rings=30", "implicit.resolution=24",
                                                      "template.max_level=2", "seeds.level=0",
                                                      "uncertainty.sigma=false"}),
      {});
  return run;
}

Example GoodExample() {
  const RunResult& run = GoodRun();
  return {.surface = run.fit.surface,
          .generic = run.placed.surface,
          .skull = run.subject.skull,
          .shell = run.shell,
          .dowels = run.subject.dowels_on_bone,
          .pose = run.subject.basis.sites,
          .target = run.target,
          .fit = run.fit};
}

PlausibilityCheck Find(const Plausibility& judged, std::string_view name) {
  const auto found = std::ranges::find(judged.checks, name, &PlausibilityCheck::name);
  EXPECT_NE(found, judged.checks.end()) << name;
  return *found;
}

// Moves all points of the face. Their normals follow from the map.
HSplineSurface Moved(const HSplineSurface& surface, const std::function<Vec3(const Vec3&)>& map) {
  HSplineSurface moved = surface;
  for (int level = 0; level <= surface.shape().max_level; ++level) {
    ControlNet net = surface.Net(level);
    for (Vec3& vertex : net.vertices) {
      vertex = map(vertex);
    }
    moved.SetNet(level, net);
  }
  return moved;
}

Vec3 HeadCentre(const Example& c) { return Bounds(c.skull).center(); }

struct Mistake {
  const char* name;
  std::string_view check;  // a check that must fail
  std::function<void(Example&)> make;
  bool has_place = true;
};

std::ostream& operator<<(std::ostream& out, const Mistake& mistake) { return out << mistake.name; }

void ScaleFace(Example& c, double factor) {
  const Vec3 centre = HeadCentre(c);
  c.surface = Moved(c.surface, [&](const Vec3& p) { return Vec3(centre + factor * (p - centre)); });
}

void ScaleDepths(Example& c, double factor) {
  for (Dowel& dowel : c.dowels) {
    dowel.depth_mm *= factor;
  }
}

void MoveFace(Example& c, const std::function<Vec3(const Vec3&)>& map) {
  c.surface = Moved(c.surface, map);
}

const std::vector<Mistake>& Mistakes() {
  static const std::vector<Mistake> mistakes = {
      {"TenTimesTooLarge", "template_factor", [](Example& c) { ScaleFace(c, 10); }},
      {"TenTimesLargerThanTheSkull", "skull_factor", [](Example& c) { ScaleFace(c, 10); }},
      {"TenTimesTooSmall", "template_factor", [](Example& c) { ScaleFace(c, 0.1); }},
      {"FaceAndTemplateTenTimesTooLarge", "skull_factor",
       [](Example& c) {
         ScaleFace(c, 10);
         c.generic = c.surface;
       }},
      {"WideAlongOneAxis", "template_factor",
       [](Example& c) {
         MoveFace(c, [](const Vec3& p) { return Vec3(2 * p.x(), p.y(), p.z()); });
       }},
      {"Flat", "template_factor",
       [](Example& c) { MoveFace(c, [](const Vec3& p) { return Vec3(p.x(), 0, p.z()); }); }},
      {"CrushedToAPoint", "template_factor",
       [](Example& c) {
         c.face = Tessellate(c.surface, kFaceQuadsPerPatch);
         std::ranges::fill(c.face->mesh.points, Vec3(1, 2, 3));
       },
       false},
      {"InsideTheHead", "bone_most_mm", [](Example& c) { ScaleFace(c, 0.8); }},
      {"UnderTheBone", "bone_share", [](Example& c) { ScaleFace(c, 0.93); }},
      {"FarAway", "marker_mm",
       [](Example& c) { MoveFace(c, [](const Vec3& p) { return Vec3(p + Vec3(0, -500, 0)); }); }},
      {"TurnedRound", "marker_mm",
       [](Example& c) {
         const Vec3 o = HeadCentre(c);
         MoveFace(c,
                  [o](const Vec3& p) { return Vec3(2 * o.x() - p.x(), 2 * o.y() - p.y(), p.z()); });
       }},
      {"Mirrored", "facing_share",
       [](Example& c) {
         const double x = HeadCentre(c).x();
         MoveFace(c, [x](const Vec3& p) { return Vec3(2 * x - p.x(), p.y(), p.z()); });
       }},
      {"MirroredWithItsSites", "facing_share",
       [](Example& c) {
         const double x = HeadCentre(c).x();
         MoveFace(c, [x](const Vec3& p) { return Vec3(2 * x - p.x(), p.y(), p.z()); });
         for (Vec2& uv : c.fit.uv) {
           uv.x() = 1 - uv.x();
         }
       }},
      {"LeftAndRightExchanged", "marker_mm",
       [](Example& c) {
         for (Vec2& uv : c.fit.uv) {
           uv.x() = 1 - uv.x();
         }
       }},
      {"Spikes", "crease_share",
       [](Example& c) {
         Random random(1);
         MoveFace(c, [&](const Vec3& p) { return Vec3(p + random.InBox(-20, 20)); });
       }},
      {"OneSpike", "crease_share",
       [](Example& c) {
         const int level = c.surface.shape().max_level;
         ControlNet net = c.surface.Net(level);
         net.At(net.columns / 2, net.rows / 2).y() -= 120;  // as steep as 60 mm at level 3
         c.surface.SetNet(level, net);
       }},
      {"ThroughItself", "crossing_share",
       [](Example& c) {
         MoveFace(c, [](const Vec3& p) {  // the left half is laid over the right one
           return p.x() < 0 ? p : Vec3(-p.x(), p.y() + 3 * std::sin(p.z() / 5), p.z());
         });
       }},
      {"NotANumber", "bone_share",
       [](Example& c) {
         c.face = Tessellate(c.surface, kFaceQuadsPerPatch);
         c.face->mesh.points[5].y() = kNaN;
       },
       false},
      {"StoppedEarly", "unsolved_share",
       [](Example& c) { c.fit.levels.back().termination = "no_convergence"; }, false},
      {"StepWithoutASolution", "unsolved_share",
       [](Example& c) { c.fit.levels.back().usable = false; }, false},
      {"HardlyAnyData", "undetermined_share",
       [](Example& c) {
         for (LevelSummary& level : c.fit.levels) {
           level.uncovered_vertices =
               static_cast<int>(c.surface.Net(level.level).vertices.size()) - 4;
         }
       }},
      {"DowelIntoTheHead", "direction_deg",
       [](Example& c) { c.dowels.front().direction = -c.dowels.front().direction; }},
      {"DowelSideways", "direction_deg",
       [](Example& c) {
         const Vec3 along = c.dowels.front().direction;
         c.dowels.front().direction =
             (along.unitOrthogonal() - 0.6 * along).normalized();  // 121 degrees
       }},
      {"DirectionIsNotANumber", "direction_deg",
       [](Example& c) { c.dowels.front().direction = Vec3::Constant(kNaN); }},
      {"DepthsInCm", "depth_factor", [](Example& c) { ScaleDepths(c, 0.1); }, false},
      {"DepthsInInches", "depth_factor", [](Example& c) { ScaleDepths(c, 1 / 25.4); }, false},
      {"DepthsInMetres", "depth_factor", [](Example& c) { ScaleDepths(c, 0.001); }, false},
      {"DepthsTenTimesTooLarge", "depth_factor", [](Example& c) { ScaleDepths(c, 10); }, false},
      {"DepthsOfOtherRows", "depth_scatter",
       [](Example& c) {
         std::vector<double> depths;
         for (const Dowel& dowel : c.dowels) {
           depths.push_back(dowel.depth_mm);
         }
         std::ranges::rotate(depths, depths.begin() + 5);
         for (std::size_t k = 0; k < depths.size(); ++k) {
           c.dowels[k].depth_mm = depths[k];
         }
       },
       false},
      {"OneDepthForAll", "depth_scatter",
       [](Example& c) {
         for (Dowel& dowel : c.dowels) {
           dowel.depth_mm = 9;
         }
       },
       false},
      {"OneDepthOfAnotherSite", "depth_sds",
       [](Example& c) { std::ranges::find(c.dowels, "g", &Dowel::site)->depth_mm = 25; }}};
  return mistakes;
}

// ---------------------------------------------------------------------------------------------
// Correct faces and mistakes
// ---------------------------------------------------------------------------------------------

TEST(Plausibility, ACorrectFacePassesAndEachCheckWasJudged) {
  EXPECT_THAT(GoodRun().plausibility.Faults(), IsEmpty());
  const Plausibility judged = GoodExample().Judge();
  EXPECT_THAT(judged.Faults(), IsEmpty());
  for (const PlausibilityCheck& check : judged.checks) {
    EXPECT_TRUE(check.passed) << check.name;
    EXPECT_TRUE(std::isfinite(check.value)) << check.name << ": " << check.sentence;
    EXPECT_LE(check.value, check.limit) << check.name;
  }
}

// The phantoms' formula makes depths that no person has.
TEST(Plausibility, APhantomsDepthsAreNotComparedWithThoseOfPeople) {
  for (const char* name : {"depth_sds", "depth_factor", "depth_scatter"}) {
    const PlausibilityCheck check = Find(GoodRun().plausibility, name);
    EXPECT_TRUE(std::isnan(check.value)) << name;
    EXPECT_THAT(check.sentence, HasSubstr("a phantom's depths are not those of people"));
  }
}

TEST(Plausibility, AFaceThatWasNotJudgedIsNotUsable) {
  EXPECT_THAT(Plausibility().Faults(), ::testing::ElementsAre("the face was not judged"));
}

class PlausibilityOfMistakes : public ::testing::TestWithParam<Mistake> {};

TEST_P(PlausibilityOfMistakes, IsFoundExplainedAndPlaced) {
  Example c = GoodExample();
  GetParam().make(c);
  const Plausibility judged = c.Judge();
  const PlausibilityCheck check = Find(judged, GetParam().check);
  EXPECT_FALSE(check.passed) << check.sentence;
  EXPECT_THAT(judged.Faults(), Contains(HasSubstr(check.sentence)));
  EXPECT_EQ(check.worst.allFinite(), GetParam().has_place) << check.sentence;
}

INSTANTIATE_TEST_SUITE_P(All, PlausibilityOfMistakes, ::testing::ValuesIn(Mistakes()),
                         [](const auto& mistake) { return std::string(mistake.param.name); });

TEST(Plausibility, TheUnitOfDepthsIsNamed) {
  for (const auto& [factor, words] :
       {std::pair(0.1, "multiply them by 10"), std::pair(1 / 25.4, "multiply them by 25.4"),
        std::pair(0.001, "multiply them by 1000"), std::pair(10.0, "divide them by 10")}) {
    Example c = GoodExample();
    ScaleDepths(c, factor);
    EXPECT_THAT(c.Judge().Faults(), Contains(HasSubstr(words))) << factor;
  }
}

// The spike of one control vertex is marked where it is.
TEST(Plausibility, ASpikeIsMarkedAtItsPlace) {
  Example c = GoodExample();
  const int level = c.surface.shape().max_level;
  ControlNet net = c.surface.Net(level);
  const VertexId vertex{level, net.columns / 3, net.rows / 2};
  net.At(vertex.i, vertex.j) += 60 * c.surface.Normal(c.surface.GrevillePoint(vertex));
  c.surface.SetNet(level, net);
  const Vec3 top = c.surface.Point(c.surface.GrevillePoint(vertex));
  const PlausibilityCheck check = Find(c.Judge(), "crease_share");
  EXPECT_FALSE(check.passed) << check.value;
  EXPECT_LT((check.worst - top).norm(), 40);
}

// ---------------------------------------------------------------------------------------------
// Laws
// ---------------------------------------------------------------------------------------------

TEST(Plausibility, DoesNotDependOnTheThreads) {
  Example c = GoodExample();
  ScaleFace(c, 0.97);
  EXPECT_EQ(PlausibilityToJson(c.Judge(1)).dump(), PlausibilityToJson(c.Judge(3)).dump());
}

TEST(Plausibility, TurnsWithTheSubject) {
  const Example c = GoodExample();
  const Similarity turn{.scale = 1,
                        .rotation = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).matrix(),
                        .translation = Vec3(100, -50, 20)};
  Example turned = c;
  turned.surface = Moved(c.surface, [&](const Vec3& p) { return turn * p; });
  turned.generic = Moved(c.generic, [&](const Vec3& p) { return turn * p; });
  turned.skull = Transformed(c.skull, turn);
  turned.shell = Transformed(c.shell, turn);
  for (Dowel& dowel : turned.dowels) {
    dowel.base = turn * dowel.base;
    dowel.direction = turn.rotation * dowel.direction;
  }
  for (FitPoint& point : turned.target.points) {
    point.position = turn * point.position;
  }
  Similarity& pose = turned.pose->skull_from_average;
  pose.translation = turn * pose.translation;
  pose.rotation = turn.rotation * pose.rotation;
  for (auto& [site, point] : turned.pose->points) {
    point = turn * point;
  }
  const Plausibility before = c.Judge(), after = turned.Judge();
  for (std::size_t k = 0; k < before.checks.size(); ++k) {
    EXPECT_NEAR(before.checks[k].value, after.checks[k].value, 1e-3) << before.checks[k].name;
  }
}

TEST(Plausibility, LimitsAreOptions) {
  const Example c = GoodExample();
  PlausibilityLimits none;
  none.direction_deg = none.marker_mm = 0;
  const Plausibility judged = c.Judge(1, none);
  EXPECT_FALSE(Find(judged, "direction_deg").passed);
  EXPECT_FALSE(Find(judged, "marker_mm").passed);
  EXPECT_EQ(judged.Faults().size(), 2u);
}

// A ball, or the front half of one.
Tessellation Ball(double radius_mm, bool half) {
  constexpr int kColumns = 120, kRows = 60;
  Tessellation ball;
  for (int j = 0; j <= kRows; ++j) {
    for (int i = 0; i <= kColumns; ++i) {
      const double turn = std::numbers::pi * (half ? 1 : 2) * i / kColumns,
                   rise = std::numbers::pi * (0.02 + 0.96 * j / kRows);
      ball.normals.emplace_back(std::sin(rise) * std::cos(turn), -std::sin(rise) * std::sin(turn),
                                -std::cos(rise));
      ball.mesh.points.push_back(radius_mm * ball.normals.back());
      ball.uv.emplace_back(i / double{kColumns}, j / double{kRows});
    }
  }
  for (int j = 0; j < kRows; ++j) {
    for (int i = 0; i < kColumns; ++i) {
      const int a = i + (kColumns + 1) * j, b = a + 1, c = a + kColumns + 1, d = c + 1;
      ball.mesh.triangles.push_back({a, d, b});
      ball.mesh.triangles.push_back({a, c, d});
    }
  }
  return ball;
}

// Bone on a ball of 80 mm lies 80 - r outside a face on a ball of r mm.
TEST(Plausibility, BoneOutsideABallHasItsClosedForm) {
  const Example c = GoodExample();
  const TriMesh skull = Ball(80, false).mesh;
  for (const double radius_mm : {70.0, 79.0, 79.8, 90.0}) {
    const Tessellation face = Ball(radius_mm, true);
    const Plausibility judged = JudgeFace({.surface = c.surface,
                                           .face = face,
                                           .generic = c.generic,
                                           .skull = skull,
                                           .origin = {},
                                           .shell = skull,
                                           .dowels = {},
                                           .pose = {},
                                           .target = {.points = {}},
                                           .fit = {.surface = c.surface}},
                                          {}, {});
    const double outside_mm = std::max(0.0, 80 - radius_mm);
    EXPECT_NEAR(Find(judged, "bone_most_mm").value, outside_mm, 0.15) << radius_mm;
    EXPECT_NEAR(Find(judged, "bone_share").value, outside_mm > 0.5 ? 1 : 0, 1e-9) << radius_mm;
    EXPECT_EQ(Find(judged, "crossing_share").value, 0);
    EXPECT_EQ(Find(judged, "crease_share").value, 0);
  }
}

// ---------------------------------------------------------------------------------------------
// Results
// ---------------------------------------------------------------------------------------------

TEST(Plausibility, MarksOfTheViewAreTheFaultsWithTheirPlaces) {
  Example c = GoodExample();
  EXPECT_EQ(FaultMarks(PlausibilityToJson(c.Judge())), nlohmann::ordered_json::array());
  EXPECT_EQ(FaultMarks(nullptr), nlohmann::ordered_json::array());
  c.dowels.front().direction *= -1;
  const auto marks = FaultMarks(PlausibilityToJson(c.Judge()));
  ASSERT_EQ(marks.size(), 1u);
  EXPECT_THAT(marks[0].at("text").get<std::string>(),
              AllOf(HasSubstr(c.dowels.front().site), HasSubstr("degrees off")));
  EXPECT_THAT(marks[0].at("fault").get<std::string>(), HasSubstr("limit"));
  const Vec3& base = c.dowels.front().base;
  EXPECT_EQ(marks[0].at("place"), nlohmann::ordered_json({base.x(), base.y(), base.z()}));
}

}  // namespace
}  // namespace semblance::problems
