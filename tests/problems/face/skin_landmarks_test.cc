// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/skin_landmarks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "problems/face/head_formula.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class SkinLandmarkFiles : public ::testing::Test {
 protected:
  std::filesystem::path File(const std::string& name, const std::string& text) const {
    WriteFileAtomically(folder_ / name, text);
    return folder_ / name;
  }
  static SkinLandmarks Read(const std::vector<std::filesystem::path>& files) {
    return ReadSkinLandmarks(files);
  }
  static std::string FaultOf(const std::vector<std::filesystem::path>& files) {
    try {
      Read(files);
    } catch (const Error& error) {
      return error.what();
    }
    return "accepted";
  }
  testing::ScratchFolder folder_;
};

TEST_F(SkinLandmarkFiles, ATableOfSitesIsReadByTheNamesOfItsColumns) {
  const SkinLandmarks read =
      Read({File("a.csv", "note,site,z_mm,y_mm,x_mm\nhere,g,3,2,1\n,prn,6,5,4\n"),
            File("b.csv", "site,x,y,z\nzy_l,7,8,9\n")});
  ASSERT_EQ(read.points.size(), 3);
  EXPECT_EQ(read.points[0].code, "g");
  EXPECT_EQ(read.points[0].point, Vec3(1, 2, 3));
  EXPECT_EQ(read.points[1].point, Vec3(4, 5, 6));
  EXPECT_EQ(read.points[2].code, "zy_l");
  EXPECT_THAT(read.notes, IsEmpty());
}

TEST_F(SkinLandmarkFiles, ATablesEndingMayBeInCapitals) {
  const SkinLandmarks read = Read({File("68.CSV", "i_multipie,x,y,z\n31,1,2,3\n")});
  ASSERT_EQ(read.points.size(), 1);
  EXPECT_EQ(read.points[0].code, "prn");
}

TEST_F(SkinLandmarkFiles, PointsOfMultiPieWithAPlaceOnTheGenericHeadAreUsed) {
  const SkinLandmarks read =
      Read({File("68.csv", "i_multipie,x,y,z\n1,9,9,9\n31,1,2,3\n49,4,5,6\n")});
  ASSERT_EQ(read.points.size(), 2);
  EXPECT_EQ(read.points[0].code, "prn");
  EXPECT_EQ(read.points[1].code, "ch_r");
  EXPECT_EQ(read.points[1].point, Vec3(4, 5, 6));
}

TEST_F(SkinLandmarkFiles, LandmarksOfASkullGoOutByTheirDepth) {
  const SkinLandmarks read =
      Read({File("a.yaml",
                 "landmarks:\n"
                 "  - {site: g, point: [0, 1, 0], normal: [0, -1, 0], "
                 "depth_along_normal_mm: 5, depth_closest_mm: 4}\n"
                 "  - {site: zy_l, point: [70, 0, 0], normal: [1, 0, 0], "
                 "depth_closest_mm: 7}\n"
                 "  - {site: me, point: [0, 0, -90], normal: [0, 0, -1]}\n")});
  ASSERT_EQ(read.points.size(), 1);
  EXPECT_EQ(read.points[0].point, Vec3(0, -4, 0));
  // A depth to the closest skin has no direction.
  EXPECT_THAT(read.notes, ElementsAre(AllOf(HasSubstr("zy_l"), HasSubstr("left out")),
                                      AllOf(HasSubstr("me"), HasSubstr("left out"))));
}

TEST_F(SkinLandmarkFiles, WithoutAnyDepthThePointsAreTheSkins) {
  const SkinLandmarks read =
      Read({File("a.yaml", "landmarks:\n  - {site: g, point: [1, 2, 3]}\n")});
  ASSERT_EQ(read.points.size(), 1);
  EXPECT_EQ(read.points[0].point, Vec3(1, 2, 3));
}

TEST_F(SkinLandmarkFiles, PointsPickedInAProgramAreRead) {
  const SkinLandmarks read = Read({File("a.txt", "glabella,1,2,3\nleft zygion,70,5,6\n")});
  ASSERT_GE(read.points.size(), 1);
  EXPECT_EQ(read.points[0].code, "g");
  EXPECT_EQ(read.points[0].point, Vec3(1, 2, 3));
}

TEST_F(SkinLandmarkFiles, FaultsAreReportedWithTheirPlace) {
  EXPECT_THAT(FaultOf({File("a.csv", "site,x,y,z\nnose,1,2,3\n")}),
              AllOf(HasSubstr("a.csv:2"), HasSubstr("'nose'"), HasSubstr("prn")));
  EXPECT_THAT(
      FaultOf({File("a.csv", "site,x,y,z\ng,1,2,3\n"), File("b.csv", "site,x,y,z\ng,1,2,3\n")}),
      HasSubstr("'g' appears twice"));
  EXPECT_THAT(FaultOf({File("a.csv", "i_multipie,x,y,z\n69,1,2,3\n")}), HasSubstr("1 to 68"));
  EXPECT_THAT(FaultOf({File("a.csv", "site,x,y\ng,1,2\n")}), HasSubstr("'z'"));
  EXPECT_THAT(FaultOf({File("a.csv", "site,x,y,z\n")}), HasSubstr("no landmark"));
  EXPECT_THAT(FaultOf({folder_ / "none.csv"}), HasSubstr("none.csv"));
}

TEST(FacialLandmarks, StandWhereTheirNamesSay) {
  const auto at = [](const std::string& code) {
    const Vec2 uv = UvOnGenericHead(code);
    return HeadPoint(uv.x(), uv.y());
  };
  for (double v = 0.2; v < 0.8; v += 0.01) {
    EXPECT_GE(HeadPoint(0.5, v).y(), at("prn").y() - 0.02) << "the tip is foremost, " << v;
  }
  const std::vector<std::string> downward = {"n", "prn", "sn", "ls", "sto", "li", "pg"};
  for (std::size_t k = 1; k < downward.size(); ++k) {
    EXPECT_LT(at(downward[k]).z(), at(downward[k - 1]).z()) << downward[k];
  }
  EXPECT_LT(at("en_l").x(), at("ex_l").x());
  EXPECT_LT(at("sbal_l").x(), at("en_l").x());
  for (const std::string& code : FacialLandmarkCodes()) {
    if (code.ends_with("_l")) {
      const Vec2 left = UvOnGenericHead(code),
                 right = UvOnGenericHead(code.substr(0, code.size() - 1) + "r");
      EXPECT_EQ(right, Vec2(1 - left.x(), left.y())) << code;
    }
  }
  EXPECT_THROW(UvOnGenericHead("nose"), InputError);
}

}  // namespace
}  // namespace semblance::problems
