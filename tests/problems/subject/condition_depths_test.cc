// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/condition_depths.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "problems/config/config.h"
#include "problems/experiment/case.h"
#include "problems/experiment/experiment_config.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "tests/testing/scratch_file.h"

namespace semblance::problems {
namespace {

std::vector<std::string> AllSites() {
  std::vector<std::string> sites = StandardSiteCodes();
  for (const Site& site : FurtherSites()) {
    sites.push_back(site.code);
  }
  sites.emplace_back("bmi");
  return sites;
}

double Least(const Eigen::MatrixXd& matrix) {
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(matrix).eigenvalues().minCoeff();
}

// Each part of the model is a kernel, so the least eigenvalue is at least the part `own`.
TEST(ModelledCorrelation, IsPositiveDefiniteForAllSites) {
  for (const SiteCorrelation& o :
       {SiteCorrelation{}, SiteCorrelation{.common = 0, .twins = 0.99, .own = 0.01},
        SiteCorrelation{.common = 0.9, .twins = 0, .own = 0.01, .length_mm = 500}}) {
    EXPECT_GE(Least(ModelledCorrelation(o, AllSites())), o.own - 1e-9);
  }
}

TEST(ModelledCorrelation, IsHighestForTwinsAndNeighbours) {
  const std::vector<std::string> sites = {"zy_l", "zy_r", "lo_l", "me", "bmi"};
  const Eigen::MatrixXd r = ModelledCorrelation({}, sites);
  EXPECT_GT(r(0, 1), r(0, 3));
  EXPECT_GT(r(0, 2), r(0, 3));
  EXPECT_GT(r(0, 2), r(1, 2));
  EXPECT_EQ(r(0, 4), 0);
  EXPECT_TRUE(r.diagonal().isOnes());
}

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::ScratchFile;
using testing::WordsOf;

constexpr char kTTable[] = SEMBLANCE_SOURCE_DIR "/configs/tables/t_table_2023.yaml";
constexpr char kRhine[] = SEMBLANCE_SOURCE_DIR "/configs/tables/rhine_caucasoid.yaml";

TissueOptions FromTTable() {
  TissueOptions options;
  options.table = kTTable;
  return options;
}

std::vector<Dowel> Dowels(const std::vector<std::string>& sites) {
  std::vector<Dowel> dowels;
  for (const std::string& site : sites) {
    dowels.emplace_back().site = site;
  }
  return dowels;
}

struct Filled {
  std::vector<Dowel> dowels;
  std::vector<std::string> notes;
};

Filled Fill(const TissueOptions& options, const LandmarkFile& file = {}) {
  Filled filled{Dowels({"g", "n", "pg", "go_l", "go_r", "zy_l", "zy_r"}), {}};
  FillDepths(options, file, filled.dowels);
  filled.notes = ConditionDepths(options, file, filled.dowels);
  return filled;
}

const Dowel& At(const Filled& filled, const std::string& site) {
  return *std::ranges::find(filled.dowels, site, &Dowel::site);
}

TEST(ConditionDepths, DoesNothingIfNothingIsGiven) {
  const Filled plain = Fill(FromTTable());
  EXPECT_EQ(At(plain, "g").depth_mm, 5.5);
  EXPECT_EQ(At(plain, "g").sd_mm, 1);
  EXPECT_TRUE(plain.notes.empty());
}

TEST(ConditionDepths, KeepsAKnownDepthAndMovesTheOthers) {
  TissueOptions options = FromTTable();
  options.given.depths_mm = {{"go_l", 20.0}};
  const Filled given = Fill(options), plain = Fill(FromTTable());
  EXPECT_EQ(At(given, "go_l").depth_mm, 20);
  EXPECT_EQ(At(given, "go_l").sd_mm, 0);
  for (const Dowel& dowel : given.dowels) {
    if (dowel.site != "go_l") {
      EXPECT_GT(dowel.depth_mm, At(plain, dowel.site).depth_mm) << dowel.site;
      EXPECT_LT(dowel.sd_mm, At(plain, dowel.site).sd_mm) << dowel.site;
    }
  }
  EXPECT_GT(At(given, "go_r").depth_mm, 15);  // its twin, most of all
  EXPECT_THAT(given.notes, Contains(HasSubstr("go_l 20")));
}

TEST(ConditionDepths, APairsCodeMeansBothSidesAndAnErrorLoosensTheDepth) {
  TissueOptions options = FromTTable();
  options.given.depths_mm = {{"zy", 12.0}};
  options.given.error_mm = 1;
  const Filled given = Fill(options);
  EXPECT_NEAR(At(given, "zy_l").depth_mm, At(given, "zy_r").depth_mm, 1e-12);
  EXPECT_LT(At(given, "zy_l").depth_mm, 12);
  EXPECT_GT(At(given, "zy_l").depth_mm, 11);
  EXPECT_GT(At(given, "zy_l").sd_mm, 0.5);
  EXPECT_LT(At(given, "zy_l").sd_mm, 1);
}

TEST(ConditionDepths, AKnownDepthIsUsedIfTheTableLacksTheSite) {
  TissueOptions options = FromTTable();
  options.given.depths_mm = {{"fe", 4.0}, {"g", 6.0}};
  options.given.error_mm = 0.3;
  std::vector<Dowel> dowels = Dowels({"g", "fe_l", "fe_r", "sg"});
  const auto on_depths = FillDepths(options, {}, dowels);
  const auto on_known = ConditionDepths(options, {}, dowels);
  ASSERT_EQ(dowels.size(), 3u);  // sg has no depth anywhere
  for (const std::size_t k : {1, 2}) {
    EXPECT_EQ(dowels[k].depth_mm, 4) << dowels[k].site;
    EXPECT_EQ(dowels[k].sd_mm, 0.3) << dowels[k].site;
  }
  EXPECT_THAT(on_depths, Contains(HasSubstr("fe_l (Frontal Eminence): no table has a depth; the "
                                            "known depth of 4 mm is used")));
  EXPECT_THAT(on_depths, Contains(HasSubstr("dowel left out")).Times(1));
  EXPECT_THAT(on_known, Contains(HasSubstr("fe_l, fe_r does not change the other depths")));
}

TEST(ConditionDepths, MeasuredDepthsComeFromTheLandmarks) {
  LandmarkFile file;
  for (const char* site : {"g", "pg", "n"}) {
    file.landmarks.emplace_back().site = site;
  }
  file.landmarks[0].depth_along_normal_mm = 8;
  file.landmarks[1].depth_closest_mm = 14;
  TissueOptions options = FromTTable();
  options.given.measured = {"all"};
  const Filled given = Fill(options, file);
  EXPECT_EQ(At(given, "g").depth_mm, 8);
  EXPECT_EQ(At(given, "pg").depth_mm, 14);
  EXPECT_GT(At(given, "n").depth_mm, 6);
  options.given.measured = {"n"};
  EXPECT_THAT(WordsOf<InputError>([&] { Fill(options, file); }),
              HasSubstr("no measured depth in the landmark file"));
}

TEST(ConditionDepths, ATableWithoutDeviationsNeedsAnother) {
  TissueOptions options = FromTTable();
  options.table = kRhine;
  options.given.depths_mm = {{"g", 9.0}};
  EXPECT_THAT(WordsOf<InputError>([&] { Fill(options); }), HasSubstr("given.spread"));
  options.given.spread = kTTable;
  const Filled given = Fill(options);
  TissueOptions plain = options;
  plain.given = {};
  EXPECT_EQ(At(given, "g").depth_mm, 9);
  EXPECT_GT(At(given, "pg").depth_mm, At(Fill(plain), "pg").depth_mm);
  EXPECT_LT(At(given, "pg").depth_mm, At(Fill(plain), "pg").depth_mm + 8);
}

constexpr char kPopulation[] = R"(
id: two
title: two sites
rows:
  - {site: g, values: {adult: {mean: 6, sd: 1, n: 50}}}
  - {site: pg, values: {adult: {mean: 11, sd: 2, n: 50}}}
correlations:
  subjects: 0
  covariates: [{name: bmi, mean: 25, sd: 4}]
  names: [g, pg, bmi]
  rows: [[], [0.5], [0.3, 0.8]]
)";

TEST(ConditionDepths, UsesAPopulationsCorrelations) {
  TissueOptions options;
  options.table = ScratchFile(kPopulation);
  options.given.bmi = 29;
  std::vector<Dowel> dowels = Dowels({"g", "pg"});
  FillDepths(options, {}, dowels);
  ConditionDepths(options, {}, dowels);
  EXPECT_NEAR(dowels[0].depth_mm, 6 + 0.3, 1e-9);
  EXPECT_NEAR(dowels[1].depth_mm, 11 + 0.8 * 2, 1e-9);
  EXPECT_NEAR(dowels[1].sd_mm, 2 * std::sqrt(1 - 0.64), 1e-9);
  options.given.age_years = 40;
  EXPECT_THAT(WordsOf<InputError>([&] { ConditionDepths(options, {}, dowels); }),
              HasSubstr("age_years"));
}

// The table of people as it is shipped: build moves each depth by its own loading, and what it
// leaves open is less than without it.
TEST(ConditionDepths, TheShippedPopulationFollowsBuild) {
  TissueOptions options;
  options.table = SEMBLANCE_SOURCE_DIR "/configs/tables/open_kbp.yaml";
  const auto at = [&](double build_sds) {
    options.given.build_sds = build_sds;
    std::vector<Dowel> dowels = Dowels({"g", "zy_l", "mr_r"});
    FillDepths(options, {}, dowels);
    ConditionDepths(options, {}, dowels);
    return dowels;
  };
  const std::vector<Dowel> thin = at(-1), mean = at(0), heavy = at(1);
  const TissueTable table = ReadTissueTable(options.table);
  for (std::size_t k = 0; k < mean.size(); ++k) {
    const auto depth = FindDepth(table, Sex::kMale, Build::kNormal, mean[k].site);
    EXPECT_NEAR(mean[k].depth_mm, depth->mean_mm, 1e-9) << mean[k].site;
    EXPECT_NEAR(heavy[k].depth_mm - mean[k].depth_mm, mean[k].depth_mm - thin[k].depth_mm, 1e-9);
    EXPECT_GT(heavy[k].depth_mm, mean[k].depth_mm + 0.3 * *depth->sd_mm) << mean[k].site;
    EXPECT_LT(mean[k].sd_mm, *depth->sd_mm) << mean[k].site;
  }
}

TEST(ConditionDepths, NotesValuesFarFromAllSubjects) {
  TissueOptions options;
  options.table = ScratchFile(kPopulation);
  std::vector<Dowel> dowels = Dowels({"g", "pg"});
  options.given.bmi = 40.5;  // 3.9 standard deviations
  EXPECT_THAT(ConditionDepths(options, {}, dowels), Not(Contains(HasSubstr("extrapolated"))));
  options.given.bmi = 99;
  EXPECT_THAT(
      ConditionDepths(options, {}, dowels),
      Contains(HasSubstr("tissue.given: bmi 99 is 18 standard deviations from the table's 25 "
                         "± 4, so the conditioned depths are extrapolated")));
  options.given.bmi.reset();
  options.given.depths_mm = {{"g", 12.0}};
  EXPECT_THAT(ConditionDepths(options, {}, dowels), Contains(HasSubstr("g 12 is 6 standard")));
  options.given.error_mm = 5;  // which may be no more than that
  EXPECT_THAT(ConditionDepths(options, {}, dowels), Not(Contains(HasSubstr("extrapolated"))));
}

// Without given facts, the deviations of the table stay unchanged.
TEST(ConditionDepths, FewSubjectsWidenOnlyConditionedDepths) {
  std::string text = kPopulation;
  text.replace(text.find("subjects: 0"), 11, "subjects: 6");
  for (std::size_t at = 0; (at = text.find("n: 50")) != text.npos;) {
    text.replace(at, 5, "n: 6");
  }
  TissueOptions options;
  options.table = ScratchFile(text);
  EXPECT_EQ(At(Fill(options), "g").sd_mm, 1);
  options.given.depths_mm = {{"pg", 11.0}};
  options.given.error_mm = 50;  // tells nothing
  EXPECT_NEAR(At(Fill(options), "g").sd_mm, std::sqrt(1 + 1 / 6.) * 2.015 / 1.645, 0.01);
}

TEST(TissueCorrelations, ImpossibleOnesAreRefused) {
  std::string text = kPopulation;
  text.replace(text.find("[0.3, 0.8]"), 10, "[-0.9, 0.8]");
  EXPECT_THAT(WordsOf<ConfigError>([&] { ReadTissueTable(ScratchFile(text)); }),
              HasSubstr("positive definite"));
  text = kPopulation;
  text.replace(text.find("[g, pg, bmi]"), 12, "[g, go_l, bmi]");
  EXPECT_THAT(WordsOf<ConfigError>([&] { ReadTissueTable(ScratchFile(text)); }),
              HasSubstr("'go_l' is not in the table"));
}

TEST(TissueGiven, IsForTables) {
  EXPECT_THAT(WordsOf<ConfigError>([&] {
                ReadConfigText<TissueOptions>("{depths: measured, given: {bmi: 30}}", "t.yaml");
              }),
              HasSubstr("given"));
}

// Given facts reach the interpolated field and its stated deviation.
TEST(ConditionDepths, ReachesTheCase) {
  const std::string text = fmt::format(
      "{{subject: {{type: phantom, rings: 16}}, network: '{}/configs/networks/standard32.yaml', "
      "tissue: {{table: '{}', given: {{measured: [g, go, zy, pg]}}}}}}",
      SEMBLANCE_SOURCE_DIR, kTTable);
  const auto experiment = ReadConfigText<Experiment>(text, "given.yaml");
  const SubjectData data = LoadSubject(experiment.subject, {});
  const Case subject = MakeCase(data, experiment, {});
  for (const Dowel& dowel : subject.dowels_on_bone) {
    const auto truth = std::ranges::find(data.landmarks.landmarks, dowel.site, &Landmark::site);
    const std::string code = WithoutSide(dowel.site);
    if (code == "g" || code == "go" || code == "zy" || code == "pg") {
      EXPECT_EQ(dowel.depth_mm, *truth->depth_along_normal_mm) << dowel.site;
      EXPECT_EQ(dowel.sd_mm, 0) << dowel.site;
    } else if (code == "n" || code == "mr") {
      EXPECT_GT(dowel.sd_mm, 0.3) << dowel.site;
    }
  }
  EXPECT_THAT(subject.notes, Contains(HasSubstr("those expected given")));
}

}  // namespace

}  // namespace semblance::problems
