// SPDX-License-Identifier: GPL-3.0-or-later
// `semblance export` on the folder of a run and on its meshes, read back.
#include "problems/report/export_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <pugixml.hpp>

#include "problems/experiment/experiment_config.h"
#include "problems/report/run_folder.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/encoding.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline_files/hspline_json.h"
#include "surfaces/hspline_query/tessellate.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "surfaces/mesh_files/read_ply.h"
#include "tests/testing/scratch_folder.h"
#include "tests/testing/shapes.h"
#include "tests/testing/splines.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;
using Json = nlohmann::json;

class ExportFile : public ::testing::Test {
 protected:
  // The folder of a coarse phantom.
  fs::path WriteSmallRun() {
    const std::vector<std::string> overrides = {
        "subject.rings=20",     "implicit.resolution=16",
        "seeds.level=0",        "first_fit=[]",
        "template.max_level=1", "fit.plan.schedule=[{level: 0, fraction: 1}]"};
    const auto experiment =
        ReadConfig<Experiment>(SEMBLANCE_SOURCE_DIR "/configs/phantom.yaml", overrides);
    OutputFolder folder(scratch_ / "run", WhenNotEmpty::kRefuse);
    WriteRun(experiment, problems::Run(experiment, {}), folder, {});
    return folder.Root();
  }

  // A mesh with a value and colours.
  fs::path WriteSphere() {
    const TriMesh sphere = testing::SphereMesh({1, 2, 3}, 10, 8);
    MeshAttributes attributes;
    attributes.colors.assign(sphere.points.size(), {10, 20, 30});
    attributes.scalars = {{"scalar_height_mm", {}}};
    for (const Vec3& point : sphere.points) {
      attributes.scalars[0].values.push_back(point.z());
    }
    WriteFileAtomically(scratch_ / "sphere.ply", EncodeMesh(sphere, ".ply", attributes));
    return scratch_ / "sphere.ply";
  }

  static std::string Export(const fs::path& from, const std::string& extension) {
    return ExportedBytes(from, {.extension = extension, .chord_mm = {}, .threads = 1});
  }

  testing::ScratchFolder scratch_;
};

std::vector<double> Values(const pugi::xml_document& document, const std::string& name) {
  const std::string path = "//PointData/DataArray[@Name='" + name + "']";
  std::string text = document.select_node(path.c_str()).node().text().as_string();
  std::erase(text, '\n');
  const std::string bytes = FromBase64(text);
  std::vector<double> values(bytes.size() / 8);
  std::memcpy(values.data(), bytes.data(), bytes.size());
  return {values.begin() + 1, values.end()};
}

Json DocumentOf(const std::string& glb) {
  std::uint32_t length = 0;
  std::memcpy(&length, glb.data() + 12, 4);
  return Json::parse(glb.substr(20, length));
}

std::vector<std::string> NamesOf(const Json& document, const Json& nodes) {
  std::vector<std::string> names;
  for (const Json& node : nodes) {
    names.push_back(document["nodes"][node.get<int>()]["name"]);
  }
  return names;
}

TEST_F(ExportFile, ARunBecomesAGlbWithSkullFaceAndDowelsThorough) {
  const fs::path run = WriteSmallRun();
  const std::string ply = ReadFileBytes(run / "face.ply");
  pugi::xml_document vtp;
  ASSERT_TRUE(vtp.load_string(Export(run / "face.ply", ".vtp").c_str()));
  for (const char* name : {"error_mm", "origin", "sigma_mm"}) {
    const std::vector<double> in_ply =
        ReadPlyVertexScalar(ply, std::string("scalar_") + name, "ply");
    const std::vector<double> in_vtp = Values(vtp, name);
    ASSERT_EQ(in_vtp.size(), in_ply.size()) << name;
    for (std::size_t v = 0; v < in_ply.size(); ++v) {
      ASSERT_TRUE(in_vtp[v] == in_ply[v] || (std::isnan(in_vtp[v]) && std::isnan(in_ply[v])))
          << name << " " << v;
    }
  }
  EXPECT_FALSE(vtp.select_node("//DataArray[@Name='quality']"));

  const Json glb = DocumentOf(Export(run, ".GLB"));
  EXPECT_EQ(NamesOf(glb, glb["scenes"][0]["nodes"]),
            (std::vector<std::string>{"skull", "face", "dowels"}));
  EXPECT_THAT(NamesOf(glb, glb["nodes"][2]["children"]),
              AllOf(Contains("dowel g"), Contains("dowel go_l")));
  const TriMesh face = ReadMesh(run / "face.ply");
  const Json& primitive = glb["meshes"][1]["primitives"][0];
  EXPECT_EQ(glb["accessors"][primitive["attributes"]["COLOR_0"].get<int>()]["count"],
            face.points.size());
  EXPECT_EQ(glb["accessors"][primitive["indices"].get<int>()]["count"], 3 * face.triangles.size());
}

TEST_F(ExportFile, AMeshIsExportedToEveryMeshFormat) {
  const fs::path sphere = WriteSphere();
  const TriMesh mesh = ReadMesh(sphere);
  for (const char* extension : {".obj", ".off", ".stl", ".ply"}) {
    const fs::path file = scratch_ / (std::string("written") + extension);
    WriteFileAtomically(file, Export(sphere, extension));
    EXPECT_EQ(ReadMesh(file).triangles.size(), mesh.triangles.size()) << extension;
  }
  EXPECT_EQ(Export(sphere, ".ply"), ReadFileBytes(sphere));  // with all its values
  pugi::xml_document vtu;
  ASSERT_TRUE(vtu.load_string(Export(sphere, ".vtu").c_str()));
  EXPECT_EQ(Values(vtu, "height_mm"),
            ReadPlyVertexScalar(ReadFileBytes(sphere), "scalar_height_mm", ""));
  EXPECT_EQ(DocumentOf(Export(sphere, ".glb"))["nodes"][0]["name"], "sphere");
}

TEST_F(ExportFile, ASceneThatIsNoneIsRefusedWithItsFile) {
  WriteFileAtomically(scratch_ / "result.json", "{}");
  WriteFileAtomically(scratch_ / "scene.json",
                      R"({"layers": [{"id": "skull", "mesh": {"a": 1}}], "blobs": {}})");
  EXPECT_THAT([&] { Export(scratch_.Path(), ".glb"); },
              ThrowsMessage<IoError>(AllOf(HasSubstr("scene.json: not the scene of a run"),
                                           Not(HasSubstr("json.exception")))));
}

TEST_F(ExportFile, InvalidCombinationsAreRefusedWithARemedy) {
  const fs::path sphere = WriteSphere(), folder = scratch_.Path();
  EXPECT_THAT([&] { Export(folder, ".vtp"); }, ThrowsMessage<InputError>(HasSubstr("face.ply")));
  EXPECT_THAT([&] { Export(sphere, ".step"); }, ThrowsMessage<InputError>(HasSubstr(".vtp")));
  EXPECT_THAT([&] { Export(folder, ".glb"); }, ThrowsMessage<IoError>(HasSubstr("semblance run")));
  EXPECT_THAT([&] { ExportedBytes(sphere, {.extension = ".glb", .chord_mm = 1, .threads = 1}); },
              ThrowsMessage<InputError>(HasSubstr("--chord_mm")));
}

}  // namespace
}  // namespace semblance::problems
