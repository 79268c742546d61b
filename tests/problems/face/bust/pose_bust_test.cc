// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/bust/pose_bust.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "fitting/problem/placement.h"
#include "problems/face/bust/bust_files.h"
#include "problems/face/bust/head_domain.h"
#include "problems/face/bust/soft_deformation.h"
#include "problems/face/bust/whole_head.h"
#include "problems/face/ict_face.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline_query/tessellate.h"
#include "surfaces/mesh/mesh_query.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "tests/testing/scratch_folder.h"
#include "tests/testing/splines.h"

namespace semblance::problems {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pointwise;
using ::testing::ThrowsMessage;

// The program's own head, with few triangles.
BustModel SmallBust() {
  const WholeHead head = WholeHeadFromJson(IctHead(), "the ICT head");
  BustModel model{.name = "small",
                  .mesh = WholeHeadMesh(head, 112, 84),
                  .eyeballs = head.eyeballs,
                  .rest = LoadTemplate(IctTemplate{.mean = IctMean::kModel}),
                  .sites = {},
                  .obj = std::nullopt};
  for (const auto& [code, uv] : model.rest->site_uv) {
    model.sites[code] = model.rest->surface.Point(uv);
  }
  return model;
}

Similarity Elsewhere() {
  const Mat3 turn = Eigen::AngleAxisd(0.3, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  return {1.07, turn, {20, -40, 900}};
}

// Another person: a longer chin on one side, a fuller cheek.
HSplineSurface AnotherFace(const HSplineSurface& face) {
  ControlNet net = face.Net(0);
  for (Vec3& p : net.vertices) {
    const auto bell = [&](const Vec3& centre, double width) {
      return std::exp(-0.5 * (p - centre).squaredNorm() / (width * width));
    };
    p += bell({0, -90, -80}, 35) * Vec3(3, -5, -9) + bell({50, -40, -20}, 30) * Vec3(6, -4, 0) +
         bell({-40, -60, 90}, 40) * Vec3(0, -4, 5);
  }
  HSplineSurface other = face;
  other.SetNet(0, net);
  return other;
}

Bust Pose(const BustModel& model, const HSplineSurface& face, const TriMesh& over_skull = {},
          int threads = 2) {
  RunContext context;
  context.threads = threads;
  return PoseBust(
      {model, face, LoadTemplate(IctTemplate{.mean = IctMean::kModel}).site_uv, over_skull},
      context);
}

double LargestGap(const TriMesh& mesh, const std::vector<Vec3>& expected) {
  double gap = 0;
  for (std::size_t v = 0; v < expected.size(); ++v) {
    gap = std::max(gap, (mesh.points[v] - expected[v]).norm());
  }
  return gap;
}

TEST(PoseBust, StaysWhereItsFaceIsTheSubjects) {
  const BustModel model = SmallBust();
  const Bust bust = Pose(model, model.rest->surface);
  EXPECT_LT(LargestGap(bust.skin, model.mesh.points), 1e-6);
  EXPECT_EQ(bust.turned_over, 0);
  ASSERT_EQ(bust.eyes.size(), 8u);
  for (std::size_t k = 0; k < bust.eyes.size(); ++k) {
    const TriMesh& part = bust.eyes[k].mesh;
    for (const Triangle& t : part.triangles) {  // counter-clockwise from outside
      EXPECT_GT(
          TriangleAreaVector(part, t).dot(TriangleCentroid(part, t) - model.eyeballs[k / 4].center),
          0);
    }
  }
}

TEST(PoseBust, FollowsASimilarityOfTheFaceAndOfWhatIsOverTheSkull) {
  const BustModel model = SmallBust();
  const Similarity moved = Elsewhere();
  const TriMesh expected = Transformed(model.mesh, moved);
  const Bust bust = Pose(model, Transformed(model.rest->surface, moved), expected);
  EXPECT_LT(LargestGap(bust.skin, expected.points), 1e-5);
  EXPECT_GT(bust.on_skull, 100);
}

TEST(PoseBust, MeetsTheFaceWithoutATornSeam) {
  const BustModel model = SmallBust();
  const Bust bust = Pose(model, AnotherFace(model.rest->surface));
  EXPECT_EQ(bust.turned_over, 0);
  EXPECT_LT(bust.face_rms_mm, 0.3);
  // The strain between neighbours, mm per mm.
  double strain = 0;
  for (const Triangle& t : model.mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      const Vec3 before = model.mesh.points[b] - model.mesh.points[a];
      const Vec3 after = bust.skin.points[b] - bust.skin.points[a];
      if (before.norm() > 0.5) {
        strain = std::max(strain, (after - before).norm() / before.norm());
      }
    }
  }
  EXPECT_LT(strain, 0.6);
}

TEST(PoseBust, TheScalpMeetsWhatIsOverTheSkull) {
  const BustModel model = SmallBust();
  TriMesh larger = model.mesh;
  for (Vec3& p : larger.points) {
    p += 6 * std::clamp((p.z() - 40) / 60, 0.0, 1.0) * Vec3(p.x(), p.y(), p.z()).normalized();
  }
  const Bust bust = Pose(model, model.rest->surface, larger);
  const MeshQuery query(larger);
  const Vec3 back(0, 80, 100);
  for (std::size_t v = 0; v < bust.skin.points.size(); ++v) {
    if ((model.mesh.points[v] - back).norm() < 40) {
      EXPECT_LT(query.Closest(bust.skin.points[v]).distance_mm, 0.5);
    }
  }
  EXPECT_EQ(bust.turned_over, 0);
}

TEST(PoseBust, GivesTheSameBytesWithOneAndFourThreads) {
  const BustModel model = SmallBust();
  const HSplineSurface face = AnotherFace(model.rest->surface);
  const auto one = BustToFiles(Pose(model, face, {}, 1), model);
  const auto four = BustToFiles(Pose(model, face, {}, 4), model);
  ASSERT_EQ(one.size(), four.size());
  for (std::size_t k = 0; k < one.size(); ++k) {
    EXPECT_EQ(one[k].name, four[k].name);
    EXPECT_TRUE(one[k].bytes == four[k].bytes) << one[k].name;
  }
}

TEST(PoseBust, AMeshWithLandmarksFollowsTheFaceToo) {
  BustModel model = SmallBust();
  const HSplineSurface face = Transformed(AnotherFace(model.rest->surface), Elsewhere());
  const std::vector<Sphere> eyes = model.eyeballs;
  model.rest.reset();
  model.eyeballs.clear();
  const Bust bust = Pose(model, face);
  EXPECT_EQ(bust.turned_over, 0);
  EXPECT_LT(bust.face_rms_mm, 0.6);
  EXPECT_TRUE(bust.eyes.empty());
  const MeshQuery query(bust.skin);
  for (const auto& [code, uv] : LoadTemplate(IctTemplate{.mean = IctMean::kModel}).site_uv) {
    EXPECT_LT(query.Closest(face.Point(uv)).distance_mm, 1.5) << code;
  }
}

TEST(PoseBust, RefusesAModelWithTooFewSites) {
  BustModel model = SmallBust();
  model.rest.reset();
  model.sites = {{"g", {0, 0, 0}}};
  EXPECT_THAT([&] { Pose(model, LoadTemplate(IctTemplate{.mean = IctMean::kModel}).surface); },
              ThrowsMessage<InputError>(HasSubstr("shares 1 sites with the face")));
}

// ------------------------------------------------------------------------------------------------
// Files
// ------------------------------------------------------------------------------------------------

std::uint32_t Word(const std::string& bytes, std::size_t at) {
  std::uint32_t word = 0;
  for (int k = 3; k >= 0; --k) {
    word = word << 8 | static_cast<unsigned char>(bytes[at + k]);
  }
  return word;
}

TEST(BustFiles, ReadBackTheSame) {
  const BustModel model = SmallBust();
  const Bust bust = Pose(model, model.rest->surface);
  const auto files = BustToFiles(bust, model);
  ASSERT_EQ(files.size(), 3u);
  const testing::ScratchFolder folder;
  for (const NamedBytes& file : files) {
    std::ofstream(folder / file.name, std::ios::binary) << file.bytes;
  }
  const TriMesh read = ReadMesh(folder / "bust.obj");
  for (std::size_t v = 0; v < bust.skin.points.size(); ++v) {
    ASSERT_EQ(read.points[v].cast<float>(), bust.skin.points[v].cast<float>());
  }
  EXPECT_TRUE(std::ranges::equal(bust.skin.triangles,
                                 std::span(read.triangles).first(bust.skin.triangles.size())));
  const std::string& glb = files[0].bytes;
  ASSERT_EQ(glb.substr(0, 4), "glTF");
  ASSERT_EQ(Word(glb, 8), glb.size());
  const std::uint32_t length = Word(glb, 12);
  const auto json = nlohmann::json::parse(glb.substr(20, length));
  EXPECT_EQ(json["meshes"][0]["primitives"].size(), 5u);
  const std::size_t begin = 20 + length + 8;
  const auto at = [&](std::size_t k) { return std::bit_cast<float>(Word(glb, begin + 4 * k)); };
  for (std::size_t v = 0; v < bust.skin.points.size(); ++v) {
    const Vec3 p = bust.skin.points[v] / 1000;
    ASSERT_EQ(Eigen::Vector3f(at(3 * v), at(3 * v + 1), at(3 * v + 2)),
              Vec3(p.x(), p.z(), -p.y()).cast<float>());
  }
}

// An OBJ of one quad with its materials and textures.
class ObjBust : public ::testing::Test {
 protected:
  static constexpr const char* kPng = "\x89PNG\r\n\x1a\npixels";
  static constexpr const char* kJpeg = "\xff\xd8\xff pixels";

  void Write(const std::filesystem::path& name, const std::string& text) const {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  // colour: more numbers of each point.
  void WriteObj(const std::string& beginning, const std::string& faces = "usemtl face\nf 1 2 3 4\n",
                const std::string& colour = "") const {
    Write("head.obj", beginning + "v 0 0 0" + colour + "\nv 1 0 0" + colour + "\nv 1 1 0" + colour +
                          "\nv 0 1 0" + colour + "\n" + faces);
  }
  ObjText Read() const { return ReadObjText(folder_ / "head.obj"); }
  BustModel Model() const {
    return {.name = "quad",
            .mesh = ReadMesh(folder_ / "head.obj"),
            .eyeballs = {},
            .rest = std::nullopt,
            .sites = {},
            .obj = Read()};
  }
  std::map<std::string, std::string> Files() const {
    const BustModel model = Model();
    std::map<std::string, std::string> files;
    for (const NamedBytes& file : BustToFiles(
             {.skin = model.mesh, .eyes = {}, .eyeballs = {}, .subject_from_model = {}}, model)) {
      EXPECT_TRUE(files.emplace(file.name, file.bytes).second) << file.name;
    }
    return files;
  }
  // Reads the GLB.
  static nlohmann::json JsonOf(const std::string& glb) {
    return nlohmann::json::parse(glb.substr(20, Word(glb, 12)));
  }
  // COLOR_0 of a part of the GLB: linear red, green, blue and opacity of each point, 0..1.
  static std::vector<double> ColoursOf(const std::string& glb, const nlohmann::json& part) {
    if (!part["attributes"].contains("COLOR_0")) {
      return {};
    }
    const nlohmann::json json = JsonOf(glb);
    const auto& accessor = json["accessors"][part["attributes"]["COLOR_0"].get<int>()];
    const auto& view = json["bufferViews"][accessor["bufferView"].get<int>()];
    const std::size_t at = 28 + Word(glb, 12) + view["byteOffset"].get<std::size_t>();
    std::vector<double> colours;
    for (std::size_t k = 0; k < 2 * accessor["count"].get<std::size_t>(); ++k) {
      const std::uint32_t two = Word(glb, at + 4 * k);
      colours.push_back((two & 0xffff) / 65535.0);
      colours.push_back((two >> 16) / 65535.0);
    }
    return colours;
  }
  const testing::ScratchFolder folder_;
};

TEST_F(ObjBust, KeepsItsLinesMaterialsAndTextures) {
  Write("head.mtl", "newmtl face\nKd 0.5 0.25 1\nmap_Kd maps/skin.png\n");
  Write("maps/skin.png", kPng);
  WriteObj("mtllib head.mtl\no head\n",
           "vt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1\nusemtl face\nf 1/1/1 2/2/1 3/3/1 4/1/1\n");
  const BustModel model = Model();
  Bust bust{.skin = model.mesh, .eyes = {}, .eyeballs = {}, .subject_from_model = {}};
  bust.skin.points[2] = {2, 3, 0.5};
  const auto files = BustToFiles(bust, model);
  ASSERT_EQ(files.size(), 4u);
  EXPECT_EQ(files[1].bytes,
            "mtllib bust.mtl\no head\nv 0 0 0\nv 1 0 0\nv 2 3 0.5\nv 0 1 0\nvt 0 0\nvt 1 0\n"
            "vt 1 1\nusemtl face\nf 1/1 2/2 3/3 4/1\n");
  EXPECT_EQ(files[2].bytes, "newmtl face\nKd 0.5 0.25 1\nmap_Kd bust_textures/skin.png\n");
  EXPECT_EQ(files[3].name, "bust_textures/skin.png");
  EXPECT_EQ(files[3].bytes, kPng);
  EXPECT_THAT(files[0].bytes, HasSubstr("baseColorTexture"));
  Write("head.mtl", "newmtl face\nmap_Kd ../../secret.png\n");
  EXPECT_THAT([&] { Read(); }, ThrowsMessage<InputError>(HasSubstr("not below its own folder")));
}

// Textures get different names, so that none replaces a result of the run or another texture.
TEST_F(ObjBust, NoTextureReplacesAResultOfTheRun) {
  Write("head.mtl",
        "newmtl face\nmap_Kd face.ply\nnewmtl a\nmap_Kd skin/diffuse.png\nmap_Ks ./face.ply\n"
        "newmtl b\nmap_Kd scalp\\Diffuse.png\nmap_bump scalp/Diffuse.png\n");
  Write("face.ply", std::string(kPng) + " of the face");
  Write("skin/diffuse.png", std::string(kPng) + " of the skin");
  Write("scalp/Diffuse.png", std::string(kPng) + " of the scalp");
  WriteObj("mtllib head.mtl\n");
  const auto files = Files();
  ASSERT_EQ(files.size(), 6u);
  EXPECT_FALSE(files.contains("face.ply"));
  EXPECT_THAT(files.at("bust_textures/face.ply"), HasSubstr("of the face"));
  EXPECT_THAT(files.at("bust_textures/diffuse.png"), HasSubstr("of the skin"));
  EXPECT_THAT(files.at("bust_textures/Diffuse_2.png"), HasSubstr("of the scalp"));
  EXPECT_EQ(files.at("bust.mtl"),
            "newmtl face\nmap_Kd bust_textures/face.ply\n"
            "newmtl a\nmap_Kd bust_textures/diffuse.png\nmap_Ks bust_textures/face.ply\n"
            "newmtl b\nmap_Kd bust_textures/Diffuse_2.png\nmap_bump bust_textures/Diffuse_2.png\n");
}

TEST_F(ObjBust, ATextureMayHaveSpacesAndOptions) {
  Write("my skin.png", kPng);
  Write("skin.png", kPng);
  WriteObj("mtllib head.mtl\n");
  const auto written = [&](const std::string& line) {
    Write("head.mtl", "newmtl face\n" + line + "\n");
    return Files().at("bust.mtl").substr(12);
  };
  EXPECT_EQ(written("map_Kd my skin.png"), "map_Kd bust_textures/my_skin.png\n");
  EXPECT_EQ(written("\tmap_Kd  my skin.png # of me"), "\tmap_Kd  bust_textures/my_skin.png\n");
  EXPECT_EQ(written("map_Kd -s 1 1 1 skin.png"), "map_Kd -s 1 1 1 bust_textures/skin.png\n");
  EXPECT_EQ(written("map_Kd -clamp on -o 0.5 my skin.png"),
            "map_Kd -clamp on -o 0.5 bust_textures/my_skin.png\n");
  EXPECT_EQ(written("map_Kd -shiny 1 2 skin.png"), "map_Kd -shiny 1 2 bust_textures/skin.png\n");
  EXPECT_THAT([&] { written("map_Kd your face.png"); },
              ThrowsMessage<IoError>(HasSubstr("your face.png' is not there")));
}

TEST_F(ObjBust, MayNameSeveralLibrariesOnALine) {
  Write("one.mtl", "newmtl face\nKd 1 0 0");
  Write("two.mtl", "newmtl hair\nKd 0 1\\\n0\n");  // a line that continues
  WriteObj("mtllib one.mtl two.mtl # both\n");
  EXPECT_EQ(Files().at("bust.mtl"), "newmtl face\nKd 1 0 0\nnewmtl hair\nKd 0 1 0\n");
  Write("one.mtl two.mtl", "newmtl face\nKd 0 0 1\n");
  WriteObj("mtllib one.mtl two.mtl\n");
  EXPECT_EQ(Files().at("bust.mtl"), "newmtl face\nKd 0 0 1\n");
  WriteObj("mtllib my head.mtl\n");
  EXPECT_THAT([&] { Read(); }, ThrowsMessage<IoError>(HasSubstr("my head.mtl")));
}

TEST_F(ObjBust, ATextureIsAPngOrAJpeg) {
  Write("head.mtl", "newmtl face\nmap_Kd skin.png\n");
  WriteObj("mtllib head.mtl\n");
  for (const char* good : {kPng, kJpeg}) {
    Write("skin.png", good);
    EXPECT_EQ(JsonOf(Files().at("bust.glb"))["images"][0]["mimeType"],
              good == kPng ? "image/png" : "image/jpeg");
  }
  for (const char* bad : {"", "not a png", "\x89PNG", "\xff\xd8", "GIF89a pixels"}) {
    Write("skin.png", bad);
    EXPECT_THAT([&] { Read(); },
                ThrowsMessage<InputError>(HasSubstr("skin.png' is neither a PNG nor a JPEG")))
        << bad;
  }
}

// COLOR_0 of the four points where each is 1 0.5 0: red is full, green 128 of 255 of sRGB.
std::vector<double> OrangePoints() {
  std::vector<double> colours;
  for (int point = 0; point < 4; ++point) {
    colours.insert(colours.end(), {1.0, 0.2158605, 0.0, 1.0});
  }
  return colours;
}

TEST_F(ObjBust, HasTheColoursOfItsPointsButWhereThereIsAPicture) {
  Write("skin.png", kPng);
  Write("head.mtl", "newmtl face\nKd 0 1 0\nnewmtl cloth\nmap_Kd skin.png\n");
  WriteObj("mtllib head.mtl\n", "usemtl face\nf 1 2 3 4\nusemtl cloth\nf 1 2 3 4\n", " 1 0.5 0");
  const std::string glb = Files().at("bust.glb");
  const auto json = JsonOf(glb);
  const auto& parts = json["meshes"][0]["primitives"];
  ASSERT_EQ(parts.size(), 2u);
  for (const auto& part : parts) {
    const auto& look = json["materials"][part["material"].get<int>()];
    EXPECT_THAT(ColoursOf(glb, part),
                Pointwise(DoubleNear(1e-5),
                          look["name"] == "face" ? OrangePoints() : std::vector<double>()));
    EXPECT_EQ(look["pbrMetallicRoughness"].contains("baseColorTexture"), look["name"] == "cloth");
    EXPECT_EQ(look["pbrMetallicRoughness"]["baseColorFactor"] == nlohmann::json({0, 1, 0, 1}),
              look["name"] == "face");
  }
}

TEST_F(ObjBust, WithoutMaterialsHasASkin) {
  WriteObj("# mine\\\n", "f 1 2 3 4\n", " 1 0.5 0");  // no line of an OBJ continues
  const auto files = Files();
  EXPECT_THAT(files.at("bust.obj"),
              ::testing::StartsWith("mtllib bust.mtl\n# mine\\\nv 0 0 0 1 0.5"));
  EXPECT_THAT(files.at("bust.obj"), ::testing::EndsWith("usemtl skin\nf 1 2 3 4\n"));
  EXPECT_THAT(files.at("bust.mtl"), ::testing::StartsWith("newmtl skin\nKd 1 1 1\n"));
  const auto json = JsonOf(files.at("bust.glb"));
  EXPECT_EQ(json["materials"][0]["name"], "skin");
  EXPECT_THAT(ColoursOf(files.at("bust.glb"), json["meshes"][0]["primitives"][0]),
              Pointwise(DoubleNear(1e-5), OrangePoints()));
  // Without colours it is of the colour of skin; a name of a material stays.
  WriteObj("", "f 1 2 3\nusemtl hair\nf 1 3 4\n");
  EXPECT_THAT(Files().at("bust.obj"), HasSubstr("usemtl skin\nf 1 2 3\nusemtl hair\nf 1 3 4\n"));
  EXPECT_THAT(Files().at("bust.mtl"), HasSubstr("newmtl hair\nKd 0.85"));
  EXPECT_THAT(Files().at("bust.mtl"), HasSubstr("newmtl skin\nKd 0.85"));
  EXPECT_THAT(Files().at("bust.glb"), ::testing::Not(HasSubstr("COLOR_0")));
}

// ------------------------------------------------------------------------------------------------
// Busts of a mesh with landmarks
// ------------------------------------------------------------------------------------------------

class BadBust : public ::testing::Test {
 protected:
  // As mesh and landmarks in the folder.
  MeshBust Written(const TriMesh& mesh, double mirror = 1) const {
    const MeshBust bust{folder_ / "bust.ply", folder_ / "sites.csv"};
    std::ofstream(bust.mesh, std::ios::binary) << EncodeMesh(mesh, ".ply");
    std::ofstream csv(bust.landmarks);
    csv << "site,x,y,z\n";
    for (const auto& [code, p] : SmallBust().sites) {
      csv << code << ',' << mirror * p.x() << ',' << p.y() << ',' << p.z() << '\n';
    }
    return bust;
  }
  std::string Complaint(const MeshBust& bust) const {
    try {
      LoadBust(bust, IctTemplate{}, {});
    } catch (const InputError& error) {
      return error.what();
    }
    return "none";
  }
  const testing::ScratchFolder folder_;
};

TEST_F(BadBust, IsRefusedInOneLine) {
  const TriMesh head = SmallBust().mesh;
  EXPECT_EQ(Complaint(Written(head)), "none");
  EXPECT_THAT(Complaint(Written(head, -1)), HasSubstr("left and right have changed places"));
  TriMesh two = head;
  const auto n = static_cast<std::int32_t>(head.points.size());
  for (const Vec3& p : head.points) {
    two.points.push_back(p + Vec3(300, 0, 0));
  }
  for (const Triangle& t : head.triangles) {
    two.triangles.push_back({t[0] + n, t[1] + n, t[2] + n});
  }
  EXPECT_THAT(Complaint(Written(two)), HasSubstr("two pieces of a head's size"));
  TriMesh pieces = head;
  pieces.points.insert(pieces.points.end(), {{0, 0, 0}, {9, 0, 0}, {0, 9, 0}});
  pieces.triangles.push_back({n, n + 1, n + 2});
  EXPECT_THAT(Complaint(Written(pieces)), HasSubstr("a bust is one piece, and this mesh has 2"));
  EXPECT_THAT(Complaint({}), ::testing::StartsWith("it names no mesh;"));
  EXPECT_THAT(Complaint({.mesh = "bust.ply", .landmarks = {}}),
              ::testing::StartsWith("it names no landmarks;"));
  EXPECT_THAT([] { LoadBust(HSplineBust{}, IctTemplate{}, {}); },
              ThrowsMessage<InputError>(::testing::StartsWith("it names no file;")));
}

TEST_F(BadBust, AnEndingInCapitalsMakesNone) {
  MeshBust bust = Written(SmallBust().mesh);
  bust.mesh = folder_ / "BUST.OBJ";
  std::ofstream(bust.mesh, std::ios::binary) << EncodeMesh(SmallBust().mesh, ".obj");
  std::filesystem::rename(bust.landmarks, folder_ / "SITES.CSV");
  bust.landmarks = folder_ / "SITES.CSV";
  const auto model = LoadBust(bust, IctTemplate{}, {});
  ASSERT_TRUE(model && model->obj);
  EXPECT_EQ(model->obj->file.polygons.size(), model->mesh.triangles.size());
}

// ------------------------------------------------------------------------------------------------
// The deformation and the whole head
// ------------------------------------------------------------------------------------------------

TEST(SoftDeformation, ATriangleTurnedOverIsFound) {
  const TriMesh before{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}, {{0, 1, 2}, {1, 3, 2}}};
  TriMesh after = before;
  after.points[3] = {-0.5, -0.5, 0};
  EXPECT_THAT(TurnedOver(before, after, Mat3::Identity()), ElementsAre(1));
}

TEST(WholeHead, RoundTripsThroughItsFile) {
  const WholeHead head = WholeHeadFromJson(IctHead(), "the ICT head");
  EXPECT_EQ(WholeHeadToJson(head), std::string(IctHead()));
  EXPECT_EQ(head.eyeballs.size(), 2u);
  const std::string_view whole = IctHead();
  for (const std::string_view bad :
       {std::string_view("{}"), std::string_view(), std::string_view("no JSON"),
        whole.substr(0, whole.size() / 2), whole.substr(0, whole.size() - 3)}) {
    EXPECT_THAT([&] { WholeHeadFromJson(bad, "bust.json"); },
                ThrowsMessage<IoError>(::testing::StartsWith("bust.json: ")));
  }
  const HSplineSurface sheet = testing::SmoothSurface({.closure = Closure::kOpen}, 1);
  EXPECT_THAT(
      [&] {
        WholeHeadFromJson(WholeHeadToJson({sheet, {}}), "bust.json");
      },
      ThrowsMessage<IoError>(HasSubstr("must go round in u; write closure periodic_u")));
}

TEST(WholeHead, ItsMeshIsOnePieceOpenAtTheNeckAlone) {
  const TriMesh mesh = WholeHeadMesh(WholeHeadFromJson(IctHead(), "the ICT head"), 96, 72);
  const EdgeReport edges = CheckEdges(mesh);
  EXPECT_EQ(edges.boundary, 96);
  EXPECT_EQ(edges.non_manifold, 0);
  EXPECT_EQ(edges.inconsistent, 0);
  EXPECT_EQ(ConnectedComponents(mesh).count, 1);
}

// At the crown all u meet.
TEST(WholeHead, ItsMeshFoldsNowhereAtTheCrown) {
  const WholeHead head = WholeHeadFromJson(IctHead(), "the ICT head");
  for (const auto& [columns, rows] : {std::pair(272, 204), {96, 72}, {300, 150}}) {
    const TriMesh mesh = WholeHeadMesh(head, columns, rows);
    const Vec3 crown = mesh.points.back();
    std::map<MeshEdge, Vec3> normals;  // of the first triangle at an edge
    int folds = 0, seen = 0;
    for (const Triangle& t : mesh.triangles) {
      const Vec3 normal = TriangleAreaVector(mesh, t).normalized();
      if ((TriangleCentroid(mesh, t) - crown).norm() > 25) {
        continue;
      }
      EXPECT_GT(normal.z(), 0);
      for (int k = 0; k < 3; ++k) {
        const auto [a, b] = std::minmax(t[k], t[(k + 1) % 3]);
        const auto [first, is_new] = normals.try_emplace({a, b}, normal);
        seen += !is_new;
        folds += !is_new && first->second.dot(normal) < -0.5;  // 120 degrees
      }
    }
    EXPECT_GT(seen, 50);
    EXPECT_EQ(folds, 0) << columns << " x " << rows;
  }
  // The fan follows the surface.
  const TriMesh mesh = WholeHeadMesh(head, 272, 204);
  const MeshQuery query(mesh);
  for (int i = 0; i < 40; ++i) {
    for (const double v : {0.945, 0.96, 0.975, 0.99}) {
      EXPECT_LT(query.Closest(head.surface.Point({i / 40.0, v})).distance_mm, 0.25);
    }
  }
}

// In the domain every triangle keeps its side; a hole becomes a pocket.
TEST(HeadDomain, FoldsNowhere) {
  const TriMesh whole = WholeHeadMesh(WholeHeadFromJson(IctHead(), "the ICT head"), 64, 48);
  std::vector<bool> keep;
  for (const Triangle& t : whole.triangles) {
    keep.push_back((TriangleCentroid(whole, t) - Vec3(0, -90, 80)).norm() > 20);
  }
  const HeadDomain domain = LayOutHead(Submesh(whole, keep), "head");
  EXPECT_EQ(domain.rims.size(), 1u);
  int folded = 0;
  for (const Triangle& t : domain.mesh.triangles) {
    if (std::ranges::find(t, domain.crown) != t.end()) {
      continue;
    }
    Vec2 a = domain.uv[t[1]] - domain.uv[t[0]], b = domain.uv[t[2]] - domain.uv[t[0]];
    a.x() -= std::round(a.x());
    b.x() -= std::round(b.x());
    folded += a.x() * b.y() - a.y() * b.x() <= 0;
  }
  EXPECT_EQ(folded, 0);
  const TriMesh closed{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                       {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};
  EXPECT_THAT([&] { LayOutHead(closed, "ball.ply"); },
              ThrowsMessage<InputError>(HasSubstr("ball.ply: the head has no border")));
}

}  // namespace
}  // namespace semblance::problems
