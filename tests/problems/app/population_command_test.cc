// SPDX-License-Identifier: GPL-3.0-or-later
// The command population, called as a program: its output and exit code.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "problems/subject/phantom.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "tests/testing/program_call.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class PopulationCommand : public ::testing::Test {
 protected:
  testing::Outcome Call(const std::string& arguments) {
    return testing::CallProgram(folder_, "population " + arguments + " --quiet");
  }

  void WriteCrowd(const std::string& name, const std::string& title, int count) {
    WriteFileAtomically(folder_ / name,
                        fmt::format("title: {}\nphantoms: {{count: {}, like: {{rings: 16}}}}\n"
                                    "measure: {{dense: {{columns: 8, rows: 8, modes: 0}}}}\n",
                                    title, count));
  }

  // Folders that cannot be measured.
  void WriteHeadsWithoutSkin(int count) {
    for (int k = 1; k <= count; ++k) {
      const Phantom phantom =
          MakePhantom({.random_seed = static_cast<std::uint64_t>(k), .rings = 16});
      const fs::path head = folder_ / "heads" / ("s" + std::to_string(k));
      fs::create_directories(head);
      WriteFileAtomically(head / "skull.ply", EncodeMesh(phantom.skull, ".ply"));
    }
  }

  testing::ScratchFolder folder_;
};

TEST_F(PopulationCommand, TooFewSubjectsAreNotUsableAndEachFailureIsPrinted) {
  WriteHeadsWithoutSkin(3);
  const testing::Outcome outcome = Call("heads --out out");
  EXPECT_EQ(outcome.code, 1) << outcome.err;
  for (const char* name : {"s1", "s2", "s3"}) {
    EXPECT_THAT(outcome.out,
                HasSubstr(fmt::format("failed: {}: it has a skull and no skin", name)));
  }
  EXPECT_THAT(outcome.out, HasSubstr("no table: heads: 0 subjects are measured (3 failed"));
  EXPECT_THAT(ReadFileBytes(folder_ / "out/subjects.csv"),
              HasSubstr(",failed,it has a skull and no skin"));
  EXPECT_FALSE(fs::exists(folder_ / "out/table.yaml"));
}

TEST_F(PopulationCommand, AShardPrintsItsOwnFailuresEachTime) {
  WriteHeadsWithoutSkin(3);
  for (const char* call : {"first", "again, when they are there already"}) {
    const testing::Outcome outcome = Call("heads --out out --shard 0/2");
    EXPECT_EQ(outcome.code, 1) << call;
    EXPECT_THAT(outcome.out, AllOf(HasSubstr("failed: s1: "), HasSubstr("failed: s3: "))) << call;
    EXPECT_THAT(outcome.out, Not(HasSubstr("s2"))) << call;
  }
}

TEST_F(PopulationCommand, ListPrintsSkippedFolders) {
  WriteHeadsWithoutSkin(1);
  fs::create_directories(folder_ / "heads/scans");
  const testing::Outcome outcome = Call("heads --list");
  EXPECT_EQ(outcome.code, 0);
  EXPECT_THAT(outcome.out, HasSubstr("note: scans: skipped"));
  EXPECT_THAT(outcome.out, HasSubstr("1 subjects"));
}

TEST_F(PopulationCommand, ContinuesInItsFolderAndReplacesOtherFilesOnlyWithForce) {
  WriteCrowd("three.yaml", "three", 3);
  WriteCrowd("four.yaml", "four", 4);
  EXPECT_EQ(Call("three.yaml --out out").code, 0);
  EXPECT_EQ(Call("three.yaml --out out").code, 0);
  const std::string table = ReadFileBytes(folder_ / "out/table.yaml");
  const testing::Outcome other = Call("four.yaml --out out");
  EXPECT_EQ(other.code, 2);
  EXPECT_THAT(other.err, HasSubstr("another population, 'three'"));
  EXPECT_EQ(ReadFileBytes(folder_ / "out/table.yaml"), table);
  fs::create_directories(folder_ / "foreign");
  WriteFileAtomically(folder_ / "foreign/report.html", "mine");
  EXPECT_EQ(Call("three.yaml --out foreign").code, 2);
  EXPECT_EQ(ReadFileBytes(folder_ / "foreign/report.html"), "mine");
  const testing::Outcome forced = Call("three.yaml --out foreign --force --from out");
  EXPECT_EQ(forced.code, 0) << forced.err;
  EXPECT_THAT(forced.out, HasSubstr("from out: 3 taken; it has 3 of the 3 subjects"));
  EXPECT_EQ(ReadFileBytes(folder_ / "foreign/table.yaml"), table);
}

// Input files are never replaced, with --force or without.
TEST_F(PopulationCommand, NeverReplacesTheSubjectsCsvThatItReads) {
  WriteHeadsWithoutSkin(3);
  WriteFileAtomically(folder_ / "heads/subjects.csv", "name,bmi\ns1,20\n");
  const testing::Outcome outcome = Call("heads --out heads --force");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("input files are never replaced"));
  EXPECT_EQ(ReadFileBytes(folder_ / "heads/subjects.csv"), "name,bmi\ns1,20\n");
}

TEST_F(PopulationCommand, RefusesToGatherFromAMissingFolder) {
  WriteCrowd("three.yaml", "three", 3);
  const testing::Outcome outcome = Call("three.yaml --out out --from nowhere");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("nowhere: the folder does not exist"));
}

}  // namespace
}  // namespace semblance::problems
