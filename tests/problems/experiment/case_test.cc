// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/case.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "surfaces/base/atomic_file.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::WordsOf;

class SubjectMesh : public ::testing::Test {
 protected:
  // A file that states these axes; none if they are empty.
  std::filesystem::path Write(const std::string& axes) {
    const std::string comment = axes.empty() ? "" : "# 3D Slicer output. SPACE=" + axes + "\n";
    const std::filesystem::path path = folder_ / ("head" + axes + ".obj");
    WriteFileAtomically(path, comment + EncodeMesh(plate_, ".obj"));
    return path;
  }
  static FileSubject With(Axes axes) {
    FileSubject subject;
    subject.axes = axes;
    return subject;
  }
  // The second point, which is (10, 0, 0) in the file, and the notes.
  Vec3 Read(const std::string& stated, const FileSubject& subject) {
    notes_.clear();
    return ReadSubjectMesh(subject, Write(stated), notes_).points.at(1);
  }

  const TriMesh plate_ = testing::Plate(10, 1);
  const Vec3 as_written_ = plate_.points.at(1);
  const Vec3 turned_ = Vec3(-as_written_.x(), -as_written_.y(), as_written_.z());
  std::vector<std::string> notes_;
  testing::ScratchFolder folder_;
};

TEST_F(SubjectMesh, IsTurnedByTheAxesOfTheOptionOrOfTheFile) {
  EXPECT_EQ(Read("", {}), as_written_);
  EXPECT_EQ(Read("LPS", {}), as_written_);
  EXPECT_EQ(Read("", With(Axes::kRas)), turned_);
  EXPECT_EQ(Read("RAS", With(Axes::kRas)), turned_);
  EXPECT_THAT(notes_, IsEmpty()) << "what was asked for needs no note";
  EXPECT_EQ(Read("RAS", {}), turned_);
  EXPECT_THAT(notes_,
              ::testing::ElementsAre(
                  "headRAS.obj: the file states SPACE=RAS; turned to LPS (x and y negated)"));
  FileSubject centimetres;
  centimetres.units = LengthUnit::kCentimetre;
  EXPECT_EQ(Read("RAS", centimetres), 10 * turned_);
}

TEST_F(SubjectMesh, IsRefusedIfTheOptionContradictsTheFile) {
  EXPECT_THAT(WordsOf<InputError>([&] { Read("RAS", With(Axes::kLps)); }),
              HasSubstr("headRAS.obj: the file states SPACE=RAS, and subject.axes is LPS; leave"));
  EXPECT_THAT(WordsOf<InputError>([&] { Read("LPS", With(Axes::kRas)); }),
              HasSubstr("headLPS.obj: the file states SPACE=LPS, and subject.axes is RAS; leave"));
}

}  // namespace
}  // namespace semblance::problems
