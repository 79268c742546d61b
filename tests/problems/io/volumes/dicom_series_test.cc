// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/dicom_series.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/testing/scratch_file.h"

namespace semblance::problems {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::Contains;
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
  EXPECT_THAT(stack.scanned, ElementsAre(1, 2, 0, 3));
  EXPECT_THAT(stack.places, ElementsAre(0, 1, 2, 3));
  EXPECT_LT((stack.origin - series.positions[1]).norm(), 1e-12);
  EXPECT_LT((stack.step - 2 * series.normal).norm(), 1e-12);
  EXPECT_THAT(stack.notes, IsEmpty());
}

TEST(SliceStack, RoundedPositionsAreNotGaps) {
  EXPECT_THAT(Series({0, 0.62, 1.25, 1.87, 2.5, 3.12}).Stack().places, SizeIs(6));
  EXPECT_THAT(Series({0, 0.62, 1.25, 1.87, 2.5, 3.12}).Stack().notes, IsEmpty());
}

TEST(SliceStack, ATiltedGantryMakesASlantedStep) {
  Series series({0, 3, 6});
  const Vec3 across = series.normal.cross(Vec3::UnitX()).normalized();
  for (int k = 0; k < 3; ++k) {
    series.positions[k] += k * std::sqrt(3.0) * across;  // tan 30 deg
  }
  const SliceStack stack = series.Stack();
  EXPECT_LT((stack.step - (series.positions[1] - series.positions[0])).norm(), 1e-12);
}

TEST(SliceStack, AMissingSliceIsAnErrorUnlessFilled) {
  const Series series({0, 2, 4, 8, 10});
  EXPECT_THAT(series.Words(), AllOf(HasSubstr("ct: 1 missing slices"), HasSubstr("fill_slices")));
  const double low = series.positions[2].dot(series.normal);
  EXPECT_THAT(series.Words(), HasSubstr(fmt::format("between {:.2f} and {:.2f} mm", low, low + 4)));
  const SliceStack stack = series.Stack({.fill = true});
  EXPECT_THAT(stack.scanned, ElementsAre(0, 1, 2, 3, 4));
  EXPECT_THAT(stack.places, ElementsAre(0, 1, 2, 2.5, 3, 4));
  EXPECT_THAT(stack.notes, ElementsAre(HasSubstr("interpolated")));
  EXPECT_THAT(Series({0, 2, 4, 18, 20}).Words({.fill = true}), HasSubstr("at most 10 mm"));
}

TEST(SliceStack, ADoubledSliceIsAnErrorUnlessFilled) {
  const Series series({0, 2, 2, 4});
  EXPECT_THAT(series.Words(), AllOf(HasSubstr("1 doubled slices"), HasSubstr("(b and c)")));
  const SliceStack stack = series.Stack({.fill = true});
  EXPECT_THAT(stack.scanned, ElementsAre(0, 1, 3));
  EXPECT_THAT(stack.notes, ElementsAre(HasSubstr("the first of each pair")));
}

// Law: the place of each slice among the scanned ones has the height of that slice.
TEST(SliceStack, UnequalDistancesAreInterpolatedAtEqualOnes) {
  for (const std::vector<double>& heights :
       {std::vector<double>{0, 2, 4, 6, 9, 11}, {0, 6, 12, 18, 27, 36}, {0, 4, 8, 15, 16.08, 23}}) {
    const SliceStack stack = Series(heights).Stack();
    EXPECT_THAT(stack.notes, ElementsAre(HasSubstr("not at equal distances")));
    const double step = heights.back() / static_cast<double>(stack.places.size() - 1);
    EXPECT_NEAR(stack.step.norm(), step, 1e-9);
    for (std::size_t k = 0; k < stack.places.size(); ++k) {
      const auto below = static_cast<std::size_t>(stack.places[k]);
      const std::size_t above = std::min(below + 1, heights.size() - 1);
      const double t = stack.places[k] - static_cast<double>(below);
      EXPECT_NEAR((1 - t) * heights[below] + t * heights[above], step * static_cast<double>(k),
                  1e-9);
    }
  }
}

TEST(SliceStack, AGapBetweenUnequalDistancesIsAnError) {
  EXPECT_THAT(Series({0, 2, 4.5, 10, 12.5}).Words(), HasSubstr("1 missing slices"));
  EXPECT_THAT(Series({0, 2, 4.5, 10, 12.5}).Stack({.fill = true}).notes,
              Contains(HasSubstr("not at equal distances")));
  EXPECT_THAT(Series({0, 8, 16, 27, 38}).Words(), HasSubstr("only distances up to 10 mm"));
}

TEST(SliceStack, AnImpossibleStackIsRefused) {
  EXPECT_THAT(Series({0, 2, 4, 1e13, 3e13}).Words({.fill = true}),  // more steps than an int holds
              AnyOf(HasSubstr("not at equal distances"), HasSubstr("at most 10 mm")));
  EXPECT_THAT(Series({3}).Words(), HasSubstr("needs at least 2"));
  Series displaced({0, 2, 4, 6});
  displaced.positions[2].x() += 30;
  displaced.positions[2] -=
      (displaced.positions[2] - displaced.positions[1]).dot(displaced.normal) * displaced.normal -
      2 * displaced.normal;
  EXPECT_THAT(displaced.Words(), AllOf(HasSubstr("1 slices lie off the line"), HasSubstr("c by ")));
}

// ---------------------------------------------------------------------------------------------
// Texts and numbers
// ---------------------------------------------------------------------------------------------

TEST(DicomText, NumbersAreReadToTheirEnd) {
  EXPECT_THAT(ParseDecimals("-1.5\\+2e1\\ 3 ").numbers, ElementsAre(-1.5, 20, 3));
  EXPECT_FALSE(ParseDecimals("1.5\\2").has_comma);
  const Decimals comma = ParseDecimals("8,9\\0,976");
  EXPECT_THAT(comma.numbers, ElementsAre(8.9, 0.976));
  EXPECT_TRUE(comma.has_comma);
  for (const char* bad : {"8x", "1.2,3", "1,2,3", "", "nan\\1", "1\\\\2", "0x10", "1 2", "inf"}) {
    EXPECT_THAT(ParseDecimals(bad).numbers, IsEmpty()) << bad;
  }
}

TEST(DicomText, EachCharacterSetBecomesUtf8) {
  EXPECT_EQ(DicomTextToUtf8("Sch\xe4"
                            "del",
                            "ISO_IR 100"),
            "Schädel");
  EXPECT_EQ(DicomTextToUtf8("Sch\xe4"
                            "del",
                            ""),
            "Schädel");
  EXPECT_EQ(DicomTextToUtf8("Schädel", ""), "Schädel");
  EXPECT_EQ(DicomTextToUtf8("Schädel", "ISO_IR 192"), "Schädel");
  EXPECT_EQ(DicomTextToUtf8("\xb3owa", "ISO_IR 101"), "łowa");
  EXPECT_EQ(DicomTextToUtf8("\xd3\xe2\xde\xd0", "ISO_IR 144"), "гтоа");
  // Names of the standard: PS3.5, annexes H, I, J and K.
  EXPECT_EQ(DicomTextToUtf8("Yamada^Tarou=\x1b$B;3ED\x1b(B^\x1b$BB@O:\x1b(B", "\\ISO 2022 IR 87"),
            "Yamada^Tarou=山田^太郎");
  EXPECT_EQ(DicomTextToUtf8("\x1b$)C\xfb\xf3^\x1b$)C\xd1\xce\xd4\xd7", "\\ISO 2022 IR 149"),
            "洪^吉洞");
  EXPECT_EQ(DicomTextToUtf8("Wang^XiaoDong=\xcd\xf5^\xd0\xa1\xb6\xab", "GB18030"),
            "Wang^XiaoDong=王^小东");
}

TEST(DicomText, NoControlCharacterAndNoInvalidByteRemains) {
  for (const char* set :
       {"", "ISO_IR 100", "ISO_IR 192", "\\ISO 2022 IR 87", "GB18030", "nonsense"}) {
    std::string all;
    for (int byte = 1; byte < 256; ++byte) {
      all.push_back(static_cast<char>(byte));
      all.push_back('a');
    }
    const std::string text = DicomTextToUtf8(all, set);
    EXPECT_EQ(text, DicomTextToUtf8(text, "ISO_IR 192")) << set;  // valid UTF-8
    for (const char c : text) {
      EXPECT_FALSE((c >= 0 && c < 0x20) || c == 0x7F) << set;
    }
    EXPECT_EQ(text.find("\xc2\x9b"), std::string::npos) << set;  // U+009B begins escapes
  }
}

}  // namespace
}  // namespace semblance::problems
