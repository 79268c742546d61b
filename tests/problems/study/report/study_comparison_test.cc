// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/report/study_comparison.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "problems/study/report/comparison_files.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;
using testing::WordsOf;

constexpr const char* kMetric = "face.rms_mm";
const CompareOptions kMatched{.metric = "", .better = {}, .pairs = ComparedPairs::kMatched};

// A study of the given treatments over subjects s0, s1, ...
NamedStudy Study(const std::string& name, const std::vector<std::string>& treatments, int subjects,
                 std::uint64_t random_seed) {
  Random random(random_seed);
  NamedStudy study{.name = name, .results = {}};
  study.results.metric = kMetric;
  study.results.axes = {"interp"};
  for (int s = 0; s < subjects; ++s) {
    for (const std::string& treatment : treatments) {
      TrialRow row{.id = fmt::format("{}{}", treatment, s),
                   .subject = fmt::format("s{}", s),
                   .values = {treatment},
                   .status = "done",
                   .reason = "",
                   .metrics = {{kMetric, 2 + random.Uniform()}, {"face.area_cm2", 300}}};
      study.results.trials.push_back(row);
    }
  }
  return study;
}

double Value(const NamedStudy& study, const std::string& treatment, const std::string& subject) {
  for (const TrialRow& row : study.results.trials) {
    if (row.subject == subject && row.values[0] == treatment) {
      return row.metrics.at(kMetric);
    }
  }
  return kNaN;
}

TEST(StudyComparison, TheDifferenceIsAMeanOverCommonSubjects) {
  const NamedStudy a = Study("a", {"x", "y"}, 9, 1), b = Study("b", {"x"}, 7, 2);
  const StudyComparison comparison = CompareStudies(std::vector{a, b}, kMatched);
  EXPECT_THAT(comparison.subjects, SizeIs(7));
  ASSERT_THAT(comparison.pairs, SizeIs(1));
  const TreatmentPair& pair = comparison.pairs[0];
  double sum = 0;
  int better = 0;
  for (int s = 0; s < 7; ++s) {
    const std::string subject = fmt::format("s{}", s);
    const double difference = Value(b, "x", subject) - Value(a, "x", subject);
    sum += difference;
    better += difference < 0 ? 1 : 0;
  }
  EXPECT_NEAR(pair.difference.mean, sum / 7, 1e-12);
  EXPECT_EQ(pair.better, better);
  EXPECT_EQ(pair.better + pair.worse, 7);
  EXPECT_TRUE(pair.same_label);
  EXPECT_THAT(comparison.notes,
              Contains(HasSubstr("a: left out because not all studies have them: 2 subjects")));
}

TEST(StudyComparison, UnusableTrialsAreNotComparedAndAreCounted) {
  const NamedStudy a = Study("a", {"x"}, 8, 1);
  NamedStudy b = Study("b", {"x"}, 8, 2);
  b.results.trials[3].status = "unusable";
  b.results.trials[3].metrics[kMetric] = 0;
  const StudyComparison comparison = CompareStudies(std::vector{a, b}, {});
  EXPECT_THAT(comparison.subjects, SizeIs(7));
  EXPECT_EQ(comparison.pairs[0].difference.n, 7);
  EXPECT_THAT(comparison.notes, Contains(HasSubstr("b: 1 of 8 trials not usable and left out")));
  EXPECT_THAT(comparison.notes, Not(Contains(HasSubstr("not finished"))));
}

TEST(StudyComparison, ACopyDoesNotDifferAndSwappingTurnsTheSign) {
  const NamedStudy a = Study("a", {"x", "y"}, 8, 1), b = Study("b", {"x", "y"}, 8, 2);
  NamedStudy copy = a;
  copy.name = "copy";
  for (const TreatmentPair& pair : CompareStudies(std::vector{a, copy}, kMatched).pairs) {
    EXPECT_EQ(pair.difference.mean, 0);
    EXPECT_EQ(pair.better + pair.worse, 0);
  }
  const auto there = CompareStudies(std::vector{a, b}, kMatched).pairs,
             back = CompareStudies(std::vector{b, a}, kMatched).pairs;
  for (const TreatmentPair& pair : there) {
    for (const TreatmentPair& other : back) {
      if (other.other.label == pair.other.label) {
        EXPECT_NEAR(other.difference.mean, -pair.difference.mean, 1e-12);
        EXPECT_NEAR(other.p_holm, pair.p_holm, 1e-12);
      }
    }
  }
}

// Three treatments of one study and one of another make six pairs, each once, and Holm's correction
// is for all of them.
TEST(StudyComparison, AllPairsAreComparedOnce) {
  const NamedStudy a = Study("a", {"x", "y", "z"}, 8, 1), b = Study("b", {"y"}, 8, 2);
  const StudyComparison comparison = CompareStudies(std::vector{a, b}, {});
  ASSERT_THAT(comparison.pairs, SizeIs(6));
  EXPECT_TRUE(comparison.pairs[0].same_label) << "the same label comes first";
  std::set<std::string> pairs;
  std::vector<double> p;
  for (const TreatmentPair& pair : comparison.pairs) {
    const std::string one = pair.reference.study + pair.reference.label,
                      other = pair.other.study + pair.other.label;
    pairs.insert(std::min(one, other) + std::max(one, other));
    EXPECT_NEAR(pair.difference.mean, pair.other.summary.mean - pair.reference.summary.mean, 1e-12);
    p.push_back(pair.test.p);
  }
  EXPECT_THAT(pairs, ElementsAre("axay", "axaz", "axby", "ayaz", "ayby", "azby"));
  const std::vector<double> adjusted = Holm(p);
  for (std::size_t k = 0; k < p.size(); ++k) {
    EXPECT_DOUBLE_EQ(comparison.pairs[k].p_holm, adjusted[k]);
  }
  EXPECT_THAT(CompareStudies(std::vector{a}, {}).pairs, SizeIs(3)) << "one study suffices";
}

TEST(StudyComparison, MeansOverDifferentSubjectsAreReported) {
  const NamedStudy a = Study("a", {"x"}, 8, 1);
  NamedStudy b = Study("b", {"x", "y"}, 8, 2);
  EXPECT_THAT(CompareStudies(std::vector{a, b}, {}).notes,
              Not(Contains(HasSubstr("different subjects"))));
  b.results.trials[3].status = "failed";  // y of s1
  const StudyComparison comparison = CompareStudies(std::vector{a, b}, {});
  EXPECT_THAT(comparison.notes, Contains(HasSubstr("the means are over different subjects")));
  EXPECT_THAT(ComparisonText(comparison), HasSubstr("(over 7 of 8 subjects)"));
}

// Eight subjects give 1/128 at best: enough for 6 pairs, not for 10.
TEST(StudyComparison, ACorrectionThatNoResultCanPassIsReported) {
  const auto notes = [](const std::vector<std::string>& treatments) {
    return CompareStudies(std::vector{Study("a", treatments, 8, 1)}, {}).notes;
  };
  EXPECT_THAT(notes({"x", "y", "z", "w"}), Not(Contains(HasSubstr("smallest possible"))));
  EXPECT_THAT(
      notes({"x", "y", "z", "w", "v"}),
      Contains(AllOf(HasSubstr("below 0.0078"), HasSubstr("smallest possible p is 0.078"))));
}

TEST(StudyComparison, TooManyPairsAreRefused) {
  std::vector<std::string> labels;
  for (int k = 0; k < 101; ++k) {
    labels.push_back(fmt::format("t{}", k));
  }
  const NamedStudy a = Study("a", labels, 1, 1);
  EXPECT_THAT(WordsOf<InputError>([&] { CompareStudies(std::vector{a}, {}); }),
              HasSubstr("101 treatments make 5050 pairs"));
}

TEST(StudyComparison, AnUnknownLabelIsComparedWithTheBestOfTheFirst) {
  const NamedStudy a = Study("a", {"x", "y", "z"}, 8, 1), b = Study("b", {"other"}, 8, 2);
  const StudyComparison comparison = CompareStudies(std::vector{a, b}, kMatched);
  ASSERT_THAT(comparison.pairs, SizeIs(1));
  EXPECT_FALSE(comparison.pairs[0].same_label);
  for (const ComparedTreatment& treatment : comparison.treatments) {
    if (treatment.study == "a") {
      EXPECT_LE(comparison.pairs[0].reference.summary.mean, treatment.summary.mean);
    }
  }
}

// One trial of each treatment, and of one of them it failed.
TEST(StudyComparison, APairWithNoSubjectInCommonIsReported) {
  const NamedStudy a = Study("a", {"x", "y"}, 1, 1);
  NamedStudy b = a;
  b.name = "b";
  b.results.trials[1].status = "failed";
  b.results.trials[1].metrics.clear();
  const std::string text = ComparisonText(CompareStudies(std::vector{b, a}, {}));
  EXPECT_THAT(text, HasSubstr("a: y minus b: y: no subject was done with both"));
  EXPECT_THAT(text, Not(HasSubstr("nan")));
}

TEST(StudyComparison, BelowSixSubjectsThereIsNoTest) {
  const StudyComparison comparison =
      CompareStudies(std::vector{Study("a", {"x"}, 5, 1), Study("b", {"x"}, 5, 2)}, {});
  EXPECT_TRUE(std::isnan(comparison.pairs[0].p_holm));
  EXPECT_TRUE(std::isnan(comparison.pairs[0].test.p));
  EXPECT_THAT(PairsCsv(comparison), ::testing::EndsWith(",,\n"));  // neither p nor p_holm
}

TEST(StudyComparison, IncomparableStudiesAreRefused) {
  const NamedStudy a = Study("a", {"x"}, 3, 1);
  NamedStudy b = Study("b", {"x"}, 3, 2);
  EXPECT_THAT(WordsOf<InputError>([&] { CompareStudies(std::vector{a}, kMatched); }),
              HasSubstr("one study alone"));
  EXPECT_THAT(WordsOf<InputError>([&] { CompareStudies(std::vector<NamedStudy>(), {}); }),
              HasSubstr("one study alone"));
  EXPECT_THAT(WordsOf<InputError>([&] {
                CompareStudies(std::vector{a, b}, {.metric = "face.nothing", .better = {}});
              }),
              HasSubstr("a: no finished trial has the number 'face.nothing'"));
  b.results.trials[0].metrics["face.area_cm2"] = 200;
  EXPECT_THAT(CompareStudies(std::vector{a, b}, {}).notes,
              Contains(HasSubstr("not measured on the same area")));
  for (TrialRow& row : b.results.trials) {
    row.subject += "'";
  }
  EXPECT_THAT(WordsOf<InputError>([&] {
                CompareStudies(std::vector{a, b}, {});
              }),
              HasSubstr("no subject in common"));
}

// A metric with higher better gives the results of its negative with lower better.
TEST(StudyComparison, HigherIsBetterReversesTheOrder) {
  constexpr const char* kShare = "face.within_2_5mm";
  NamedStudy a = Study("a", {"x", "y", "z"}, 8, 1), b = Study("b", {"y", "other"}, 8, 2);
  for (NamedStudy* study : {&a, &b}) {
    for (TrialRow& row : study->results.trials) {
      row.metrics[kShare] = 1 - 0.1 * row.metrics[kMetric];
      row.metrics["negative"] = -row.metrics[kShare];
    }
  }
  const auto by = [&](const char* metric) {
    return CompareStudies(std::vector{a, b},
                          {.metric = metric, .better = {}, .pairs = ComparedPairs::kMatched});
  };
  const StudyComparison share = by(kShare), negative = by("negative");
  EXPECT_EQ(share.preference.better, Better::kHigher);
  EXPECT_EQ(negative.preference.better, Better::kLower);
  ASSERT_THAT(share.pairs, SizeIs(2));
  for (std::size_t k = 0; k < share.pairs.size(); ++k) {
    const TreatmentPair &x = share.pairs[k], &y = negative.pairs[k];
    EXPECT_EQ(x.other.label, y.other.label);
    EXPECT_EQ(x.reference.label, y.reference.label);
    EXPECT_NEAR(x.difference.mean, -y.difference.mean, 1e-12);
    EXPECT_EQ(x.better, y.better);
    EXPECT_EQ(x.worse, y.worse);
    EXPECT_NEAR(x.p_holm, y.p_holm, 1e-12);
  }
  EXPECT_GE(share.treatments[0].summary.mean, share.treatments[1].summary.mean);
  EXPECT_THAT(ComparisonText(share),
              HasSubstr("face.within_2_5mm over 8 subjects; higher is better"));
  EXPECT_THAT(ComparisonText(negative), HasSubstr("lower is better"));
}

// Errors of both signs, and shares on both sides of the stated share, do not cancel.
TEST(StudyComparison, SignedErrorsAndCoverageAreBestNearestToTheirTarget) {
  NamedStudy a = Study("a", {"bold", "right"}, 8, 1), b = Study("b", {"right"}, 8, 2);
  for (NamedStudy* study : {&a, &b}) {
    for (std::size_t n = 0; n < study->results.trials.size(); ++n) {
      TrialRow& row = study->results.trials[n];
      const double off = row.values[0] == "right" ? 0.02 : n % 4 == 0 ? -0.3 : 0.1;
      row.metrics["depth_truth.closest.coverage_90"] = 0.9 + off;
      row.metrics["depth_truth.closest.mean_signed_mm"] = 10 * off;
    }
  }
  const auto by = [&](const char* metric) {
    return CompareStudies(std::vector{a, b},
                          {.metric = metric, .better = {}, .pairs = ComparedPairs::kMatched});
  };
  const StudyComparison share = by("depth_truth.closest.coverage_90"),
                        error = by("depth_truth.closest.mean_signed_mm");
  EXPECT_EQ(share.preference.better, Better::kNearest);
  EXPECT_EQ(share.treatments[0].label, "right");  // the lower mean is bold's
  EXPECT_EQ(error.treatments[0].label, "right");
  EXPECT_NEAR(share.pairs[0].difference.mean, 0, 1e-12);
  EXPECT_THAT(ComparisonText(share), HasSubstr("nearest to 0.9 is better"));
  EXPECT_THAT(ComparisonText(error), HasSubstr("nearest to 0 is better"));
}

TEST(StudyComparison, ContradictingDirectionsNeedAChoice) {
  NamedStudy a = Study("a", {"x"}, 8, 1), b = Study("b", {"x"}, 8, 2);
  a.results.preference.better = Better::kHigher;
  EXPECT_THAT(WordsOf<InputError>([&] {
                CompareStudies(std::vector{a, b}, {});
              }),
              AllOf(HasSubstr("higher values are better in a"), HasSubstr("--better")));
  EXPECT_EQ(
      CompareStudies(std::vector{a, b}, {.metric = "", .better = Better::kLower}).preference.better,
      Better::kLower);
  b.results.preference.better = Better::kHigher;
  EXPECT_EQ(CompareStudies(std::vector{a, b}, {}).preference.better, Better::kHigher);
  b.results.preference.better = Better::kLower;
  b.results.metric = "face.mean_abs_mm";  // another metric than the compared one
  EXPECT_EQ(CompareStudies(std::vector{a, b}, {}).preference.better, Better::kHigher);
}

TEST(StudyComparison, NamesAreTheShortestDistinctPathEnds) {
  const testing::ScratchFolder folder;
  const std::string plan =
      R"({"title": "t", "hash": "0", "metric": "m", "axes": [], "trials": [], "notes": []})";
  for (const char* name : {"one/out", "two/out", "two/other"}) {
    std::filesystem::create_directories(folder / name);
    WriteFileAtomically(folder / name / "plan.json", plan);
  }
  const auto names = [&](const std::vector<std::filesystem::path>& folders) {
    std::vector<std::string> called;
    for (const NamedStudy& study : ReadStudies(folders)) {
      called.push_back(study.name);
    }
    return called;
  };
  EXPECT_THAT(names({folder / "one/out", folder / "two/other/"}), ElementsAre("out", "other"));
  EXPECT_THAT(names({folder / "one/out", folder / "two/out"}), ElementsAre("one/out", "two/out"));
  EXPECT_THAT(WordsOf<InputError>([&] {
                names({folder / "one/out", folder / "one/../one/out"});
              }),
              HasSubstr("appears twice"));
}

TEST(ComparisonFiles, TheTablesHoldEveryPairAndValue) {
  const StudyComparison comparison =
      CompareStudies(std::vector{Study("a", {"x", "y"}, 8, 1), Study("b", {"x", "y"}, 8, 2)}, {});
  const std::string pairs = PairsCsv(comparison), values = ComparedCsv(comparison);
  EXPECT_EQ(std::count(pairs.begin(), pairs.end(), '\n'), 1 + 6);
  EXPECT_EQ(std::count(values.begin(), values.end(), '\n'), 1 + 2 * 2 * 8);
  const testing::ScratchFolder folder;
  OutputFolder output(folder / "out", WhenNotEmpty::kRefuse);
  WriteComparison(comparison, output);
  EXPECT_THAT(ReadFileBytes(folder / "out" / "report.html"), HasSubstr("a, b compared"));
  EXPECT_THAT(ComparisonText(comparison), HasSubstr("b: x minus a: x: "));
}

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
TEST(RankAgreement, IsSpearmansOfTheMeansOverEachStudysSubjects) {
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

// The direction comes from the studies or from the caller, and the text states it.
TEST(RankAgreement, UsesTheDirectionOfTheStudies) {
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
}  // namespace semblance::problems
