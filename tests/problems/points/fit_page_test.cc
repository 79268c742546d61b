// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/fit_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "problems/points/fit_maps.h"
#include "surfaces/base/quantile.h"
#include "tests/testing/scattered_data.h"

namespace semblance::problems {
namespace {

using ::testing::AllOf;
using testing::FrankePoint;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::Scattered;

PointTable Points(int count) {
  const FitTarget target = Scattered(FrankePoint, count, 1e-3, 1);
  PointTable table;
  for (const FitPoint& p : target.points) {
    table.positions.push_back(p.position);
    table.uv.push_back(p.uv);
  }
  return table;
}

PointFitOptions Adaptive(double tolerance_mm, int finest) {
  PointFitOptions options;
  options.fit.plan = AdaptivePlan{.tolerance_mm = tolerance_mm, .finest = finest};
  options.patches_u = 2;
  options.patches_v = 2;
  return options;
}

TEST(FitMaps, EveryPointIsInOneCellAndTheCellsCoverTheDomain) {
  const PointFit fit = FitPoints(Points(2000), Adaptive(0.01, 3), {});
  double area = 0;
  long points = 0;
  for (const FitCell& cell : FindFitCells(fit.fit)) {
    area += cell.width * cell.height;
    points += cell.points;
  }
  EXPECT_NEAR(area, 1, 1e-12);
  EXPECT_EQ(points, 2000);
}

TEST(FitMaps, TheGridIsTheSurfaceAndHoldsTheDistances) {
  const PointFit fit = FitPoints(Points(2000), Adaptive(0.01, 3), {});
  const FitGrid grid = SampleFit(fit.fit, 1);
  const int i = 30, j = 77;
  const Vec2 uv(i / (grid.columns - 1.0), j / (grid.rows - 1.0));
  EXPECT_LT((grid.mesh.points[i + grid.columns * j] - fit.fit.surface.Point(uv)).norm(), 1e-12);
  double largest = 0;
  for (const double value : grid.rms_mm) {
    largest = std::isnan(value) ? largest : std::max(largest, value);
  }
  EXPECT_LE(largest, *std::ranges::max_element(fit.fit.residual_mm));
  EXPECT_GT(largest, fit.fit.point_rms_mm);
}

TEST(FitMaps, TheGridIsClosedAsTheSurfaceIs) {
  const auto border_edges = [](Closure closure) {
    FitResult fit = FitPoints(Points(30), Adaptive(0.01, 0), {}).fit;
    fit.surface = testing::PlainStart({.patches_u = 4, .patches_v = 4, .closure = closure});
    return BorderEdges(SampleFit(fit, 1).mesh).size();
  };
  const std::size_t open = border_edges(Closure::kOpen);
  EXPECT_EQ(open % 4, 0U);
  EXPECT_EQ(border_edges(Closure::kPeriodicU), open / 2);
}

TEST(FitMaps, QuantilesAreThoseOfAllNumbers) {
  for (const int count : {1, 2, 3, 20, 21, 40, 1000}) {
    PointFit fit = FitPoints(Points(30), Adaptive(0.01, 0), {});
    fit.fit.residual_mm.clear();
    for (int k = 0; k < count; ++k) {
      fit.fit.residual_mm.push_back((k * 7919) % count * 0.37);  // in no order
    }
    fit.fit.residual_mm.push_back(NAN);
    const std::vector<WeightedValue> sorted = SortedValues(fit.fit.residual_mm);
    const DistanceQuantiles found = ComputeQuantiles(fit.fit);
    EXPECT_EQ(found.median_mm, Quantile(sorted, 0.5)) << count;
    EXPECT_EQ(found.p95_mm, Quantile(sorted, 0.95)) << count;
    EXPECT_EQ(found.max_mm, Quantile(sorted, 1)) << count;
  }
}

TEST(FitMaps, AMissedToleranceIsReportedWithTheRemedy) {
  const PointFit coarse = FitPoints(Points(2000), Adaptive(0.004, 0), {});
  const ToleranceReport missed =
      CompareWithTolerance(coarse.fit, {.tolerance_mm = 0.004, .finest = 0});
  const auto beyond =
      std::ranges::count_if(coarse.fit.residual_mm, [](double r) { return r > 0.004; });
  EXPECT_EQ(missed.beyond, beyond);
  EXPECT_GT(missed.beyond, 0);
  EXPECT_EQ(missed.at_finest, missed.cells);
  EXPECT_THAT(ToleranceText(missed), AllOf(HasSubstr("THE TOLERANCE WAS MISSED"),
                                           HasSubstr("of 2000 points"), HasSubstr("finest")));
  const ToleranceReport met = CompareWithTolerance(coarse.fit, {.tolerance_mm = 10, .finest = 0});
  EXPECT_TRUE(met.Met());
  EXPECT_THAT(ToleranceText(met), HasSubstr("is met"));
}

TEST(FitPage, ReportsAMissedToleranceAndEscapesText) {
  const PointFitOptions options = Adaptive(0.004, 0);
  const PointFit fit = FitPoints(Points(500), options, {});
  const PointSource source{"<b>hostile</b>.csv", "0123"};
  const std::string html = FitPageHtml(options, source, fit, 2);
  EXPECT_THAT(html,
              AllOf(HasSubstr("THE TOLERANCE WAS MISSED"), HasSubstr("id=\"notes\""),
                    HasSubstr("&lt;b&gt;hostile&lt;/b&gt;.csv"), Not(HasSubstr("<b>hostile"))));
  EXPECT_LT(html.find("<p>THE TOLERANCE"), html.find("id=\"s1\""));
  EXPECT_EQ(html, FitPageHtml(options, source, fit, 1));  // whatever the number of threads
}

}  // namespace
}  // namespace semblance::problems
