// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/landmarks.h"
#include "problems/subject/landmark_files/read_landmarks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "tests/testing/scratch_file.h"

namespace semblance::problems {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::ScratchFile;
using testing::WordsOf;

constexpr char kGood[] = R"(subject: somebody
landmarks:
  - {site: g, point: [1, 2, 3], normal: [0, -0.8, 0.6], depth_along_normal_mm: 5.5, certainty: high}
  - {site: go_l, point: [60, 70, -80], depth_along_normal_mm: null, note: worn}
absent:
  - {site: iM2_r, reason: no mandible}
)";

std::string Complaints(const std::string& text) {
  return WordsOf<ConfigError>([&] { ReadLandmarks(ScratchFile(text)); });
}

TEST(LandmarkFile, ReadsWhatIsWritten) {
  const LandmarkFile file = ReadLandmarks(ScratchFile(kGood)).file;
  EXPECT_EQ(file.subject, "somebody");
  ASSERT_EQ(file.landmarks.size(), 2u);
  EXPECT_EQ(file.landmarks[0].site, "g");
  EXPECT_EQ(file.landmarks[0].point, (std::array<double, 3>{1, 2, 3}));
  EXPECT_EQ(file.landmarks[0].normal, (std::array<double, 3>{0, -0.8, 0.6}));
  EXPECT_EQ(file.landmarks[0].depth_along_normal_mm, 5.5);
  EXPECT_EQ(file.landmarks[0].certainty, Certainty::kHigh);
  EXPECT_FALSE(file.landmarks[1].normal.has_value());
  EXPECT_FALSE(file.landmarks[1].depth_along_normal_mm.has_value());
  EXPECT_EQ(file.landmarks[1].note, "worn");
  ASSERT_EQ(file.absent.size(), 1u);
  EXPECT_EQ(file.absent[0].reason, "no mandible");
}

TEST(LandmarkFile, RefusesUnknownUnitsAndAxes) {
  EXPECT_THAT(Complaints(std::string(kGood) + "units: feet\naxes: LAS\n"),
              AllOf(HasSubstr("units:"), HasSubstr("mm"), HasSubstr("axes:"), HasSubstr("RAS")));
}

TEST(LandmarkFile, ComesInMillimetresAndLps) {
  const LandmarkFile file =
      ReadLandmarks(
          ScratchFile("units: m\naxes: RAS\n"
                      "landmarks: [{site: g, point: [0.25, -0.5, 1], normal: [0.6, -0.8, 0], "
                      "depth_along_normal_mm: 5}]\n"))
          .file;
  const Landmark& g = file.landmarks.at(0);
  EXPECT_THAT(g.point, ElementsAre(-250, 500, 1000));
  EXPECT_THAT(*g.normal, ElementsAre(-0.6, 0.8, 0));
  EXPECT_EQ(g.depth_along_normal_mm, 5);
}

TEST(LandmarkFile, RefusesUnknownSites) {
  EXPECT_THAT(Complaints("landmarks: [{site: go_L, point: [1, 2, 3]}]\n"),
              HasSubstr("landmarks[0].site: unknown site 'go_L'; did you mean 'go_l'?"));
  EXPECT_THAT(Complaints("landmarks: [{site: go, point: [1, 2, 3]}]\n"),
              HasSubstr("site 'go' is on both sides; write 'go_l' or 'go_r'"));
  EXPECT_THAT(Complaints("landmarks: [{site: g, point: [1, 2, 3]}]\nabsent: [{site: rhii}]\n"),
              HasSubstr("absent[0].site: unknown site 'rhii'; did you mean 'rhi'?"));
}

TEST(LandmarkFile, RefusesRepeatedSites) {
  EXPECT_THAT(Complaints("landmarks: [{site: g, point: [1, 2, 3]}, {site: g, point: [1, 2, 4]}]\n"),
              HasSubstr("landmarks: site 'g' appears twice; keep one"));
  EXPECT_THAT(Complaints("landmarks: [{site: g, point: [1, 2, 3]}]\nabsent: [{site: g}]\n"),
              HasSubstr("absent: site 'g' appears twice in this file; keep one"));
}

TEST(LandmarkFile, RefusesNothingNoPointAndNoUnitNormal) {
  EXPECT_THAT(Complaints("subject: x\n"),
              HasSubstr("landmarks: the list is empty; place at least"));
  EXPECT_THAT(Complaints("landmarks: [{site: g}]\n"), HasSubstr("point: is missing"));
  EXPECT_THAT(Complaints("landmarks: [{site: g, point: [1, 2, 3], normal: [0, 0, 2]}]\n"),
              HasSubstr("normal: has the length 2; it must be 1, or leave the normal out"));
  EXPECT_THAT(Complaints("landmarks: [{site: g, point: [1, 2, 3], depth_closest_mm: 0}]\n"),
              HasSubstr("depth_closest_mm"));
}

}  // namespace
}  // namespace semblance::problems
