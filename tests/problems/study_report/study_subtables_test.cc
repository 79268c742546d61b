// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study_report/study_subtables.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tuple>

#include "problems/study_report/study_ranking.h"

namespace semblance {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

// Two treatments on one subject; "wide" has the larger share and the larger error.
StudyResults Results(bool higher) {
  StudyResults results{.title = "t",
                       .hash = "h",
                       .metric = higher ? "face.within_2_5mm" : "face.rms_mm",
                       .axes = {"interp"},
                       .trials = {},
                       .notes = {}};
  results.preference = PreferenceFor(results.metric);
  for (const auto& [label, share, rms] :
       {std::tuple("narrow", 0.5, 1.5), std::tuple("wide", 0.9, 2.5)}) {
    results.trials.push_back({.id = label,
                              .subject = "s",
                              .values = {label},
                              .status = "done",
                              .reason = "",
                              .metrics = {{"face.within_2_5mm", share},
                                          {"face.rms_mm", rms},
                                          {"face.regions.nose.within_2_5mm", share},
                                          {"face.regions.nose.rms_mm", rms}}});
  }
  return results;
}

TEST(StudySubtables, AMetricThatIsBetterHigherStandsThereAndSaysSo) {
  const StudyResults results = Results(true);
  const auto tables = Subtables(results, Ranked(results));
  ASSERT_EQ(tables.size(), 2u);
  EXPECT_THAT(tables[0].caption, HasSubstr("lower is better"));
  EXPECT_THAT(tables[0].header,
              ElementsAre("treatment", HasSubstr("higher is better"), "RMS (mm)"));
  EXPECT_THAT(tables[0].rows[0], ElementsAre("wide", "0.900", "2.500")) << "the best comes first";
  EXPECT_THAT(tables[1].caption, HasSubstr("higher is better"));
  EXPECT_THAT(tables[1].rows[0], ElementsAre("wide", "0.900"));
}

TEST(StudySubtables, AnErrorStandsOnce) {
  const StudyResults results = Results(false);
  const auto tables = Subtables(results, Ranked(results));
  ASSERT_EQ(tables.size(), 2u);
  EXPECT_THAT(tables[0].header, ElementsAre("treatment", "RMS (mm)"));
  EXPECT_THAT(tables[0].rows[0], ElementsAre("narrow", "1.500"));
  EXPECT_THAT(tables[1].caption, Not(HasSubstr("better")));
}

}  // namespace
}  // namespace semblance
