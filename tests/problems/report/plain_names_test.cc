// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/plain_names.h"

#include <gtest/gtest.h>

namespace semblance {
namespace {

TEST(PlainNames, AKeyBecomesWordsWithItsUnit) {
  EXPECT_EQ(WordsOfKey("dowel_rms_mm"), "RMS distance of the depth markers (mm)");
  EXPECT_EQ(WordsOfKey("some_new_count"), "some new count");
  EXPECT_EQ(WordsOfKey("some_new_area_cm2"), "some new area (cm²)");
  EXPECT_EQ(WordsOfKey("_mm"), " mm");
  EXPECT_EQ(WordsOfKey("eye_l"), "eye, left");
  EXPECT_EQ(WordsOfKey("_r"), " r");
  EXPECT_EQ(WordsOfMeasure("rms_mm"), "RMS distance (mm)");
  EXPECT_EQ(WordsOfMeasure("coverage_90"), "coverage_90");
}

TEST(PlainNames, AMetricKeepsThePathThatAStudyNamesItBy) {
  EXPECT_EQ(WordsOfMetric("face.rms_mm"), "RMS distance (mm) of the recovered face (face.rms_mm)");
  EXPECT_EQ(
      WordsOfMetric("face.regions.nose.p95_mm"),
      "95th percentile of the distance (mm) of the recovered face (face.regions.nose.p95_mm)");
  EXPECT_EQ(WordsOfMetric("identify.rank"), "identify.rank");
  EXPECT_EQ(WordsOfMetric("rms_mm"), "rms_mm");
}

TEST(PlainNames, ASiteIsCalledByItsNameAndSide) {
  EXPECT_EQ(WordsOfSite("go_l"), "Gonion, left (go_l)");
  EXPECT_EQ(WordsOfSite("g"), "Glabella (g)");
  EXPECT_EQ(WordsOfSite("no site <"), "no site <");
}

TEST(PlainNames, OneIsNoPlural) {
  EXPECT_EQ(Counted(1, "subject"), "1 subject");
  EXPECT_EQ(Counted(0, "subject"), "0 subjects");
  EXPECT_EQ(Counted(2, "trial is", "trials are"), "2 trials are");
}

}  // namespace
}  // namespace semblance
