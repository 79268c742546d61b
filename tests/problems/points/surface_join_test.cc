// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/surface_join.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "problems/config/config.h"
#include "problems/points/point_fit.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/encoding.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline_files/hspline_json.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"
#include "tests/testing/splines.h"

namespace semblance {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::SmoothSurface;
using testing::WordsOf;

class SurfaceJoins : public ::testing::Test {
 protected:
  SurfaceJoins() {
    WriteHSpline(
        folder_ / "open.json",
        SmoothSurface({.patches_u = 4, .patches_v = 4, .max_level = 1}, /*random_seed=*/1));
    WriteHSpline(
        folder_ / "tube.json",
        SmoothSurface(
            {.patches_u = 4, .patches_v = 4, .max_level = 0, .closure = Closure::kPeriodicU},
            /*random_seed=*/1));
    WriteHSpline(
        folder_ / "torus.json",
        SmoothSurface(
            {.patches_u = 4, .patches_v = 4, .max_level = 0, .closure = Closure::kPeriodicUv},
            /*random_seed=*/1));
  }

  std::vector<OpenedJoin> Open(const std::string& name, SurfaceEdge edge, SurfaceEdge its_edge,
                               Closure closure = Closure::kOpen) {
    const SurfaceJoin join{.surface = folder_ / name, .edge = edge, .its_edge = its_edge};
    return OpenJoins(std::span(&join, 1), closure);
  }

  testing::ScratchFolder folder_;
};

TEST_F(SurfaceJoins, AreReadWithTheHashOfTheirFile) {
  const OpenedJoin opened = Open("open.json", SurfaceEdge::kU0, SurfaceEdge::kU1).at(0);
  EXPECT_EQ(opened.sha256, Sha256OfFile(folder_ / "open.json"));
  EXPECT_EQ(opened.surface.shape().patches_v, 4);
}

// The place at t, and the spans, as the new edge sees them.
TEST_F(SurfaceJoins, AReversedEdgeIsSeenFromItsEnd) {
  OpenedJoin opened = Open("open.json", SurfaceEdge::kU0, SurfaceEdge::kU1).at(0);
  opened.surface.SetOffsets({{{1, 10, 1}, Vec3(0, 0, 1)}});  // near v = 0
  const std::vector<EdgeSpan> spans = opened.ItsSpans();
  EXPECT_EQ(opened.ItsPlace(0.25), Vec2(1, 0.25));
  EXPECT_EQ(spans.front().level, 1);
  opened.join.reversed = true;
  EXPECT_EQ(opened.ItsPlace(0.25), Vec2(1, 0.75));
  double reached = 0;
  for (const EdgeSpan& span : opened.ItsSpans()) {
    EXPECT_EQ(span.Begin(4), reached);
    reached = span.End(4);
  }
  EXPECT_EQ(reached, 1);
  EXPECT_EQ(opened.ItsSpans().back().level, 1);
  EXPECT_EQ(opened.ItsSpans().front().level, 0);
}

TEST_F(SurfaceJoins, EdgesThatAreNoneAreRefused) {
  const auto refusal = [&](const std::string& name, SurfaceEdge edge, SurfaceEdge its_edge,
                           Closure closure) {
    return WordsOf<InputError>([&] { Open(name, edge, its_edge, closure); });
  };
  EXPECT_THAT(refusal("tube.json", SurfaceEdge::kU0, SurfaceEdge::kU1, Closure::kOpen),
              HasSubstr("tube.json goes round in u and has no border at u1"));
  EXPECT_THAT(refusal("tube.json", SurfaceEdge::kU0, SurfaceEdge::kV1, Closure::kOpen),
              HasSubstr("its edge v1 is closed and the new edge u0 is open"));
  EXPECT_THAT(refusal("open.json", SurfaceEdge::kV0, SurfaceEdge::kV1, Closure::kPeriodicU),
              HasSubstr("its edge v1 is open and the new edge v0 is closed"));
  for (const SurfaceEdge its_edge : {SurfaceEdge::kU0, SurfaceEdge::kV1}) {
    EXPECT_THAT(refusal("torus.json", SurfaceEdge::kV0, its_edge, Closure::kPeriodicU),
                HasSubstr("torus.json goes round both ways and has no border"));
  }
  EXPECT_EQ(Open("tube.json", SurfaceEdge::kV0, SurfaceEdge::kV1, Closure::kPeriodicU).size(), 1u);
  EXPECT_THAT(WordsOf<IoError>([&] { Open("none.json", SurfaceEdge::kU0, SurfaceEdge::kU1); }),
              HasSubstr("none.json"));
  WriteFileAtomically(folder_ / "mesh.ply", "ply\n");
  EXPECT_THAT(WordsOf<IoError>([&] { Open("mesh.ply", SurfaceEdge::kU0, SurfaceEdge::kU1); }),
              HasSubstr("mesh.ply: not an H-spline"));
}

TEST(SurfaceJoin, WhatIsWrongIsToldWhenTheFileIsRead) {
  const auto read = [](const std::string& text) {
    return WordsOf<ConfigError>([&] { ReadConfigText<PointFitOptions>(text, "x.yaml"); });
  };
  const std::string join = "joins: [{surface: a.json}]\n";
  EXPECT_THAT(read("joins: [{edge: u0}]\n"), HasSubstr("joins[0].surface: it names no file"));
  EXPECT_THAT(read("joins: [{surface: a.json}, {surface: b.json}]\n"),
              HasSubstr("joins[1].edge: u0 is joined already"));
  EXPECT_THAT(
      read("closure: periodic_u\n" + join),
      HasSubstr("joins[0].edge: a surface of this closure goes round in u and has no border at "
                "u0; give edge: v0 or v1"));
  EXPECT_THAT(read("closure: periodic_uv\n" + join), HasSubstr("goes round both ways"));
  for (const char* parameters : {"plane", "mesh"}) {
    EXPECT_THAT(read("parameters: " + std::string(parameters) + "\n" + join),
                AllOf(HasSubstr("joins: an edge of the new surface is where its points' own"),
                      HasSubstr("parameters: given")));
  }
  for (const char* fit :
       {"{plan: listed}", "{solver: ceres}", "{plan: {type: coarse_to_fine}}",
        "{plan: adaptive, relaxation: footpoint}", "{plan: adaptive, terms: [points, symmetry]}"}) {
    EXPECT_THAT(read("fit: " + std::string(fit) + "\n" + join),
                HasSubstr("joins: edges are held with fit.plan: auto or adaptive"))
        << fit;
  }
  EXPECT_THAT(read("joins: [{surface: a.json, edge: u2}]\n"), HasSubstr("joins[0].edge"));
}

TEST(SurfaceJoin, ConfigurationRoundTrips) {
  const auto options = ReadConfigText<PointFitOptions>(
      "joins: [{surface: /a.json, edge: v1, its_edge: v0, reversed: true, continuity: position}]\n",
      "x.yaml");
  const auto again = ReadConfigText<PointFitOptions>(WriteConfig(options), "x.yaml");
  ASSERT_EQ(again.joins.size(), 1u);
  EXPECT_EQ(again.joins[0].surface, "/a.json");
  EXPECT_EQ(again.joins[0].edge, SurfaceEdge::kV1);
  EXPECT_EQ(again.joins[0].its_edge, SurfaceEdge::kV0);
  EXPECT_TRUE(again.joins[0].reversed);
  EXPECT_EQ(again.joins[0].continuity, JoinContinuity::kPosition);
}

}  // namespace
}  // namespace semblance
