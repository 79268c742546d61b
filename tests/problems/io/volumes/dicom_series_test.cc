// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/dicom_series.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/testing/scratch_file.h"

namespace semblance::problems {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using testing::WordsOf;

// Slices named a, b, c ... at the given heights along an oblique normal.
struct Series {
  Vec3 normal = Vec3(0.1, -0.2, 1).normalized();
  std::vector<Vec3> positions;
  std::vector<std::string> names;

  explicit Series(const std::vector<double>& heights_mm) {
    for (const double height : heights_mm) {
      positions.push_back(Vec3(5, 6, 7) + height * normal);
      names.emplace_back(1, static_cast<char>('a' + names.size()));
    }
  }
  SliceStack Stack(const StackOptions& options = {}) const {
    return StackSlices(positions, normal, names, options, "ct");
  }
  std::string Words(const StackOptions& options = {}) const {
    return WordsOf<InputError>([&] { Stack(options); });
  }
};

TEST(SliceStack, SlicesAreSortedAlongTheirNormal) {
  const Series series({4, 0, 2, 6});
  const SliceStack stack = series.Stack();
  EXPECT_THAT(stack.slices, ElementsAre(1, 2, 0, 3));
  EXPECT_LT((stack.origin - series.positions[1]).norm(), 1e-12);
  EXPECT_LT((stack.step - 2 * series.normal).norm(), 1e-12);
  EXPECT_LT(TiltDeg(stack, series.normal), 1e-5);
  EXPECT_THAT(stack.notes, IsEmpty());
}

TEST(SliceStack, RoundedPositionsAreNotGaps) {
  EXPECT_THAT(Series({0, 0.62, 1.25, 1.87, 2.5, 3.12}).Stack().slices, SizeIs(6));
  EXPECT_THAT(Series({0, 0.62, 1.25, 1.87, 2.5, 3.12}).Stack().notes, IsEmpty());
}

TEST(SliceStack, ATiltedGantryMakesASlantedStep) {
  Series series({0, 3, 6});
  const Vec3 across = series.normal.cross(Vec3::UnitX()).normalized();
  for (int k = 0; k < 3; ++k) {
    series.positions[k] += k * std::sqrt(3.0) * across;  // tan 30 deg
  }
  const SliceStack stack = series.Stack();
  EXPECT_NEAR(TiltDeg(stack, series.normal), 30, 1e-9);
  EXPECT_LT((stack.step - (series.positions[1] - series.positions[0])).norm(), 1e-12);
}

TEST(SliceStack, AMissingSliceIsAnErrorUnlessFilled) {
  const Series series({0, 2, 4, 8, 10});
  EXPECT_THAT(series.Words(), AllOf(HasSubstr("ct: 1 missing slices"), HasSubstr("fill_slices")));
  const double low = series.positions[2].dot(series.normal);
  EXPECT_THAT(series.Words(), HasSubstr(fmt::format("between {:.2f} and {:.2f} mm", low, low + 4)));
  const SliceStack stack = series.Stack({.fill = true});
  EXPECT_THAT(stack.slices, ElementsAre(0, 1, 2, -1, 3, 4));
  EXPECT_THAT(stack.notes, ElementsAre(HasSubstr("interpolated")));
  EXPECT_THAT(Series({0, 2, 4, 18, 20}).Words({.fill = true}), HasSubstr("at most 10 mm"));
}

TEST(SliceStack, ADoubledSliceIsAnErrorUnlessFilled) {
  const Series series({0, 2, 2, 4});
  EXPECT_THAT(series.Words(), AllOf(HasSubstr("1 doubled slices"), HasSubstr("(b and c)")));
  const SliceStack stack = series.Stack({.fill = true});
  EXPECT_THAT(stack.slices, ElementsAre(0, 1, 3));
  EXPECT_THAT(stack.notes, ElementsAre(HasSubstr("the first of each pair")));
}

TEST(SliceStack, AnIrregularStackIsRefused) {
  EXPECT_THAT(Series({0, 2, 4, 6, 9, 11}).Words({.fill = true}),
              HasSubstr("not at equal distances"));
  EXPECT_THAT(Series({0, 2, 4, 1e13, 3e13}).Words({.fill = true}),  // more steps than an int holds
              HasSubstr("not at equal distances"));
  EXPECT_THAT(Series({3}).Words(), HasSubstr("needs at least 2"));
  Series displaced({0, 2, 4, 6});
  displaced.positions[2].x() += 30;
  displaced.positions[2] -=
      (displaced.positions[2] - displaced.positions[1]).dot(displaced.normal) * displaced.normal -
      2 * displaced.normal;
  EXPECT_THAT(displaced.Words(), AllOf(HasSubstr("1 slices lie off the line"), HasSubstr("c by ")));
}

}  // namespace
}  // namespace semblance::problems
