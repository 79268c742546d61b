// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/compare/rank_agreement.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

// values[treatment][subject]; the treatments are called t0, t1, ...
NamedStudy Study(const std::string& name, const std::string& subjects,
                 const std::vector<std::vector<double>>& values) {
  NamedStudy study{.name = name, .results = {}, .folder = "out/" + name};
  study.results.metric = "face.rms_mm";
  study.results.axes = {"interp"};
  for (std::size_t t = 0; t < values.size(); ++t) {
    for (std::size_t s = 0; s < values[t].size(); ++s) {
      study.results.trials.push_back({.id = fmt::format("{}{}", t, s),
                                      .subject = fmt::format("{}{}", subjects, s),
                                      .values = {fmt::format("t{}", t)},
                                      .status = "done",
                                      .reason = "",
                                      .metrics = {{"face.rms_mm", values[t][s]}}});
    }
  }
  return study;
}

// Differences of ranks 1, 1, 0, 0: 1 - 6 * 2 / (4 * 15).
TEST(RankAgreement, IsSpearmansOverTheMeansOfEachStudysOwnSubjects) {
  const NamedStudy heads = Study("heads", "head ", {{1, 2}, {2, 3}, {3, 4}, {4, 5}}),
                   phantoms = Study("phantoms", "phantom ", {{0.2}, {0.1}, {0.3}, {0.4}});
  const RankAgreement agreement = CompareRanks(heads, phantoms, {});
  EXPECT_NEAR(agreement.spearman, 0.8, 1e-12);
  ASSERT_EQ(agreement.treatments.size(), 4u);
  EXPECT_EQ(agreement.treatments[0].label, "t0");
  EXPECT_EQ(agreement.treatments[0].reference_mean, 1.5);
  EXPECT_EQ(agreement.treatments[0].rank, 2);
  EXPECT_THAT(RankText(agreement), ::testing::HasSubstr("over 4 treatments: 0.80"));
}

// The second subject lacks t2: its other values, which would turn the order round, do not count.
TEST(RankAgreement, TakesOnlySubjectsThatHaveAllTreatments) {
  const NamedStudy heads = Study("heads", "head ", {{1}, {2}, {3}}),
                   phantoms = Study("phantoms", "phantom ", {{1, 9}, {2, 0}, {3}});
  EXPECT_NEAR(CompareRanks(heads, phantoms, {}).spearman, 1, 1e-12);
}

// As the studies took the metric, or as the caller says; and it is told.
TEST(RankAgreement, RanksByWhatTheStudiesTookAsBetter) {
  NamedStudy a = Study("a", "s", {{1}, {2}, {3}}), b = Study("b", "s", {{4}, {2}, {3}});
  EXPECT_EQ(CompareRanks(a, b, {}).treatments[0].label, "t0");
  EXPECT_THAT(RankText(CompareRanks(a, b, {})), ::testing::HasSubstr("; lower is better\n"));
  a.results.preference.better = b.results.preference.better = Better::kHigher;
  const RankAgreement agreement = CompareRanks(a, b, {});
  EXPECT_EQ(agreement.treatments[0].label, "t2");
  EXPECT_EQ(agreement.treatments[2].rank, 1);
  EXPECT_THAT(RankText(agreement), ::testing::HasSubstr("; higher is better\n"));
  EXPECT_EQ(CompareRanks(a, b, {.metric = "", .better = Better::kLower}).treatments[0].label, "t0");
  b.results.preference.better = Better::kLower;
  EXPECT_THROW(CompareRanks(a, b, {}), InputError);
}

TEST(RankAgreement, RefusesTwoTreatments) {
  const NamedStudy a = Study("a", "s", {{1}, {2}, {3}}), b = Study("b", "s", {{1}, {2}});
  EXPECT_THAT([&] { CompareRanks(a, b, {}); },
              ::testing::ThrowsMessage<InputError>(
                  ::testing::StartsWith("out/a and out/b have too few treatments")));
}

}  // namespace
}  // namespace semblance
