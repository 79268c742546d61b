// SPDX-License-Identifier: GPL-3.0-or-later
// The command landmarks, called as a program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "problems/subject/landmark_files/read_landmarks.h"
#include "problems/subject/phantom.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "tests/testing/program_call.h"

namespace semblance::problems {
namespace {

using ::testing::HasSubstr;

class LandmarkCommands : public ::testing::Test {
 protected:
  void SetUp() override {
    WriteFileAtomically(folder_ / "in.csv", "site,x,y,z\nnasion,1,2,3\nleft gonion,4,5,6\n");
  }
  testing::ScratchFolder folder_;
};

TEST_F(LandmarkCommands, ConvertsThereAndBack) {
  EXPECT_EQ(testing::CallProgram(folder_, "landmarks convert in.csv a.mrk.json --axes RAS").code,
            0);
  EXPECT_EQ(testing::CallProgram(folder_, "landmarks convert a.mrk.json b.yaml").code, 0);
  const LandmarkFile file = ReadLandmarks(folder_ / "b.yaml").file;
  EXPECT_EQ(file.landmarks.at(0).site, "n");
  EXPECT_EQ(file.landmarks.at(1).point, (std::array{-4.0, -5.0, 6.0}));
}

TEST_F(LandmarkCommands, ReplacesFilesOnlyWithForce) {
  WriteFileAtomically(folder_ / "a.pp", "mine");
  const testing::Outcome refused = testing::CallProgram(folder_, "landmarks convert in.csv a.pp");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("it exists"));
  EXPECT_EQ(ReadFileBytes(folder_ / "a.pp"), "mine");
  EXPECT_EQ(testing::CallProgram(folder_, "landmarks convert in.csv a.pp --force").code, 0);
}

TEST_F(LandmarkCommands, InputFilesAreNotReplacedEvenWithForce) {
  const std::string before = ReadFileBytes(folder_ / "in.csv");
  for (const char* arguments :
       {"convert in.csv ./in.csv --force",
        "propose skull.ply --reference other.ply in.csv --out in.csv --force",
        "propose skull.ply --compare in.csv --out in.csv --force"}) {
    const testing::Outcome refused =
        testing::CallProgram(folder_, std::string("landmarks ") + arguments);
    EXPECT_EQ(refused.code, 2) << arguments;
    EXPECT_THAT(refused.err, HasSubstr("in.csv: this file is read")) << arguments;
  }
  EXPECT_EQ(ReadFileBytes(folder_ / "in.csv"), before);
}

TEST_F(LandmarkCommands, WritesNothingIfANameIsNotASite) {
  WriteFileAtomically(folder_ / "odd.csv", "site,x,y,z\nF-1,1,2,3\ng,0,0,0\n");
  EXPECT_EQ(testing::CallProgram(folder_, "landmarks convert odd.csv out.yaml").code, 2);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out.yaml"));
  const testing::Outcome kept =
      testing::CallProgram(folder_, "landmarks convert odd.csv out.yaml --leave-out-unknown");
  EXPECT_EQ(kept.code, 0);
  EXPECT_THAT(kept.err, HasSubstr("left out: 'F-1'"));
}

TEST_F(LandmarkCommands, AProposalIsMarkedAndReplacesFilesOnlyWithForce) {
  const TriMesh skull = MakePhantom({.random_seed = 4, .rings = 40}).skull;
  WriteFileAtomically(folder_ / "skull.ply", EncodeMesh(skull, ".ply"));
  ASSERT_EQ(testing::CallProgram(folder_, "landmarks propose skull.ply --quiet").code, 0);
  const LandmarkReading reading = ReadLandmarks(folder_ / "out/skull_proposed.yaml");
  EXPECT_TRUE(reading.file.proposed);
  EXPECT_THAT(reading.notes, ::testing::Contains(HasSubstr("no person has confirmed")));
  const testing::Outcome again = testing::CallProgram(folder_, "landmarks propose skull.ply");
  EXPECT_EQ(again.code, 2);
  EXPECT_THAT(again.err, HasSubstr("it exists"));
}

TEST_F(LandmarkCommands, AProposalOnARasSkullIsTurnedIfTheFileCannotStateRasThorough) {
  TriMesh skull = MakePhantom({.random_seed = 4, .rings = 40}).skull;
  for (Vec3& p : skull.points) {
    p = ToLps(p, Axes::kRas);
  }
  WriteFileAtomically(folder_ / "ras.ply", EncodeMesh(skull, ".ply"));
  const testing::Outcome yaml =
      testing::CallProgram(folder_, "landmarks propose ras.ply --quiet --out ras.yaml");
  EXPECT_THAT(yaml.out, HasSubstr("mm, RAS"));
  const testing::Outcome slicer =
      testing::CallProgram(folder_, "landmarks propose ras.ply --quiet --out ras.mrk.json");
  EXPECT_THAT(slicer.out, HasSubstr("mm, LPS"));
  EXPECT_THAT(slicer.err, HasSubstr("turned to LPS"));
  const LandmarkFile a = ReadLandmarks(folder_ / "ras.yaml").file;
  const LandmarkFile b = ReadLandmarks(folder_ / "ras.mrk.json").file;
  ASSERT_EQ(a.landmarks.size(), b.landmarks.size());
  for (std::size_t k = 0; k < a.landmarks.size(); ++k) {
    EXPECT_EQ(a.landmarks[k].point, b.landmarks[k].point) << a.landmarks[k].site;
  }
}

}  // namespace
}  // namespace semblance::problems
