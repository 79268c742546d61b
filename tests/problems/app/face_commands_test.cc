// SPDX-License-Identifier: GPL-3.0-or-later
// The commands edit, export and feature, called as a program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>

#include "surfaces/hspline/feature.h"
#include "surfaces/hspline/hspline_surface.h"
#include "surfaces/hspline_files/face_export.h"
#include "surfaces/hspline_files/hspline_json.h"
#include "surfaces/hspline_query/tessellate.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "surfaces/mesh_files/read_ply.h"
#include "tests/testing/program_call.h"
#include "tests/testing/shapes.h"
#include "tests/testing/splines.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class FaceCommands : public ::testing::Test {
 protected:
  void SetUp() override { WriteHSpline(folder_ / "face.json", face_); }

  testing::Outcome Call(const std::string& arguments) {
    return testing::CallProgram(folder_, arguments);
  }

  void ExpectDone(const std::string& arguments) {
    const testing::Outcome outcome = Call(arguments);
    EXPECT_EQ(outcome.code, 0) << arguments << "\n" << outcome.err;
    EXPECT_EQ(outcome.err, "") << arguments;
  }

  // Expects one line of error, exit code 2, and no new or changed file or folder.
  void ExpectRefused(const std::string& arguments, const std::string& words) {
    const std::map<fs::path, std::string> before = Contents();
    const testing::Outcome outcome = Call(arguments);
    EXPECT_EQ(outcome.code, 2) << arguments;
    EXPECT_THAT(outcome.err, HasSubstr(words));
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_EQ(Contents(), before) << arguments;
  }

  // Everything in the folder, except the output of the last call.
  std::map<fs::path, std::string> Contents() const {
    std::map<fs::path, std::string> contents;
    for (const auto& entry : fs::recursive_directory_iterator(folder_.Path())) {
      contents[entry.path()] = entry.is_regular_file() ? ReadFileBytes(entry.path()) : "";
    }
    contents.erase(folder_ / "stdout.txt");
    contents.erase(folder_ / "stderr.txt");
    return contents;
  }

  std::string Bytes(const std::string& name) { return ReadFileBytes(folder_ / name); }

  testing::ScratchFolder folder_;
  const HSplineSurface face_ =
      testing::RandomSurface({.patches_u = 4, .patches_v = 4, .max_level = 3}, 1);
};

TEST_F(FaceCommands, EditMovesVerticesAndItsInverseMovesThemBack) {
  WriteFileAtomically(folder_ / "script.yaml",
                      "edits:\n  - {level: 2, i: 5, j: 6, offset: [0.5, 0, -1]}\n");
  ExpectDone("edit face.json script.yaml --out edited.json --inverse inverse.yaml");
  EXPECT_EQ(ReadHSpline(folder_ / "edited.json").Offset({2, 5, 6}), Vec3(0.5, 0, -1));
  ExpectDone("edit edited.json inverse.yaml --out back.json");
  EXPECT_EQ(Bytes("back.json"), Bytes("face.json"));
  ExpectRefused("edit face.json missing.yaml --out x.json", "missing.yaml");
  WriteFileAtomically(folder_ / "none.yaml", "edits: [{level: 0, i: 0, j: 0}]\n");
  ExpectRefused("edit face.json none.yaml --out x.json", "none.yaml: edit script: vertex (0, 0)");
  ExpectRefused("edit face.json script.yaml --out back.json", "--force");
  ExpectRefused("edit face.json script.yaml --out x.json --inverse inverse.yaml", "--force");
  EXPECT_FALSE(fs::exists(folder_ / "x.json"));
  fs::create_directories(folder_ / "dir");
  for (const char* other : {"no/such.yaml", "dir", "face.json/x.yaml"}) {
    const std::string name(other);
    ExpectRefused("edit face.json script.yaml --out x.json --force --inverse " + name, name);
    ExpectRefused("edit face.json script.yaml --inverse x.yaml --force --out " + name, name);
  }
  ExpectDone("edit face.json script.yaml --out back.json --inverse inverse.yaml --force");
}

TEST_F(FaceCommands, EditResetsARegionAndItsInverseRestoresIt) {
  WriteFileAtomically(folder_ / "reset.yaml", "resets:\n  - {u: [0, 0.5], v: [0, 1]}\n");
  ExpectDone("edit face.json reset.yaml --out smooth.json --inverse inverse.yaml");
  const HSplineSurface smooth = ReadHSpline(folder_ / "smooth.json");
  for (const auto& [vertex, offset] : face_.Offsets()) {
    EXPECT_EQ(smooth.Offset(vertex).has_value(), smooth.GrevillePoint(vertex).x() > 0.5);
  }
  ExpectDone("edit smooth.json inverse.yaml --out back.json");
  EXPECT_EQ(Bytes("back.json"), Bytes("face.json"));
}

TEST_F(FaceCommands, ExportsExactAndTriangulatedFaces) {
  ExpectDone("export face.json --to face.vtu");
  EXPECT_EQ(Bytes("face.vtu"), SurfaceToVtu(face_));
  ExpectDone("export face.json --to face.glb --chord_mm 0.5");
  EXPECT_THAT(Bytes("face.glb"), StartsWith("glTF"));
  ExpectDone("export face.json --to coarse.ply --chord_mm 2");
  ExpectDone("export face.json --to fine.PLY --chord_mm 0.2 --threads 2");
  ExpectDone("export face.json --to face.obj");
  EXPECT_LT(3 * ReadMesh(folder_ / "coarse.ply").triangles.size(),
            ReadMesh(folder_ / "face.obj").triangles.size());
}

TEST_F(FaceCommands, APlyContainsTheCurvaturesOfTheSurface) {
  ExpectDone("export face.json --to coarse.ply --chord_mm 2");
  const auto scalar = [&](const char* name) {
    return ReadPlyVertexScalar(Bytes("coarse.ply"), name, "coarse.ply");
  };
  const std::vector<double> mean = scalar("scalar_mean_curvature_per_mm"),
                            gaussian = scalar("scalar_gaussian_curvature_per_mm2");
  const std::vector<Vec2> uv = TessellateToChord(face_, 2).uv;
  ASSERT_EQ(mean.size(), uv.size());
  for (std::size_t v = 0; v < uv.size(); ++v) {
    const std::optional<SurfaceCurvature> curvature = CurvatureAt(face_, uv[v]);
    ASSERT_TRUE(curvature);
    EXPECT_FLOAT_EQ(mean[v], curvature->MeanPerMm());
    EXPECT_FLOAT_EQ(gaussian[v], curvature->GaussianPerMm2());
  }
  EXPECT_EQ(scalar("quality"), mean);
}

TEST_F(FaceCommands, ExportsToCadOrNamesTheMissingPart) {
  if (HasCad()) {
    ExpectDone("export face.json --to face.step");
    EXPECT_THAT(Bytes("face.step"), StartsWith("ISO-10303-21;"));
    ExpectDone("export face.json --to face.igs");
  } else {
    ExpectRefused("export face.json --to face.step", "libocct-data-exchange-dev");
    ExpectRefused("export face.json --to face.igs", "libocct-data-exchange-dev");
  }
}

TEST_F(FaceCommands, ExportRefusesWhatItCannotDo) {
  ExpectRefused("export face.json --to face.docx", "'.docx' is not a known format");
  ExpectRefused("export missing.json --to face.glb", "missing.json");
  ExpectRefused("export face.json --to face.vtu --chord_mm 1", "exact surface");
  ExpectRefused("export face.json --to face.glb --chord_mm 0", "above 0");
  ExpectDone("export face.json --to face.glb");
  ExpectRefused("export face.json --to face.glb", "--force");
  ExpectDone("export face.json --to face.glb --force");
}

TEST_F(FaceCommands, AScaleOfModesIsAboveZeroAndBelowABillion) {
  for (const char* wrong : {"-1", "0", "1e-10", "2e9", "nan"}) {
    ExpectRefused(
        "prior m.ply m.npy --sites s.csv --features f.csv --template t --out o.json "
        "--scale " +
            std::string(wrong),
        fmt::format("--scale: '{}' is not a number from 1e-9 to 1e9", wrong));
  }
}

TEST_F(FaceCommands, InputFilesAreNotReplaced) {
  const std::string words = ": this file is read, and input files are never replaced";
  WriteFileAtomically(folder_ / "script.yaml", "edits: []\n");
  ExpectDone("export face.json --to face.ply");
  ExpectDone("feature extract face.json --name a --library lib");
  const std::string before = Bytes("face.json");
  ExpectRefused("export face.ply --to ./face.ply --force", "./face.ply" + words);
  ExpectRefused("edit face.json script.yaml --out face.json --force", "face.json" + words);
  ExpectRefused("edit face.json script.yaml --out new.json --inverse script.yaml --force",
                "script.yaml" + words);
  ExpectRefused("feature apply face.json lib/a.json --out lib/a.json --force",
                "lib/a.json" + words);
  ExpectRefused("feature mirror lib/a.json --name a --library lib --force", "lib/a.json" + words);
  ExpectRefused("feature blend lib/a.json --weights 1 --name a --library lib --force",
                "lib/a.json" + words);
  EXPECT_EQ(Bytes("face.json"), before);
}

TEST_F(FaceCommands, AFeatureIsTransferredBetweenFaces) {
  ExpectDone("feature extract face.json --u 0.2 0.8 --levels 2 3 --name nose --library lib");
  const Feature nose = ReadFeature(folder_ / "lib/nose.json");
  const FeatureRegion region{.lowest_u = 0.2, .highest_u = 0.8, .first_level = 2, .last_level = 3};
  EXPECT_EQ(nose, ExtractFeature(face_, "nose", region));
  HSplineSurface smooth = testing::SmoothSurface(face_.shape(), 1);
  WriteHSpline(folder_ / "smooth.json", smooth);
  ExpectDone("feature apply smooth.json lib/nose.json --out with.json");
  ApplyFeature(nose, smooth);
  EXPECT_EQ(ReadHSpline(folder_ / "with.json").Offsets(), smooth.Offsets());
  EXPECT_THAT(Call("feature list lib").out, HasSubstr("nose: "));
}

TEST_F(FaceCommands, FeaturesBlendAndMirror) {
  ExpectDone("feature extract face.json --levels 1 1 --name a --library lib");
  ExpectDone("feature extract face.json --levels 2 3 --name b --library lib");
  ExpectDone("feature blend lib/a.json lib/b.json --weights 1 0 --name first --library lib");
  EXPECT_EQ(ReadFeature(folder_ / "lib/first.json").offsets,
            ReadFeature(folder_ / "lib/a.json").offsets);
  const testing::Outcome beyond =
      Call("feature blend lib/a.json lib/b.json --weights 1.5 0.5 --name more --library lib");
  EXPECT_EQ(beyond.code, 0);
  EXPECT_THAT(beyond.err, HasSubstr("warning: feature a: the weight 1.5 is outside 0..1"));
  ExpectDone("feature mirror lib/a.json --name other --library lib");
  ExpectDone("feature mirror lib/other.json --name a --library twice");
  EXPECT_EQ(Bytes("twice/a.json"), Bytes("lib/a.json"));
}

TEST_F(FaceCommands, FeatureRefusesWhatItCannotDo) {
  ExpectDone("feature extract face.json --name a --library lib");
  ExpectRefused("feature extract face.json --name a --library lib", "--force");
  ExpectRefused("feature extract face.json --name 'a b' --library lib", "'a b' is not a name");
  ExpectRefused("feature extract face.json --name 'a b' --library new/lib", "'a b' is not a name");
  ExpectRefused("feature extract face.json --u 0.501 0.502 --name e --library new", "has detail");
  ExpectRefused(
      fmt::format("feature extract face.json --name {} --library new/lib", std::string(300, 'n')),
      "too long");
  ExpectRefused("feature extract face.json --name e --library face.json/lib",
                "the folder cannot be created");
  ExpectRefused("feature extract face.json --u 0.501 0.502 --name e --library lib", "has detail");
  ExpectRefused("feature apply face.json lib/c.json --out x.json", "c.json");
  ExpectRefused("feature blend lib/a.json --weights 1 2 --name c --library lib", "2 weights");
  WriteHSpline(folder_ / "other.json",
               testing::SmoothSurface({.patches_u = 5, .patches_v = 4, .max_level = 3}, 1));
  ExpectRefused("feature apply other.json lib/a.json --out x.json", "same template");
  EXPECT_FALSE(fs::exists(folder_ / "x.json"));
  EXPECT_EQ(Call("feature").code, 2);
}

TEST_F(FaceCommands, FuseJoinsAFeatureToAMesh) {
  const auto write = [&](const char* name, const TriMesh& mesh) {
    WriteFileAtomically(folder_ / name, EncodeMesh(mesh, fs::path(name).extension().string()));
  };
  const TriMesh head = testing::SphereMesh({0, 0, 0}, 80, 20);
  const TriMesh nose = testing::SphereMesh({0, -80, 0}, 15, 12);
  write("head.ply", head);
  write("nose.stl", nose);
  write("far.obj", testing::SphereMesh({0, -180, 0}, 15, 12));
  ExpectDone("feature fuse head.ply nose.stl --out fused.ply");
  const TriMesh fused = ReadMesh(folder_ / "fused.ply");
  EXPECT_TRUE(BorderEdges(fused).empty());
  EXPECT_NEAR(Bounds(fused).min().y(), Bounds(nose).min().y(), 1e-4);
  EXPECT_GT(SignedVolume(fused), SignedVolume(head) + SignedVolume(nose) / 3);
  ExpectRefused("feature fuse head.ply far.obj --out x.ply", "far.obj: the feature does not meet");
  ExpectRefused("feature fuse head.ply nose.stl --out fused.ply", "--force");
  ExpectRefused("feature fuse head.ply nose.stl --out nose.stl --force", "nose.stl");
  ExpectRefused("feature fuse head.ply nose.stl --out x.txt", ".txt");
}

}  // namespace
}  // namespace semblance::problems
