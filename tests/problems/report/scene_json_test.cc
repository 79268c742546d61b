// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/scene_json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "problems/experiment/experiment_config.h"
#include "problems/report/view/view_mesh.h"
#include "problems/run.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline_query/tessellate.h"
#include "surfaces/mesh/mesh_query.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

using Json = nlohmann::ordered_json;
using testing::WordsOf;

// An independent implementation of RFC 4648.
std::string FromBase64(const std::string& text) {
  std::string bytes;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    if (c == '=') {
      break;
    }
    const int digit = c >= 'a'   ? c - 'a' + 26
                      : c >= 'A' ? c - 'A'
                      : c == '+' ? 62
                      : c == '/' ? 63
                                 : c - '0' + 52;
    bits = bits << 6 | static_cast<std::uint32_t>(digit);
    count += 6;
    if (count >= 8) {
      count -= 8;
      bytes += static_cast<char>(bits >> count & 0xFF);
    }
  }
  return bytes;
}

int Word(const std::string& bytes, std::size_t n) {
  return static_cast<unsigned char>(bytes[2 * n]) | static_cast<unsigned char>(bytes[2 * n + 1])
                                                        << 8;
}

TEST(SceneBlobs, PointsAreWithinHalfAStepAndTrianglesAreKept) {
  const TriMesh mesh = {{{0, 0, 0}, {100, 1, 2}, {3, 50.4321, 5}, {-7, -8, 9.87}},
                        {{0, 1, 2}, {2, 3, 0}}};
  SceneBlobs blobs;
  const Json blob = blobs.All().empty() ? Json(blobs.AddMesh(mesh)) : Json();
  const Json& made = blobs.All().at(blob.get<std::string>());
  const std::string points = FromBase64(made["points"]), triangles = FromBase64(made["triangles"]);
  ASSERT_EQ(points.size(), 2 * 3 * mesh.points.size());
  const double step = made["step"];
  EXPECT_LE(step, 107.0 / 65535 + 1e-12);
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      const double low = made["low"][axis];
      EXPECT_NEAR(low + step * Word(points, 3 * v + axis), mesh.points[v][axis], 0.5 * step + 1e-9);
    }
  }
  for (std::size_t k = 0; k < 6; ++k) {
    EXPECT_EQ(Word(triangles, k), mesh.triangles[k / 3][k % 3]);
  }
}

TEST(SceneBlobs, ValuesAreHundredthsAndNaNIsItsOwnCode) {
  SceneBlobs blobs;
  const std::string name = blobs.AddValues(std::vector<double>{1.234, -0.5, kNaN, 1e9});
  const std::string bytes = FromBase64(blobs.All().at(name)["values"]);
  const auto at = [&](std::size_t n) { return static_cast<std::int16_t>(Word(bytes, n)); };
  EXPECT_EQ(at(0), 123);
  EXPECT_EQ(at(1), -50);
  EXPECT_EQ(at(2), -32768);
  EXPECT_EQ(at(3), 32000);
}

TEST(SceneBlobs, EqualGeometryIsStoredOnce) {
  SceneBlobs blobs;
  const TriMesh mesh = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}};
  EXPECT_EQ(blobs.AddMesh(mesh), blobs.AddMesh(mesh));
  EXPECT_EQ(blobs.All().size(), 1u);
}

TEST(SceneJson, TheFaceLiesOnTheSurface) {
  const std::vector<std::string> overrides = {"subject.rings=20",
                                              "implicit.resolution=16",
                                              "uncertainty.sigma=false",
                                              "seeds.level=0",
                                              "rounds=1",
                                              "template.max_level=1",
                                              "fit.plan.schedule=[{level: 0, fraction: 1}]"};
  const RunResult run = problems::Run(
      ReadConfig<Experiment>(SEMBLANCE_SOURCE_DIR "/configs/phantom.yaml", overrides), {});
  const Json scene = Json::parse(SceneJson(run, {}));
  const auto layer =
      std::ranges::find_if(scene["layers"], [](const Json& of) { return of["id"] == "face"; });
  ASSERT_NE(layer, scene["layers"].end());
  const TriMesh shown = DecodeMeshBlob(scene["blobs"][(*layer)["mesh"].get<std::string>()]);
  const TriMesh fine = Tessellate(run.fit.surface, 40).mesh;
  const MeshQuery of_shown(shown), of_fine(fine);
  for (const Vec3& p : shown.points) {
    EXPECT_LT(of_fine.Closest(p).distance_mm, 0.02);
  }
  for (const Vec3& p : fine.points) {
    EXPECT_LT(of_shown.Closest(p).distance_mm, 0.26);
  }
}

std::string Scene(const std::string& blob, std::size_t size) {
  return Json({{"label", "x"},
               {"layers", Json::array()},
               {"blobs", {{blob, {{"points", std::string(size, 'A')}}}}}})
      .dump();
}

TEST(CollectScenes, SharesBlobsAndStopsAtTheLimit) {
  const SceneCollection all = CollectScenes(
      {{"a", Scene("k", 1000)}, {"b", Scene("k", 1000)}, {"c", Scene("l", 1000)}}, 1500);
  EXPECT_EQ(all.count, 2);  // the third would bring a second blob
  const Json json = Json::parse(all.json);
  EXPECT_EQ(json["blobs"].size(), 1u);
  EXPECT_EQ(json["scenes"][1]["label"], "b");
  EXPECT_FALSE(json["scenes"][0].contains("blobs"));
  EXPECT_EQ(CollectScenes({{"a", Scene("k", 1000)}}, 0).count, 1);
}

TEST(CollectScenes, CollectSceneAgreesWithCollectScenes) {
  EXPECT_EQ(CollectScene("a", Json::parse(Scene("k", 1000))),
            CollectScenes({{"a", Scene("k", 1000)}}, 0).json);
}

TEST(CollectScenes, RefusesAnInvalidScene) {
  EXPECT_THAT(WordsOf<IoError>([] {
                CollectScenes({{"a", "{}"}}, 1);
              }),
              ::testing::HasSubstr("not the scene of a run"));
  EXPECT_THAT(WordsOf<IoError>([] {
                CollectScenes({{"a", "nonsense"}}, 1);
              }),
              ::testing::HasSubstr("not the scene of a run"));
}

}  // namespace
}  // namespace semblance::problems
