// SPDX-License-Identifier: GPL-3.0-or-later
// Fits of scattered points, with and without (u,v).
#include "problems/points/point_fit.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <tuple>
#include <vector>

#include "problems/config/config.h"
#include "problems/points/fit_files.h"
#include "problems/points/fit_report.h"
#include "problems/points/point_files.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "surfaces/hspline_query/hspline_project.h"
#include "surfaces/hspline_query/tessellate.h"
#include "surfaces/mesh/mesh_query.h"
#include "tests/testing/scattered_data.h"
#include "tests/testing/scratch_file.h"

namespace semblance::problems {
namespace {

using testing::ErrorAgainst;
using testing::FrankePoint;
using ::testing::HasSubstr;
using testing::HeadPoint;
using testing::Scattered;
using testing::UvCsv;

const std::string kConfigs = SEMBLANCE_SOURCE_DIR "/configs/fit";

PointTable TableOf(const FitTarget& target) {
  return ParsePointTable(testing::PlainCsv(target), "test");
}

// g++ 12 crashes on {} for these options within a generic lambda.
const PointFitOptions kUsualFit;

// A height field that is turned in space, without (u,v): the plane is found.
TEST(PointFit, PlaneParametersFindTheHeightField) {
  const Mat3 turn = Eigen::AngleAxisd(0.8, Vec3(1, -2, 0.5).normalized()).matrix();
  const auto surface = [&](const Vec2& uv) -> Vec3 {
    return turn * Vec3(150 * uv.x(), 100 * uv.y(), 8 * std::sin(5 * uv.x()) * std::cos(4 * uv.y()));
  };
  PointFitOptions options;
  options.fit.terms = {PointTerm{}};
  options.fit.plan = AdaptivePlan{.tolerance_mm = 0.01, .finest = 3};
  const PointFit result = FitPoints(TableOf(Scattered(surface, 5000, 0, 3)), options, {});
  EXPECT_EQ(result.parameters, "plane");
  const SurfaceProjector projector(result.fit.surface);
  for (const FitPoint& p : Scattered(surface, 100, 0, 4).points) {
    if ((p.uv - Vec2(0.5, 0.5)).cwiseAbs().maxCoeff() < 0.45) {
      EXPECT_LT(projector.Project(p.position).distance_mm, 0.02);
    }
  }
}

// Lengths of the report are those of the file, whatever the scale in which heights are fitted.
TEST(PointFit, TheReportHasTheUnitsOfTheHeights) {
  Random random(3);
  for (const double unit : {1.0, 1000.0}) {
    PointTable lines;
    for (int k = 0; k < 8000; ++k) {
      const double x = (k % 100 + 0.5) / 100, y = (k / 100 + 0.5) / 80;
      const double offset = 0.6 * std::sin(1.7 * (k / 100) * (k / 100));  // looks random
      const double height = 10 * std::sin(5 * x + 1) * std::cos(4 * y) + offset;
      lines.positions.emplace_back(x, y, unit * 0.05 * std::round(height / 0.05));
    }
    const AutoReport report = FitPoints(lines, {}, {}).fit.automatic.value();
    EXPECT_NEAR(report.run_offset_mm, unit * 0.42, unit * 0.1);
    EXPECT_NEAR(report.noise_mm, unit * 0.42, unit * 0.1);
    EXPECT_THAT(AutoText(report, ""), HasSubstr("80 runs of the file"));
    PointTable rounded;
    for (int k = 0; k < 4000; ++k) {
      const double x = random.Uniform(), y = random.Uniform();
      rounded.positions.emplace_back(
          x, y, unit * 0.5 * std::round(20 * std::sin(5 * x + 1) * std::cos(4 * y)));
    }
    EXPECT_NEAR(FitPoints(rounded, {}, {}).fit.automatic.value().lattice_mm, unit * 0.5,
                unit * 1e-9);
  }
}

TEST(PointFit, CylinderParametersCloseTheHead) {
  const PointFitOptions options{
      .closure = Closure::kPeriodicU,
      .parameters = CylinderParameters{.axis = {0, 0, 1}},
      .fit = {.plan = AdaptivePlan{.tolerance_mm = 4e-3, .finest = 3},
              .terms = {PointTerm{}, SmoothnessTerm{.weight = 1e-9, .length_mm = 1}}}};
  const PointFit result = FitPoints(TableOf(Scattered(HeadPoint, 30000, 1e-4, 3)), options, {});
  EXPECT_EQ(result.parameters, "cylinder");
  EXPECT_LT(result.fit.point_rms_mm, 4e-3);
  for (const double v : {0.1, 0.5, 0.9}) {
    const Vec2 left(1 - 1e-9, v), right(1e-9, v);
    EXPECT_LT((result.fit.surface.Point(left) - result.fit.surface.Point(right)).norm(), 1e-6);
  }
}

// With noise of 1e-3 and about twenty points per parameter sigma is a fraction of the noise, and
// larger at borders.
TEST(PointFit, SigmaIsComputedIfRequested) {
  PointFitOptions options;
  options.sigma = true;
  const PointTable table = ParsePointTable(UvCsv(Scattered(FrankePoint, 3000, 1e-3, 1)), "test");
  const PointFit result = FitPoints(table, options, {});
  ASSERT_EQ(result.sigma_mm.size(), 3000u);
  EXPECT_EQ(result.sigma->OfChosen(result.fit.uv), result.sigma_mm);
  const std::vector<Vec2> places = {{0.5, 0.5}, {0, 0}};
  const std::vector<double> sigma = result.sigma->At(places);
  EXPECT_GT(sigma[0], 1e-5);
  EXPECT_LT(sigma[0], 6e-4);
  EXPECT_GT(sigma[1], sigma[0]);
  EXPECT_THAT(ResidualsCsv({result.fit, {}, {}, result.sigma_mm}),
              ::testing::StartsWith("point,u,v,residual_mm,outlier,sigma_mm\n"));
  EXPECT_THAT(ResidualsPly({result.fit, {}, {}, result.sigma_mm}),
              HasSubstr("property float sigma_mm"));
  options.sigma = false;
  const PointFit plain = FitPoints(table, options, {});
  EXPECT_EQ(plain.fit.residual_mm, result.fit.residual_mm);
  EXPECT_THAT(plain.sigma_mm, ::testing::IsEmpty());
}

// Every hundredth point is lifted and must still be met.
TEST(PointFit, ExactPointsOfATableAreMet) {
  const FitTarget target = Scattered(FrankePoint, 2000, 1e-3, 1);
  std::string csv = "x,y,z,u,v,exact,nx,ny,nz\n";
  for (std::size_t k = 0; k < target.points.size(); ++k) {
    const FitPoint& p = target.points[k];
    csv += fmt::format("{},{},{},{},{},{},0,0,{}\n", p.position.x(), p.position.y(),
                       p.position.z() + (k % 100 == 0 ? 0.01 : 0), p.uv.x(), p.uv.y(),
                       k % 100 == 0 ? 1 : 0, k == 0 ? 1 : 0);
  }
  const PointTable table = ParsePointTable(csv, "test");
  ASSERT_EQ(table.exact.size(), 20u);
  PointFitOptions options;
  options.sigma = true;
  const PointFit result = FitPoints(table, options, {});
  std::vector<double> sigma_mm = result.sigma_mm;
  std::nth_element(sigma_mm.begin(), sigma_mm.begin() + 1000, sigma_mm.end());
  for (const std::uint32_t k : table.exact) {
    EXPECT_LT((result.fit.surface.Point(table.uv[k]) - table.positions[k]).norm(), 1e-9);
    EXPECT_LT(result.sigma_mm[k], 1e-2 * sigma_mm[1000]);
  }
  EXPECT_LT(std::abs(result.fit.surface.Frame(table.uv[0]).du.z()), 1e-9);
  EXPECT_LT(ErrorAgainst(FrankePoint, result.fit.surface, 50).rms, 0.01);
}

// One point in five is twenty times as rough as the others, and its sigma is right. One point in
// fifty is far off and has the smallest sigma. The factor of the others is 1.
TEST(PointFit, OutliersDoNotCountForTheSigmaFactor) {
  const FitTarget target = Scattered(FrankePoint, 5000, 0, 1);
  Random random(2);
  std::string csv = "x,y,z,u,v,sigma\n";
  for (int k = 0; k < 5000; ++k) {
    const bool gross = k % 50 == 7;
    const double sigma = k % 5 == 0 ? 2e-2 : 1e-3;
    const Vec3 noise = sigma * Vec3(random.Normal(), random.Normal(), random.Normal());
    const Vec3 position = target.points[k].position + noise + Vec3(0, 0, gross ? 0.5 : 0);
    const Vec2& uv = target.points[k].uv;
    csv += fmt::format("{},{},{},{},{},{}\n", position.x(), position.y(), position.z(), uv.x(),
                       uv.y(), gross ? 2e-4 : sigma);
  }
  const PointFit result = FitPoints(ParsePointTable(csv, "test"), {}, {});
  EXPECT_NEAR(result.sigma_factor, 1, 0.03);
  EXPECT_NEAR(static_cast<double>(result.fit.automatic->outliers.size()), 100, 5);
}

// A fit with the reported weight and length as numbers gives the same surface.
TEST(PointFit, TheReportedWeightBelongsToTheWrittenTerms) {
  const PointTable table = ParsePointTable(UvCsv(Scattered(FrankePoint, 3000, 1e-3, 1)), "test");
  const PointFit plain = FitPoints(table, {}, {});
  PointFitOptions options;
  const auto ask = [&](AutoOr<double> weight) {
    options.fit.terms = {PointTerm{.weight = 7},
                         SmoothnessTerm{.weight = weight, .length_mm = 0.1}};
  };
  ask(AutoOr<double>::Auto());
  const PointFit found = FitPoints(table, options, {});
  EXPECT_EQ(found.fit.residual_mm, plain.fit.residual_mm);
  const AutoReport& report = *found.fit.automatic;
  EXPECT_EQ(report.length_mm, 0.1);
  EXPECT_NEAR(report.weight / plain.fit.automatic->weight, 7e4, 1);
  EXPECT_EQ(AutoJson(report)["length_mm"], 0.1);
  options.fit.solver = Solver::kCeres;
  const PointFit settled = FitPoints(table, options, {});
  ask(report.weight);
  const PointFit again = FitPoints(table, options, {});
  const auto of_settled = [&](const Vec2& uv) { return settled.fit.surface.Point(uv); };
  EXPECT_LT(ErrorAgainst(of_settled, again.fit.surface, 50).rms, 1e-9);
}

// Two strips of points with nearly nothing between them.
TEST(PointFit, ASurfaceThatSwingsFarBeyondItsPointsCannotBeUsed) {
  std::string csv = "x,y,z,u,v\n";
  for (int k = 0; k < 400; ++k) {
    const double u = k % 20 / 200.0 + (k < 200 ? 0.0 : 0.9), v = k / 20 / 19.0;
    const double noise = k * 7919 % 13 / 13.0;
    csv += fmt::format("{},{},{},{},{}\n", u, v, 0.1 * noise, u, v);
  }
  const PointTable table = ParsePointTable(csv, "test");
  PointFitOptions options;
  EXPECT_LT(FitPoints(table, options, {}).reach, 1);
  options.fit.plan = ListedPlan{{{.level = 0}, {.level = 1}, {.level = 2}}};
  options.fit.terms = {PointTerm{}, SmoothnessTerm{.weight = 1e-16}};
  const PointFit result = FitPoints(table, options, {});
  EXPECT_GT(result.reach, 3);
  ASSERT_EQ(result.Faults().size(), 1u);
  EXPECT_THAT(result.Faults()[0], HasSubstr("times the points' extent beyond them"));
}

// The points in a ball have no surface; those on its upper half have one, even with noise.
TEST(PointFit, PointsThatFillSpaceCannotBeUsed) {
  Random random(7);
  PointTable filled, half;
  for (int k = 0; k < 3000; ++k) {
    filled.positions.push_back(50 * std::cbrt(random.Uniform(0, 1)) * random.Direction());
    const Vec3 on = random.Direction();
    half.positions.emplace_back(50 * on.x(), 50 * on.y(), 20 * std::abs(on.z()) + random.Normal());
  }
  const PointFit result = FitPoints(filled, {}, {});
  EXPECT_GT(result.off, 0.1);
  ASSERT_EQ(result.Faults().size(), 1u);
  EXPECT_THAT(result.Faults()[0], HasSubstr("fill space"));
  const PointFit noisy = FitPoints(half, {}, {});
  EXPECT_LT(noisy.off, 0.02);
  EXPECT_THAT(noisy.Faults(), ::testing::IsEmpty());
}

TEST(PointFit, ContradictingOptionsAreFaultsOfTheFile) {
  const auto read = [](const std::string& text) {
    return testing::WordsOf<ConfigError>([&] { ReadConfigText<PointFitOptions>(text, "x.yaml"); });
  };
  EXPECT_THAT(read("fit: {plan: adaptive, terms: [symmetry]}\n"),
              HasSubstr("fit.terms: the adaptive plan has no term 'points'"));
  EXPECT_THAT(read("fit: {terms: [symmetry]}\n"),
              HasSubstr("the auto plan weighs 'points' without a loss"));
  EXPECT_THAT(read("fit: {terms: [points]}\n"),
              HasSubstr("fit.terms: the auto plan always weighs a 'smoothness'; add"));
  EXPECT_THAT(read("fit: {solver: ceres, terms: [points]}\n"),
              HasSubstr("fit.terms: the auto plan always weighs a 'smoothness'; add"));
  EXPECT_THAT(read("fit: {terms: [points, points, {type: smoothness, weight: auto}]}\n"),
              HasSubstr("fit.terms[1]: the auto plan weighs one 'points'"));
  EXPECT_THAT(read("closure: periodic_uv\n"), HasSubstr("periodic_uv"));
  EXPECT_THAT(read("parameters: torus\nclosure: periodic_u\n"), HasSubstr("torus"));
  EXPECT_THAT(read("parameters: mesh\nclosure: periodic_u\n"),
              HasSubstr("closure: parameters on a mesh do not go round; write closure: open"));
  EXPECT_THAT(read("parameters: plane\nclosure: periodic_u\n"), HasSubstr("do not go round"));
  EXPECT_THAT(read("patches_u: 1\nclosure: periodic_u\n"), HasSubstr("patches_u: H-spline: 1 x 8"));
  // The allowed values that the message names are allowed.
  EXPECT_THAT(read("patches_u: 3\nclosure: periodic_u\n"), HasSubstr("use 4..8192 x 1..8192"));
  EXPECT_NO_THROW(ReadConfigText<PointFitOptions>("patches_u: 8192\n", "x.yaml"));
  EXPECT_NO_THROW(ReadConfigText<PointFitOptions>("patches_u: 1024\npatches_v: 1024\n", "x.yaml"));
  EXPECT_THAT(
      read("patches_u: 4096\npatches_v: 4096\n"),
      HasSubstr("patches_u: 4096 x 4096 patches have 16801801 control vertices; level 0 may "
                "have 1100000; take fewer patches"));
  for (const char* term : {"landmarks", "prior_shape", "spring", "non_penetration"}) {
    EXPECT_THAT(read(fmt::format("fit: {{plan: until, terms: [points, {}]}}\n", term)),
                HasSubstr("and points of a file have none"));
  }
  for (const char* rule : {"free", "frozen", "{type: weighted, weight: 3}"}) {
    EXPECT_THAT(read(fmt::format("fit: {{features: {}}}\n", rule)),
                HasSubstr("fit.features: a surface through points of a file has no features"));
  }
  EXPECT_THAT(read("fit: {relaxation: footpoint}\n"), HasSubstr("fit.relaxation: the auto plan"));
  EXPECT_THAT(read("fit: {plan: {type: adaptive, relaxation_rounds: 2}}\n"),
              HasSubstr("fit.plan.relaxation_rounds"));
  EXPECT_THAT(read("fit: {plan: {type: adaptive, sweeps: 1}}\n"), HasSubstr("fit.plan.sweeps"));
  EXPECT_THAT(read("fit: {plan: {type: adaptive, regions: [{u: [0.5, 0.2]}]}}\n"),
              HasSubstr("fit.plan.regions[0]"));
  EXPECT_THAT(read("sigma: true\nfit: {plan: adaptive}\n"), HasSubstr("sigma: it follows"));
}

// Some points are repeated, one of them twice. Copies must not change the noise.
TEST(PointFit, CopiesOfPointsCountOnce) {
  PointFitOptions options;
  options.sigma = true;
  PointTable once = ParsePointTable(UvCsv(Scattered(FrankePoint, 1500, 2e-3, 1)), "test");
  once.positions[7].z() += 1;
  PointTable again = once;
  for (const std::size_t k : {0, 1, 2, 7, 7, 300}) {
    again.positions.push_back(once.positions[k]);
    again.uv.push_back(once.uv[k]);
  }
  const PointFit plain = FitPoints(once, options, {}), more = FitPoints(again, options, {});
  // The fits differ slightly, because copies count for the start surface.
  const auto of_plain = [&](const Vec2& uv) { return plain.fit.surface.Point(uv); };
  EXPECT_LT(ErrorAgainst(of_plain, more.fit.surface, 50).rms, 5e-5);
  EXPECT_NEAR(more.fit.automatic->noise_mm, plain.fit.automatic->noise_mm, 1e-5);
  EXPECT_THAT(plain.fit.automatic->repeated, ::testing::IsEmpty());
  EXPECT_THAT(more.fit.automatic->repeated, ::testing::SizeIs(6));
  EXPECT_THAT(plain.fit.automatic->outliers, ::testing::ElementsAre(7));
  EXPECT_THAT(more.fit.automatic->outliers, ::testing::ElementsAre(7, 1503, 1504));
  ASSERT_EQ(more.fit.residual_mm.size(), 1506u);
  EXPECT_EQ(more.fit.residual_mm[1505], more.fit.residual_mm[300]);
  EXPECT_EQ(more.fit.uv[1505], once.uv[300]);
  EXPECT_EQ(more.sigma_mm[1505], more.sigma_mm[300]);
  EXPECT_NEAR(more.sigma_mm[300], plain.sigma_mm[300], 0.01 * plain.sigma_mm[300]);
  EXPECT_THAT(AutoText(*more.fit.automatic), HasSubstr("6 points were given before"));
}

// Scan lines, whose points are close together along the lines and far apart across them, are a
// sheet and no wall.
TEST(PointFit, LinesOfAScannerAreASheet) {
  for (const auto& [lines, along, height] : {std::tuple(20, 500, 1), std::tuple(60, 180, 1),
                                             std::tuple(40, 400, 1), std::tuple(20, 500, 0)}) {
    SCOPED_TRACE(fmt::format("{} lines of {}, height {}", lines, along, height));
    Random random(3);
    PointTable table;
    for (int j = 0; j < lines; ++j) {
      for (int i = 0; i < along; ++i) {
        const Vec3 p = FrankePoint(Vec2(i / (along - 1.0), j / (lines - 1.0)));
        table.positions.emplace_back(p.x(), p.y(), height * p.z() + 2e-3 * random.Normal());
      }
    }
    const PointFit fit = FitPoints(table, {}, {});
    EXPECT_EQ(fit.parameters, "plane");
    EXPECT_LT(fit.map_faults.Sum(), 0.02);
    EXPECT_LT(fit.fit.point_rms_mm, 2.5e-3);
    EXPECT_NEAR(fit.fit.automatic->noise_mm, 2e-3, 2e-4);
  }
}

// At 1e8 mm a double resolves 1.5e-8 mm.
TEST(PointFit, PointsFarFromTheOriginHaveAnExtent) {
  PointTable table = ParsePointTable(UvCsv(Scattered(FrankePoint, 500, 1e-3, 1)), "test");
  const PointFit near = FitPoints(table, {}, {});
  for (Vec3& p : table.positions) {
    p += Vec3(1e8, -1e8, 1e8);
  }
  EXPECT_NEAR(FitPoints(table, {}, {}).fit.point_rms_mm, near.fit.point_rms_mm, 1e-4);
}

TEST(PointFit, OutliersAreCountedInEnglish) {
  AutoReport report;
  report.noise_mm = 1;
  EXPECT_THAT(AutoText(report), ::testing::Not(HasSubstr("left out")));
  report.outliers = {7};
  EXPECT_THAT(AutoText(report), HasSubstr("1 outlier left out; residuals and result.json list it"));
  report.outliers = {7, 9};
  EXPECT_THAT(AutoText(report), HasSubstr("2 outliers left out"));
}

TEST(PointFit, ConfigurationRoundTrips) {
  const auto options = ReadConfig<PointFitOptions>(kConfigs + "/scan.yaml");
  EXPECT_TRUE(std::get<SmoothnessTerm>(options.fit.terms[1]).weight.automatic);
  const auto again = ReadConfigText<PointFitOptions>(WriteConfig(options), "x.yaml");
  EXPECT_EQ(WriteConfig(again), WriteConfig(options));
  EXPECT_THAT(OptionsReference<PointFitOptions>(), HasSubstr("number or auto"));
  const auto schema = nlohmann::json::parse(OptionsSchema<PointFitOptions>());
  EXPECT_TRUE(schema["properties"].contains("parameters"));
}

// Heights as of the files of data/field, with noise 0.01.
PointTable Hills(int count, double width_mm, double noise_mm, std::uint64_t random_seed) {
  Random random(random_seed);
  PointTable table;
  for (int k = 0; k < count; ++k) {
    const double x = random.Uniform(0, width_mm), y = random.Uniform(0, width_mm);
    table.positions.emplace_back(
        x, y, 4 * std::sin(x / 9) * std::cos(y / 13) + noise_mm * random.Normal());
  }
  return table;
}

// The distance of the surface's heights from the hills.
double ErrorOfHills(const HSplineSurface& surface) {
  double sum = 0;
  for (int k = 0; k < 900; ++k) {
    const Vec3 p = surface.Point({(k % 30 + 0.5) / 30, (k / 30 + 0.5) / 30});
    sum += std::pow(p.z() - 4 * std::sin(p.x() / 9) * std::cos(p.y() / 13), 2);
  }
  return std::sqrt(sum / 900);
}

// A second export moves each point a little. It must not make the noise look smaller.
TEST(PointFit, ASecondExportCountsOnce) {
  const PointTable once = Hills(1500, 100, 0.2, 3);
  const PointFit alone = FitPoints(once, {}, {});
  for (const double moved_mm : {1e-9, 1e-4, 1e-2}) {
    SCOPED_TRACE(moved_mm);
    PointTable twice = once;
    Random random(5);
    for (const Vec3& p : once.positions) {
      twice.positions.push_back(p +
                                moved_mm * Vec3(random.Normal(), random.Normal(), random.Normal()));
    }
    const PointFit fit = FitPoints(twice, {}, {});
    EXPECT_NEAR(fit.fit.automatic->noise_mm, 0.2, 0.02);
    EXPECT_NEAR(fit.fit.automatic->held_out_rms_mm, alone.fit.automatic->held_out_rms_mm, 0.03);
    EXPECT_LT(ErrorOfHills(fit.fit.surface), 1.3 * ErrorOfHills(alone.fit.surface));
    EXPECT_NEAR(fit.fit.automatic->near_copies, 1500, 30);
    EXPECT_THAT(AutoText(*fit.fit.automatic), HasSubstr("as by a second export"));
  }
}

// Stations with twins: most copies repeat the value, some differ. The few that differ must not stay
// as points of their own, where they would make the surface steep.
TEST(PointFit, TwinsOfStationsCountOnce) {
  const PointTable once = Hills(600, 100, 0.2, 3);
  PointTable twins = once;
  Random random(5);
  for (const Vec3& p : once.positions) {
    const int copies = static_cast<int>(random.Uniform(0, 4));
    for (int k = 0; k < copies; ++k) {
      const double moved = random.Uniform() < 0.05 ? 0.3 * random.Normal() : 0;
      twins.positions.push_back(p + Vec3(1e-6 * random.Normal(), 1e-6 * random.Normal(), moved));
    }
  }
  const PointFit alone = FitPoints(once, {}, {}), fit = FitPoints(twins, {}, {});
  // A few stations are neighbours by chance; some fifty copies have another value.
  EXPECT_NEAR(fit.fit.automatic->near_copies,
              static_cast<double>(twins.positions.size() - once.positions.size()), 10);
  EXPECT_NEAR(fit.fit.automatic->noise_mm, 0.2, 0.03);
  EXPECT_LT(ErrorOfHills(fit.fit.surface), 1.3 * ErrorOfHills(alone.fit.surface));
}

// Two measurements at one place have errors of their own.
TEST(PointFit, PointsThatWereMeasuredTwiceBothCount) {
  PointTable twice = Hills(1000, 100, 0, 3);
  const std::vector<Vec3> once = twice.positions;
  twice.positions.insert(twice.positions.end(), once.begin(), once.end());
  Random random(5);
  for (Vec3& p : twice.positions) {
    p.z() += 0.2 * random.Normal();
  }
  const PointFit fit = FitPoints(twice, {}, {});
  EXPECT_LT(fit.fit.automatic->near_copies, 60);
  EXPECT_NEAR(fit.fit.automatic->noise_mm, 0.2, 0.02);
}

TEST(PointFit, GivenUvMustBelongToThePoints) {
  const PointTable hills = Hills(1500, 100, 0.1, 3);
  const auto refusal = [&](const auto& uv_of, double sheets_mm) {
    PointTable table = hills;
    for (std::size_t k = 0; k < table.positions.size(); ++k) {
      table.uv.push_back(uv_of(k));
      table.positions[k].z() += k % 2 == 0 ? sheets_mm : 0;
    }
    return testing::WordsOf<InputError>([&] { FitPoints(std::move(table), kUsualFit, {}); });
  };
  const auto place = [&](std::size_t k) -> Vec2 { return hills.positions[k].head<2>() / 100; };
  EXPECT_THAT(refusal([&](std::size_t k) { return place((k + 700) % 1500); }, 0),
              HasSubstr("do not belong to the points"));
  EXPECT_THAT(refusal([&](std::size_t) { return Vec2(0.5, 0.5); }, 0),
              HasSubstr("the given (u,v) are all (0.5, 0.5)"));
  EXPECT_THAT(refusal([&](std::size_t k) { return Vec2(place(k).x(), place(k).x()); }, 0),
              HasSubstr("all on one line"));
  EXPECT_THAT(refusal(place, 50), HasSubstr("several sheets of points to one place"));
  EXPECT_THAT(refusal(place, 20), HasSubstr("several sheets of points to one place"));
  PointTable good = hills;
  for (std::size_t k = 0; k < good.positions.size(); ++k) {
    good.uv.emplace_back(place(k).y(), place(k).x());  // swapped
  }
  EXPECT_NEAR(FitPoints(good, {}, {}).fit.automatic->noise_mm, 0.1, 0.01);
}

// A few points far off are left out and listed, whatever their coordinates.
TEST(PointFit, StraysAreLeftOutAndListed) {
  const PointTable hills = Hills(600, 60, 0.01, 3);
  const PointFit clean = FitPoints(hills, {}, {});
  for (const Vec3& stray : {Vec3(600, 600, 0), Vec3(600, 30, 0), Vec3(-9999, -9999, -9999),
                            Vec3(30, 30, 1e30), Vec3(30, 30, -9999)}) {
    SCOPED_TRACE(fmt::format("{} {} {}", stray.x(), stray.y(), stray.z()));
    for (const int count : {1, 6}) {
      PointTable table = hills;
      table.positions.insert(table.positions.begin() + 100, count, stray);
      const PointFit fit = FitPoints(table, {}, {});
      EXPECT_THAT(fit.strays, ::testing::SizeIs(count));
      EXPECT_EQ(fit.strays[0], 100u);
      EXPECT_THAT(fit.fit.automatic->outliers, ::testing::IsSupersetOf(fit.strays));
      EXPECT_NEAR(fit.fit.point_rms_mm, clean.fit.point_rms_mm, 1e-6);
      EXPECT_FALSE(std::isfinite(fit.fit.residual_mm[100]));
      EXPECT_EQ(fit.fit.residual_mm.back(), clean.fit.residual_mm.back());
    }
  }
}

// A number that stands for no data is left out, however many points have it.
TEST(PointFit, ValuesForNoDataAreLeftOut) {
  const PointTable hills = Hills(600, 60, 0.01, 3);
  for (const double value : {-9999.0, -32768.0, -99.0, 1e20}) {
    PointTable table = hills;
    for (std::size_t k = 0; k < table.positions.size(); k += 10) {
      table.positions[k].z() = value;
    }
    const PointFit fit = FitPoints(table, {}, {});
    EXPECT_THAT(fit.strays, ::testing::SizeIs(60)) << value;
    EXPECT_LT(fit.fit.point_rms_mm, 0.012) << value;
  }
}

// A flat roof over rough ground is no missing height.
TEST(PointFit, AHeightThatManyPointsShareStays) {
  PointTable table = Hills(600, 60, 0.01, 3);
  for (Vec3& p : table.positions) {
    p.z() = p.x() < 15 ? 12.5 : 0.01 * p.z();
  }
  EXPECT_THAT(FitPoints(table, {}, {}).strays, ::testing::IsEmpty());
}

bool HasNote(const PointTable& table, const std::string& words) {
  const PointFit fit = FitPoints(table, {}, {});
  return ::testing::PrintToString(fit.notes).find(words) != std::string::npos;
}

TEST(PointFit, ZerosAmongHeightsAreNoted) {
  constexpr char kWords[] = "0 may stand for a missing height";
  PointTable gaps = Hills(600, 60, 0.01, 3), sea = gaps, rounded = gaps;
  for (std::size_t k = 0; k < gaps.positions.size(); ++k) {
    gaps.positions[k].z() = k % 15 == 0 ? 0 : gaps.positions[k].z() + 10;
    sea.positions[k].z() = std::max(sea.positions[k].z(), 0.0);
    rounded.positions[k].z() = std::round(rounded.positions[k].z());
  }
  EXPECT_TRUE(HasNote(gaps, kWords));
  EXPECT_FALSE(HasNote(sea, kWords));
  EXPECT_FALSE(HasNote(rounded, kWords));
}

// Two surveys of one area in one file, with other zeros of height.
TEST(PointFit, APartOfTheFileWithAnotherZeroIsNoted) {
  const PointTable hills = Hills(600, 60, 0.01, 3);
  PointTable shifted = hills;
  for (std::size_t k = 400; k < shifted.positions.size(); ++k) {
    shifted.positions[k].z() += 5;
  }
  EXPECT_THAT(::testing::PrintToString(FitPoints(shifted, {}, {}).notes),
              ::testing::ContainsRegex(
                  "the first (39|40)[0-9] points lie (4[.][5-9]|5)[0-9.]* lower than"));
  // One survey in the order of x, and a cliff between its halves.
  PointTable sorted = hills;
  std::ranges::sort(sorted.positions, {}, [](const Vec3& p) { return p.x(); });
  EXPECT_FALSE(HasNote(sorted, "those behind them"));
  for (Vec3& p : sorted.positions) {
    p.z() += p.x() > 30 ? 5 : 0;
  }
  EXPECT_FALSE(HasNote(sorted, "those behind them"));
}

// In any place of the file, beside the origin or around it, and with its heights in the same unit.
TEST(PointFit, APartOfTheFileInAnotherUnitIsNoted) {
  constexpr char kWords[] = "a part of the file may be in another unit";
  const PointTable hills = Hills(600, 60, 0.01, 3);
  for (const Vec3& origin : {Vec3(500, 900, 200), Vec3(-30, -30, 0)}) {
    PointTable sound = hills;
    std::ranges::for_each(sound.positions, [&](Vec3& p) { p += origin; });
    EXPECT_FALSE(HasNote(sound, kWords));
    for (const double factor : {1e-3, 1e2}) {
      PointTable behind = sound, scattered = sound;
      for (std::size_t k = 0; k < sound.positions.size(); ++k) {
        behind.positions[k] *= k < 400 ? 1 : factor;
        scattered.positions[k] *= k % 3 != 0 ? 1 : factor;
      }
      EXPECT_TRUE(HasNote(behind, kWords)) << origin.x() << ", " << factor;
      EXPECT_TRUE(HasNote(scattered, kWords)) << origin.x() << ", " << factor;
    }
  }
}

// A scan in a steep pose. Heights whose unit makes them steeper, and level ones, are heights.
TEST(PointFit, HeightsAlongASteepPlaneAreNoted) {
  constexpr char kWords[] = "tilted by 60 degrees";
  const PointTable hills = Hills(600, 60, 0.01, 3);
  const auto turned = [&](double degrees, double factor) {
    PointTable table = hills;
    const Eigen::AngleAxisd turn(degrees * std::numbers::pi / 180, Vec3::UnitX());
    for (Vec3& p : table.positions) {
      p = (turn * Vec3(p.x(), p.y(), 0.2 * p.z())).cwiseProduct(Vec3(1, 1, factor));
    }
    return table;
  };
  EXPECT_TRUE(HasNote(turned(60, 1), kWords));
  PointTable named = turned(60, 1);
  named.has_map_columns = true;
  for (const PointTable& heights : {turned(20, 1), turned(60, 1000), named}) {
    EXPECT_FALSE(HasNote(heights, "tilted by"));
  }
}

// A third of the points has ten times the standard deviation that is stated for the others.
TEST(PointFit, StandardDeviationsAsWeightsAreNoted) {
  constexpr char kWords[] = "points of great weight have more noise";
  PointTable table = Hills(900, 60, 0.01, 3);
  Random random(7);
  std::vector<double> sigma;
  for (std::size_t k = 0; k < table.positions.size(); ++k) {
    sigma.push_back(k % 3 == 0 ? 1 : 0.1);
    table.positions[k].z() += k % 3 == 0 ? random.Normal() : 0;
  }
  table.weights = sigma;
  EXPECT_TRUE(HasNote(table, kWords));
  std::ranges::transform(sigma, table.weights.begin(), [](double s) { return 1 / (s * s); });
  EXPECT_FALSE(HasNote(table, kWords));
  table.weights.assign(sigma.size(), 1);
  EXPECT_FALSE(HasNote(table, kWords));

  table.weights = sigma;  // with a plan that does not measure the noise between neighbours
  PointFitOptions listed;
  listed.fit.plan = ListedPlan{{{.level = 0}}};  // finer levels meet every point
  EXPECT_THAT(::testing::PrintToString(FitPoints(table, listed, {}).notes), HasSubstr(kWords));
}

// Hills(...) has noise of 0.01, and planes through neighbours miss it by 0.05. Copies that were
// moved by less count once, as the first of two exports; points that differ by more are
// measurements of their own.
TEST(PointFit, ASecondExportCountsOnceAndASecondMeasurementIsNoted) {
  const PointTable once = Hills(900, 60, 0.01, 3);
  const auto with_twins = [&once](double moved_mm) {
    PointTable table = once;
    Random random(9);
    for (const Vec3& p : once.positions) {
      table.positions.push_back(p + moved_mm * Vec3(0, 0, random.Normal()));
    }
    return table;
  };
  const PointFit plain = FitPoints(once, {}, {}), copied = FitPoints(with_twins(1e-4), {}, {});
  EXPECT_NEAR(copied.fit.automatic->near_copies, 900, 10);  // some points lie close by chance
  EXPECT_NEAR(copied.fit.automatic->noise_mm, plain.fit.automatic->noise_mm, 0.0005);
  EXPECT_FALSE(HasNote(with_twins(1e-4), "measured twice"));
  EXPECT_TRUE(HasNote(with_twins(0.2), "measured twice"));
}

// The surface follows the points that weigh most, so distances from it would not tell. Weights
// spread over 100 and more.
TEST(PointFit, WeightsAndDeviationsThatAreExchangedAreNoted) {
  for (const double decades : {2.0, 3.0}) {
    PointTable table = Hills(2000, 60, 0.001, 3);
    Random random(8);
    std::vector<double> sigma;
    for (Vec3& p : table.positions) {
      sigma.push_back(std::pow(10.0, -decades * random.Uniform()));
      p.z() += sigma.back() * random.Normal();
    }
    const auto squared_inverse = [](double s) { return 1 / (s * s); };
    table.weights = sigma;
    EXPECT_TRUE(HasNote(table, "if the column holds standard deviations, name it sigma"));
    std::ranges::transform(sigma, table.weights.begin(), squared_inverse);
    EXPECT_FALSE(HasNote(table, "have more noise"));
    table.weights_of_sigma = true;  // a column sigma that holds 1 / sd^2 has weights of sd^4
    std::ranges::transform(sigma, table.weights.begin(), [](double s) { return s * s * s * s; });
    EXPECT_TRUE(HasNote(table, "if the column holds weights, name it weight"));
  }
}

// The files of people that gave wrong results without a word: the RMS that is right, and a note.
TEST(PointFit, FilesOfTheFieldGiveTheRightResult) {
  const std::filesystem::path folder = SEMBLANCE_SOURCE_DIR "/../shared/data/field";
  if (!std::filesystem::exists(folder)) {
    GTEST_SKIP() << "there is no folder " << folder;
  }
  struct Case {
    const char* file;
    double rms_mm;
    const char* note;
  };
  for (const auto& [file, rms_mm, note] :
       {Case{"stray-10-extents.csv", 0.01, "number 601"},
        Case{"stray-zero-utm.csv", 0.01, "number 481"},
        Case{"strip-1200x10.csv", 0.01, "104 x 1 patches"},
        Case{"two-patches-1000.csv", 0.01, "lie in two places"},
        Case{"degrees-and-metres.csv", 2, ""}, Case{"rgb.xyz", 0.01, "3 numbers after x, y and z"},
        Case{"cloudcompare.txt", 0.01, "columns without effect: R, G, B"},
        Case{"capitals.csv", 0.01, ""}, Case{"semicolons.csv", 0.01, ""},
        Case{"nan-points.ply", 0.01, "60 points without finite coordinates left out"}}) {
    SCOPED_TRACE(file);
    const PointFit fit = FitPoints(ReadPointFile(folder / file).points, {}, {});
    EXPECT_NEAR(fit.fit.point_rms_mm, rms_mm, 0.3 * rms_mm);
    EXPECT_THAT(::testing::PrintToString(fit.notes), HasSubstr(note));
    EXPECT_THAT(fit.Faults(), ::testing::IsEmpty());
  }
  const PointFit gross =
      FitPoints(ReadPointFile(folder / "outliers-25-percent.csv").points, {}, {});
  EXPECT_THAT(::testing::PrintToString(gross.notes), HasSubstr("the distances have a long tail"));
  EXPECT_THAT(testing::WordsOf<InputError>(
                  [&] { FitPoints(ReadPointFile(folder / "uv-all-the-same.csv").points, {}, {}); }),
              HasSubstr("all (0.5, 0.5)"));
  PointFitOptions upright;
  upright.parameters = PlaneParameters{.normal = {0, 0, 1}};
  const PointFit told =
      FitPoints(ReadPointFile(folder / "degrees-and-metres.csv").points, upright, {});
  EXPECT_NEAR(told.fit.point_rms_mm, 2, 0.6);
  EXPECT_THAT(told.how, HasSubstr("coordinates in different units"));
}

// A column that was sorted by itself leaves each coordinate as it was, but no surface.
TEST(PointFit, AColumnSortedByItselfGetsANote) {
  const PointTable table = Hills(800, 60, 0.05, 9);
  const auto notes = [](const PointTable& points) {
    return ::testing::PrintToString(FitPoints(points, {}, {}).notes);
  };
  EXPECT_THAT(notes(table), ::testing::Not(HasSubstr("nothing of their relief")));
  for (const int axis : {0, 2}) {
    std::vector<double> column;
    for (const Vec3& p : table.positions) {
      column.push_back(p[axis]);
    }
    std::ranges::sort(column);
    PointTable sorted = table;
    for (std::size_t k = 0; k < column.size(); ++k) {
      sorted.positions[k][axis] = column[k];
    }
    EXPECT_THAT(notes(sorted), HasSubstr("nothing of their relief")) << axis;
  }
}

// The same surface within the noise, for points in another order, mirrored, scaled or shifted.
TEST(PointFit, LawsOfTheSamePoints) {
  const PointTable table = Hills(800, 60, 0.05, 9);
  const PointFit plain = FitPoints(table, {}, {});
  const auto compare = [&](const auto& change, double scale) {
    PointTable changed = table;
    std::ranges::for_each(changed.positions, change);
    const PointFit fit = FitPoints(changed, kUsualFit, {});
    EXPECT_NEAR(fit.fit.automatic->noise_mm / scale, plain.fit.automatic->noise_mm, 0.005);
    EXPECT_NEAR(fit.fit.point_rms_mm / scale, plain.fit.point_rms_mm, 0.005);
  };
  compare([](Vec3& p) { p.x() *= -1; }, 1);
  compare([](Vec3& p) { std::swap(p.x(), p.y()); }, 1);
  compare([](Vec3& p) { p *= 1e-3; }, 1e-3);
  compare([](Vec3& p) { p *= 1e6; }, 1e6);
  compare([](Vec3& p) { p += Vec3(1e6, -1e6, 1e6); }, 1);
  PointTable reversed = table;
  std::ranges::reverse(reversed.positions);
  const PointFit back = FitPoints(reversed, {}, {});
  EXPECT_NEAR(back.fit.residual_mm.front(), plain.fit.residual_mm.back(), 1e-6);
}

}  // namespace
}  // namespace semblance::problems
