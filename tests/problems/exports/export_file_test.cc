// SPDX-License-Identifier: GPL-3.0-or-later
// `semblance export` on the folder of a run and on its meshes, read back.
#include "problems/exports/export_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <pugixml.hpp>

#include "problems/pipeline/experiment_config.h"
#include "problems/report/run_folder.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/base64.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "surfaces/mesh_files/read_ply.h"
#include "tests/testing/scratch_folder.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
using Json = nlohmann::json;

class ExportFile : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    scratch_ = new testing::ScratchFolder;
    const std::vector<std::string> overrides = {
        "subject.rings=40", "implicit.resolution=30", "seeds.level=0",
        "first_fit=[]",     "template.max_level=1",   "fit.plan.schedule=[{level: 0, fraction: 1}]",
    };
    const auto experiment =
        ReadConfig<Experiment>(SEMBLANCE_SOURCE_DIR "/configs/phantom.yaml", overrides);
    OutputFolder folder(Run_(), WhenNotEmpty::kRefuse);
    WriteRun(experiment, semblance::Run(experiment, {}), folder, {});
  }
  static void TearDownTestSuite() { delete scratch_; }
  static fs::path Run_() { return *scratch_ / "run"; }

  static std::string Export(const std::string& from, const std::string& extension) {
    return ExportedBytes(Run_() / from, {.extension = extension, .chord_mm = {}, .threads = 1});
  }

  static testing::ScratchFolder* scratch_;
};
testing::ScratchFolder* ExportFile::scratch_ = nullptr;

std::vector<double> Values(const pugi::xml_document& document, const std::string& name) {
  const std::string path = "//PointData/DataArray[@Name='" + name + "']";
  std::string text = document.select_node(path.c_str()).node().text().as_string();
  std::erase(text, '\n');
  const std::string bytes = FromBase64(text);
  std::vector<double> values(bytes.size() / 8);
  std::memcpy(values.data(), bytes.data(), bytes.size());
  return {values.begin() + 1, values.end()};
}

TEST_F(ExportFile, AVtpCarriesEveryValueOfTheRunsPly) {
  const std::string ply = ReadFileBytes(Run_() / "face.ply");
  const MeshAttributes carried = ReadPlyAttributes(ply, "face.ply");
  EXPECT_EQ(carried.scalars.size(), 4u);  // quality, error, origin, sigma
  EXPECT_EQ(carried.colors.size(), ReadPly(ply, "face.ply").points.size());
  pugi::xml_document document;
  ASSERT_TRUE(document.load_string(Export("face.ply", ".vtp").c_str()));
  for (const char* name : {"error_mm", "origin", "sigma_mm"}) {
    const std::vector<double> in_ply = PlyVertexScalar(ply, std::string("scalar_") + name, "ply");
    const std::vector<double> in_vtp = Values(document, name);
    ASSERT_EQ(in_vtp.size(), in_ply.size()) << name;
    for (std::size_t v = 0; v < in_ply.size(); ++v) {
      ASSERT_TRUE(in_vtp[v] == in_ply[v] || (std::isnan(in_vtp[v]) && std::isnan(in_ply[v])))
          << name << " " << v;
    }
  }
  EXPECT_FALSE(document.select_node("//DataArray[@Name='quality']"));
}

TEST_F(ExportFile, ARunBecomesAGlbWithSkullFaceAndDowels) {
  const std::string glb = Export("", ".GLB");
  std::uint32_t length = 0;
  std::memcpy(&length, glb.data() + 12, 4);
  const Json json = Json::parse(glb.substr(20, length));
  std::vector<std::string> top, dowels;
  for (const Json& node : json["scenes"][0]["nodes"]) {
    top.push_back(json["nodes"][node.get<int>()]["name"]);
  }
  EXPECT_EQ(top, (std::vector<std::string>{"skull", "face", "dowels"}));
  for (const Json& node : json["nodes"][2]["children"]) {
    dowels.push_back(json["nodes"][node.get<int>()]["name"]);
  }
  EXPECT_THAT(dowels, AllOf(Contains("dowel g"), Contains("dowel go_l")));
  const TriMesh face = ReadMesh(Run_() / "face.ply");
  const Json& primitive = json["meshes"][1]["primitives"][0];
  EXPECT_EQ(json["accessors"][primitive["attributes"]["COLOR_0"].get<int>()]["count"],
            face.points.size());
  EXPECT_EQ(json["accessors"][primitive["indices"].get<int>()]["count"], 3 * face.triangles.size());
}

TEST_F(ExportFile, AMeshGoesToEveryFormatOfMeshes) {
  const TriMesh face = ReadMesh(Run_() / "face.ply");
  for (const char* extension : {".obj", ".off", ".stl", ".ply"}) {
    const fs::path file = *scratch_ / (std::string("face") + extension);
    WriteFileAtomically(file, Export("face.ply", extension));
    EXPECT_EQ(ReadMesh(file).triangles.size(), face.triangles.size()) << extension;
  }
  // A PLY keeps what it carries, though in an order of its own.
  const MeshAttributes before = ReadPlyAttributes(ReadFileBytes(Run_() / "face.ply"), "face.ply");
  const MeshAttributes after = ReadPlyAttributes(Export("face.ply", ".ply"), "face.ply");
  EXPECT_EQ(after.colors, before.colors);
  ASSERT_EQ(after.scalars.size(), before.scalars.size());
  EXPECT_EQ(after.scalars[2].name, before.scalars[2].name);
  EXPECT_EQ(after.scalars[2].values, before.scalars[2].values);
}

TEST_F(ExportFile, WhatDoesNotGoTogetherIsRefusedWithWhatDoes) {
  EXPECT_THAT([] { Export("", ".vtp"); }, ThrowsMessage<InputError>(HasSubstr("face.ply")));
  EXPECT_THAT([] { Export("face.ply", ".step"); }, ThrowsMessage<InputError>(HasSubstr(".vtp")));
  EXPECT_THAT([] { Export("pictures", ".glb"); },
              ThrowsMessage<IoError>(HasSubstr("semblance run")));
  EXPECT_THAT(
      [] {
        ExportedBytes(Run_() / "face.ply", {.extension = ".glb", .chord_mm = 1, .threads = 1});
      },
      ThrowsMessage<InputError>(HasSubstr("--chord_mm")));
}

}  // namespace
}  // namespace semblance
