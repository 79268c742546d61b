// SPDX-License-Identifier: GPL-3.0-or-later
// Fits of heights over x and y, and predictions from them.
#include "problems/points/prediction.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "problems/points/fit_files.h"
#include "problems/points/fit_report.h"
#include "surfaces/base/error.h"
#include "surfaces/base/npy.h"
#include "surfaces/base/random.h"

namespace semblance::problems {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

// A hill and a valley over a map in degrees, in metres.
double HillAt(const Vec2& at) {
  const double x = (at.x() - 245) / 8, y = (at.y() - 22) / 5;
  return -2500 + 1500 * std::sin(4 * x) * std::cos(3 * y) + 800 * x;
}

PointTable MapTable(int count, double noise, std::uint64_t random_seed) {
  Random random(random_seed);
  PointTable table;
  for (int k = 0; k < count; ++k) {
    const Vec2 at(random.Uniform(245, 253), random.Uniform(22, 27));
    table.positions.emplace_back(at.x(), at.y(), HillAt(at) + noise * random.Normal());
  }
  return table;
}

// Heights in another unit give the same fit: only z changes, whatever its unit.
TEST(HeightField, TheUnitOfHeightsChangesOnlyHeights) {
  const PointTable table = MapTable(3000, 20, 5);
  const PointFit metres = FitPoints(table, {}, {});
  EXPECT_TRUE(metres.is_graph);
  EXPECT_NEAR(metres.fit.automatic->noise_mm, 20, 1.5);
  for (const double factor : {1e-3, 1e3}) {
    SCOPED_TRACE(factor);
    PointTable other = table;
    ScaleHeights(factor, other.positions);
    const PointFit fit = FitPoints(other, {}, {});
    EXPECT_EQ(fit.fit.surface.Offsets().size(), metres.fit.surface.Offsets().size());
    EXPECT_EQ(fit.fit.automatic->outliers, metres.fit.automatic->outliers);
    EXPECT_NEAR(fit.fit.point_rms_mm / factor, metres.fit.point_rms_mm, 1e-6);
    for (const Vec2& uv : {Vec2(0.1, 0.2), Vec2(0.5, 0.5), Vec2(1, 0)}) {
      const Vec3 a = fit.fit.surface.Point(uv), b = metres.fit.surface.Point(uv);
      EXPECT_NEAR(a.x(), b.x(), 1e-9);
      EXPECT_NEAR(a.y(), b.y(), 1e-9);
      EXPECT_NEAR(a.z() / factor, b.z(), 1e-5);
    }
  }
}

// Noise as large as the relief does not make heights a cloud.
TEST(HeightField, NoisyHeightsStayHeights) {
  const PointFit fit = FitPoints(MapTable(4000, 700, 6), {}, {});
  EXPECT_TRUE(fit.is_graph);
  EXPECT_NEAR(fit.fit.automatic->noise_mm, 700, 50);
}

TEST(HeightField, ColumnsOfMapsAreCoordinates) {
  const PointTable table = ParsePointTable("Lat,LON,depth\n1,2,3\n", "t");
  EXPECT_EQ(table.positions[0], Vec3(2, 1, 3));
  EXPECT_TRUE(table.has_map_columns);
  EXPECT_EQ(ParsePointTable("easting,northing,elevation\n1,2,3\n", "t").positions[0],
            Vec3(1, 2, 3));
  EXPECT_FALSE(ParsePointTable("x,y,z\n1,2,3\n", "t").has_map_columns);
  const std::vector<std::string> attributes = {"depth"};
  const PointTable both = ParsePointTable("x,y,z,depth\n1,2,3,4\n", "t", attributes);
  EXPECT_EQ(both.attributes[0].values[0], 4);
  EXPECT_FALSE(both.has_map_columns);
}

TEST(HeightField, LengthsHaveTheUnitThatIsStated) {
  PointFitOptions options;
  const PointFit plain = FitPoints(MapTable(500, 20, 7), options, {});
  EXPECT_THAT(AutoText(*plain.fit.automatic, plain.unit), ::testing::Not(HasSubstr("mm")));
  options.unit = "m";
  const PointFit metres = FitPoints(MapTable(500, 20, 7), options, {});
  EXPECT_THAT(AutoText(*metres.fit.automatic, metres.unit), HasSubstr(" m per coordinate"));
}

// A surface with more patches than the mesh should have cells gets one cell for each patch.
TEST(HeightField, AManyPatchedSurfaceHasAChord) {
  const HSplineShape shape{.patches_u = 800, .patches_v = 800, .max_level = 0};
  ControlNet net{shape.Columns(0), shape.Rows(0), {}};
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      net.vertices.emplace_back(i, j, (i * 7 + j * 13) % 5);
    }
  }
  PointFit fit = FitPoints(MapTable(100, 20, 12), {}, {});
  fit.fit.surface = HSplineSurface(shape, net);
  fit.height_factor = 1;
  const double chord = ChooseChord(fit, AutoOr<double>::Auto());
  EXPECT_LT(chord, 100);
  EXPECT_LE(CellsToChord(fit.fit.surface, chord), 640'000);
}

// Intervals hold their share of new observations and of the truth. Where the noise is four times as
// large on one side, the estimate blurs the step: in each half the share is off by at most a tenth.
TEST(Prediction, IntervalsHoldTheirShare) {
  PointTable table = MapTable(6000, 0, 8);
  Random random(9);
  const auto noise_at = [](double x) { return x < 249 ? 10.0 : 40.0; };
  for (Vec3& p : table.positions) {
    p.z() += noise_at(p.x()) * random.Normal();
  }
  const PointFit fit = FitPoints(table, {}, {});
  const HeightPredictor predictor(fit.fit.surface, CollectEvidence(fit));
  double of_both = 0;
  for (const bool rougher : {false, true}) {
    std::vector<Vec2> places;
    for (int k = 0; k < 1500; ++k) {
      places.emplace_back(rougher ? random.Uniform(249.3, 252.9) : random.Uniform(245.1, 248.7),
                          random.Uniform(22.1, 26.9));
    }
    const PredictedHeights heights = predictor.At(places, 0.9, 1);
    double holds = 0, holds_truth = 0;
    for (std::size_t k = 0; k < places.size(); ++k) {
      const double truth = HillAt(places[k]),
                   observed = truth + noise_at(places[k].x()) * random.Normal();
      holds += observed > heights.low[k] && observed < heights.high[k] ? 1.0 / 1500 : 0;
      holds_truth += std::abs(truth - heights.z[k]) < 1.645 * heights.sd[k] ? 1.0 / 1500 : 0;
      EXPECT_EQ(heights.supported[k], 1);
    }
    EXPECT_NEAR(holds, 0.9, 0.1);
    EXPECT_GT(holds_truth, 0.8);
    of_both += holds / 2;
  }
  EXPECT_NEAR(of_both, 0.9, 0.05);
}

// Deviations that are given and right: intervals hold their share of new observations of the same
// deviations and of the truth, also where those differ tenfold, side by side or mixed, and no note
// takes them for gross errors.
TEST(Prediction, IntervalsHoldTheirShareWithGivenDeviations) {
  constexpr int kPlaces = 1500;
  for (const bool mixed : {false, true}) {
    PointTable table = MapTable(6000, 0, 8);
    Random random(11);
    const auto deviation_at = [&](double x) {
      return (mixed ? random.Uniform(0, 1) < 0.5 : x < 249) ? 4.0 : 40.0;
    };
    table.weights_of_sigma = true;
    for (Vec3& p : table.positions) {
      const double sigma = deviation_at(p.x());
      p.z() += sigma * random.Normal();
      table.weights.push_back(1 / (sigma * sigma));
    }
    const PointFit fit = FitPoints(table, {}, {});
    EXPECT_NEAR(fit.sigma_factor, 1, 0.1);
    EXPECT_THAT(fit.notes, Not(Contains(HasSubstr("gross errors"))));
    const HeightPredictor predictor(fit.fit.surface, CollectEvidence(fit));
    for (const bool right : {false, true}) {
      std::vector<Vec2> places;
      for (int k = 0; k < kPlaces; ++k) {
        places.emplace_back(right ? random.Uniform(249.3, 252.9) : random.Uniform(245.1, 248.7),
                            random.Uniform(22.1, 26.9));
      }
      const PredictedHeights heights = predictor.At(places, 0.9, 1);
      double holds = 0, holds_truth = 0;
      for (std::size_t k = 0; k < places.size(); ++k) {
        const double truth = HillAt(places[k]),
                     observed = truth + deviation_at(places[k].x()) * random.Normal();
        holds += observed > heights.low[k] && observed < heights.high[k] ? 1.0 / kPlaces : 0;
        holds_truth += std::abs(truth - heights.z[k]) < 1.645 * heights.sd[k] ? 1.0 / kPlaces : 0;
      }
      EXPECT_NEAR(holds, 0.9, 0.05) << mixed << right;
      EXPECT_GT(holds_truth, 0.8) << mixed << right;
    }
  }
}

// Two places with points: the values between them, and beyond all points, are flagged.
TEST(Prediction, PlacesWithoutPointsAreNotSupported) {
  PointTable table = MapTable(6000, 5, 10);
  std::erase_if(table.positions, [](const Vec3& p) { return p.x() > 247 && p.x() < 251; });
  const PointFit fit = FitPoints(table, {}, {});
  const HeightPredictor predictor(fit.fit.surface, CollectEvidence(fit));
  const std::vector<Vec2> places = {{246, 24}, {252, 24}, {249, 24}, {260, 24}};
  const PredictedHeights heights = predictor.At(places, 0.9, 1);
  EXPECT_THAT(heights.supported, ::testing::ElementsAre(1, 1, 0, 0));
  EXPECT_GT(heights.sd[2], 10 * heights.sd[0]);
  EXPECT_TRUE(std::isnan(heights.z[3]));
  EXPECT_NEAR(heights.z[0], HillAt(places[0]), 5);
}

// The files of a fit give the same prediction as the fit itself.
TEST(Prediction, FilesGiveThePredictionOfTheFit) {
  const std::filesystem::path folder =
      std::filesystem::path(::testing::TempDir()) / "Prediction_FilesGiveThePredictionOfTheFit";
  const PointFit fit = FitPoints(MapTable(2000, 20, 11), {}, {});
  const PointFitOptions options;
  OutputFolder files(folder, WhenNotEmpty::kReplaceFiles);
  WritePointFit(options, {.name = "p.csv", .sha256 = ""}, fit, files, {});
  FittedHeights fitted = ReadFittedHeights(folder);
  ASSERT_TRUE(fitted.evidence);
  const HeightPredictor from_files(std::move(fitted.surface), std::move(fitted.evidence)),
      from_fit(fit.fit.surface, CollectEvidence(fit));
  const PlaceGrid grid = MakePlaceGrid(from_fit.map(), 1.5);
  const std::vector<Vec2> places = grid.Places();
  const PredictedHeights a = from_files.At(places, 0.9, 1), b = from_fit.At(places, 0.9, 1);
  for (std::size_t k = 0; k < places.size(); ++k) {
    EXPECT_NEAR(a.z[k], b.z[k], 1e-6);
    EXPECT_NEAR(a.sd[k], b.sd[k], 1e-3);
    EXPECT_NEAR(a.high[k], b.high[k], 1e-2);
  }
  const NpyArray array = ParseNpy(PredictionNpy(places, a), "npy");
  EXPECT_THAT(array.shape, ::testing::ElementsAre(places.size(), 7));
  EXPECT_EQ(array.values[7 * 3 + 2], a.z[3]);
  const std::string asc = PredictionAsc(grid, a);
  EXPECT_THAT(asc, HasSubstr(fmt::format("ncols {}\nnrows {}\n", grid.columns, grid.rows)));
  EXPECT_THAT(PredictionCsv(places, a), ::testing::StartsWith("x,y,z,sd,low,high,supported\n"));
}

TEST(Prediction, ASurfaceThatIsNoHeightIsRefused) {
  const HSplineShape shape{.patches_u = 8, .patches_v = 8, .max_level = 0};
  const std::vector<Vec3> one_place(static_cast<std::size_t>(shape.Columns(0)) * shape.Rows(0),
                                    Vec3(1, 2, 3));
  const HSplineSurface point(shape, ControlNet{shape.Columns(0), shape.Rows(0), one_place});
  EXPECT_THROW(HeightPredictor(point, std::nullopt), InputError);
}

}  // namespace
}  // namespace semblance::problems
