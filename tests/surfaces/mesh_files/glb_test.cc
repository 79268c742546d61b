// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh_files/glb.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "surfaces/base/error.h"

namespace semblance::surfaces {
namespace {

using Json = nlohmann::json;

GlbPart Triangle1(const std::string& material) {
  return {.material = {.name = material, .colour = {1, 0.5, 0}},
          .points = {{0, 0, 0}, {1000, 0, 0}, {0, 2000, 3000}},
          .normals = {{0, -2, 0}, {0, 0, 0}, {1, 0, 0}},
          .triangles = {{0, 1, 2}}};
}

struct ReadGlb {
  Json json;
  std::string binary;
};

template <class T>
T At(const std::string& bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof(T));
  return value;
}

ReadGlb Parse(const std::string& glb) {
  EXPECT_EQ(glb.substr(0, 4), "glTF");
  EXPECT_EQ(At<std::uint32_t>(glb, 8), glb.size());
  const std::size_t length = At<std::uint32_t>(glb, 12);
  return {Json::parse(glb.substr(20, length)), glb.substr(28 + length)};
}

// The numbers of an accessor, of type T.
template <class T>
std::vector<T> Numbers(const ReadGlb& read, const Json& accessor) {
  const Json& a = read.json["accessors"][accessor.get<int>()];
  const Json& view = read.json["bufferViews"][a["bufferView"].get<int>()];
  std::vector<T> numbers(view["byteLength"].get<std::size_t>() / sizeof(T));
  std::memcpy(numbers.data(), read.binary.data() + view["byteOffset"].get<std::size_t>(),
              numbers.size() * sizeof(T));
  return numbers;
}

TEST(Glb, NodesHaveTheirNamesAndMaterials) {
  const std::vector<GlbNode> nodes = {
      {.name = "skull", .parts = {Triangle1("bone")}},
      {.name = "dowels",
       .children = {{.name = "dowel g", .parts = {Triangle1("rod")}},
                    {.name = "dowel \"n\"", .parts = {Triangle1("rod")}}}}};
  const Json json = Parse(EncodeGlb(nodes)).json;
  EXPECT_EQ(json["scenes"][0]["nodes"], Json({0, 1}));
  EXPECT_EQ(json["nodes"][1]["children"], Json({2, 3}));
  EXPECT_FALSE(json["nodes"][1].contains("mesh"));
  EXPECT_EQ(json["nodes"][3]["name"], "dowel \"n\"");
  EXPECT_EQ(json["meshes"][json["nodes"][0]["mesh"].get<int>()]["name"], "skull");
  ASSERT_EQ(json["materials"].size(), 2u);  // the rods share one
  EXPECT_EQ(json["materials"][1]["name"], "rod");
}

TEST(Glb, PointsAreInMetresWithTheFaceTowardsZ) {
  const GlbNode node{.name = "n", .parts = {Triangle1("m")}};
  const ReadGlb read = Parse(EncodeGlb({&node, 1}));
  const Json& attributes = read.json["meshes"][0]["primitives"][0]["attributes"];
  EXPECT_EQ(Numbers<float>(read, attributes["POSITION"]),
            (std::vector<float>{0, 0, 0, 1, 0, 0, 0, 3, -2}));
  // Of length one; where there is none, forwards.
  EXPECT_EQ(Numbers<float>(read, attributes["NORMAL"]),
            (std::vector<float>{0, 0, 1, 0, 0, 1, 1, 0, 0}));
  const Json& position = read.json["accessors"][attributes["POSITION"].get<int>()];
  EXPECT_EQ(position["min"], Json({0.0, 0.0, -2.0}));
  EXPECT_EQ(position["max"], Json({1.0, 3.0, 0.0}));
}

TEST(Glb, ColoursAreLinear) {
  GlbNode node{.name = "n", .parts = {Triangle1("m")}};
  node.parts[0].colours = {{0, 128, 255}, {10, 20, 30}, {0, 0, 0}};
  const ReadGlb read = Parse(EncodeGlb({&node, 1}));
  const Json& colour = read.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"];
  EXPECT_EQ(read.json["accessors"][colour.get<int>()]["normalized"], true);
  const auto shorts = Numbers<std::uint16_t>(read, colour);
  ASSERT_EQ(shorts.size(), 12u);
  EXPECT_EQ(shorts[0], 0);
  EXPECT_NEAR(shorts[1] / 65535.0, 0.2158605, 1e-5);  // of 128, IEC 61966-2-1
  EXPECT_EQ(shorts[2], 65535);
  EXPECT_EQ(shorts[3], 65535);
  EXPECT_NEAR(shorts[4] / 65535.0, 10 / 255.0 / 12.92, 1e-5);
}

TEST(Glb, ATextureSaysWhatItIs) {
  GlbNode node{.name = "n", .parts = {Triangle1("png"), Triangle1("jpeg")}};
  node.parts[0].material.texture = "\x89PNG\r\n\x1a\npixels";
  node.parts[1].material.texture = "\xff\xd8\xffpixels";
  const Json images = Parse(EncodeGlb({&node, 1})).json["images"];
  EXPECT_EQ(images[0]["mimeType"], "image/png");
  EXPECT_EQ(images[1]["mimeType"], "image/jpeg");
}

TEST(Glb, WhatGlTfCannotHoldIsRefused) {
  const auto refuses = [](GlbPart part) {
    const GlbNode node{.name = "n", .parts = {std::move(part)}};
    EXPECT_THROW(EncodeGlb({&node, 1}), InputError);
  };
  GlbPart part = Triangle1("m");
  part.triangles.clear();
  refuses(part);
  part = Triangle1("m");
  part.normals.pop_back();
  refuses(part);
  part = Triangle1("m");
  part.colours = {{1, 2, 3}};
  refuses(part);
  for (const char* texture : {"not a picture", "\x89PNG", "\xff\xd8", "RIFF    WEBP"}) {
    part = Triangle1("m");
    part.material.texture = texture;
    refuses(part);
  }
}

// The place in the scene of a point of the node's own frame after the turn of key `k`.
Eigen::Vector3f Turned(const std::vector<float>& rotations, std::size_t k,
                       const Eigen::Vector3f& p) {
  const Eigen::Quaternionf q(rotations[4 * k + 3], rotations[4 * k], rotations[4 * k + 1],
                             rotations[4 * k + 2]);
  return q * p;
}

TEST(Glb, ATurningNodeHasOneTurnAboutTheVerticalAxis) {
  const GlbNode still{.name = "s", .parts = {Triangle1("m")}, .offset_mm = {-100, -200, -300}};
  const std::vector<GlbNode> nodes = {
      {.name = "a", .children = {still}, .turn_s = 6},
      {.name = "b", .children = {still}, .offset_mm = {500, 0, 0}, .turn_s = 6}};
  const ReadGlb read = Parse(EncodeGlb(nodes));
  EXPECT_EQ(read.json["nodes"][1]["translation"], Json({-0.1f, -0.3f, 0.2f}));
  ASSERT_EQ(read.json["animations"].size(), 1u);
  const Json& animation = read.json["animations"][0];
  ASSERT_EQ(animation["channels"].size(), 2u);
  for (std::size_t c = 0; c < 2; ++c) {
    const Json& channel = animation["channels"][c];
    EXPECT_EQ(channel["target"]["path"], "rotation");
    EXPECT_EQ(channel["target"]["node"], c == 0 ? 0 : 2);
    const Json& sampler = animation["samplers"][channel["sampler"].get<int>()];
    EXPECT_EQ(sampler["interpolation"], "LINEAR");
    const auto times = Numbers<float>(read, sampler["input"]);
    const auto rotations = Numbers<float>(read, sampler["output"]);
    const Json& input = read.json["accessors"][sampler["input"].get<int>()];
    EXPECT_EQ(input["type"], "SCALAR");
    EXPECT_EQ(input["min"][0], 0);
    EXPECT_EQ(input["max"][0], 6);
    EXPECT_EQ(read.json["accessors"][sampler["output"].get<int>()]["type"], "VEC4");
    ASSERT_EQ(rotations.size(), 4 * times.size());
    EXPECT_EQ(times.front(), 0);
    EXPECT_EQ(times.back(), 6);
    for (std::size_t k = 0; k < times.size(); ++k) {
      const float* const q = &rotations[4 * k];
      EXPECT_NEAR(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3], 1, 1e-6);
      EXPECT_EQ(q[0], 0);
      EXPECT_EQ(q[2], 0);
      if (k > 0) {
        EXPECT_GT(times[k], times[k - 1]);
        // Less than half a turn from key to key, on the same half of the sphere.
        EXPECT_GT(q[1] * q[-3] + q[3] * q[-1], 0.5);
      }
    }
    // After a quarter the subject's left (+x) is at the front (+z); after all, where it was.
    const std::size_t quarter = (times.size() - 1) / 4;
    EXPECT_NEAR((Turned(rotations, quarter, {1, 0, 0}) - Eigen::Vector3f(0, 0, 1)).norm(), 0, 1e-6);
    EXPECT_NEAR((Turned(rotations, times.size() - 1, {1, 2, 3}) - Eigen::Vector3f(1, 2, 3)).norm(),
                0, 1e-5);
  }
}

TEST(Glb, WithoutATurnThereIsNoAnimation) {
  const GlbNode node{.name = "n", .parts = {Triangle1("m")}};
  EXPECT_FALSE(Parse(EncodeGlb({&node, 1})).json.contains("animations"));
}

TEST(Glb, ATurnTakesTime) {
  const GlbNode node{.name = "n", .parts = {Triangle1("m")}, .turn_s = 0};
  EXPECT_THROW(EncodeGlb({&node, 1}), InputError);
}

}  // namespace
}  // namespace semblance::surfaces
