// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/pictures/image.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <array>
#include <cmath>

#include "problems/report/pictures/colour_map.h"
#include "surfaces/base/error.h"
#include "surfaces/base/geometry.h"
#include "surfaces/mesh_files/srgb.h"
#include "tests/testing/pixels.h"

namespace semblance::problems {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using testing::PixelAt;

// Relative luminance, 0..1 (IEC 61966-2-1).
double Luminance(const Colour& c) {
  return 0.2126 * LinearFromSrgb(c.r) + 0.7152 * LinearFromSrgb(c.g) + 0.0722 * LinearFromSrgb(c.b);
}

void ExpectPictureColour(const Colour& a, const Colour& b, double tolerance) {
  EXPECT_NEAR(a.r, b.r, tolerance);
  EXPECT_NEAR(a.g, b.g, tolerance);
  EXPECT_NEAR(a.b, b.b, tolerance);
}

Image Gradient(int width, int height) {
  Image image = MakeImage(width, height, {0, 0, 0});
  for (std::size_t i = 0; i < image.rgb.size(); ++i) {
    image.rgb[i] = static_cast<std::uint8_t>((7 * i) & 255);
  }
  return image;
}

TEST(Png, AnotherReaderSeesTheSamePixels) {
  const Image image = Gradient(13, 7);
  for (const PngEffort effort : {PngEffort::kSmall, PngEffort::kQuick}) {
    const std::string bytes = EncodePng(image, effort);
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    ASSERT_NE(png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()), 0);
    png.format = PNG_FORMAT_RGB;
    std::vector<std::uint8_t> pixels(PNG_IMAGE_SIZE(png));
    ASSERT_NE(png_image_finish_read(&png, nullptr, pixels.data(), 0, nullptr), 0);
    EXPECT_EQ(png.width, 13u);
    EXPECT_EQ(png.height, 7u);
    EXPECT_EQ(pixels, image.rgb);
  }
}

// A black square on rows of different greys: the greys become transparent, the square stays black.
TEST(Png, APictureForAPageIsHalfAsLargeOnATransparentBackground) {
  Image image = MakeImage(40, 20, {1, 1, 1});
  for (int y = 0; y < 20; ++y) {
    FillRectangle(image, 0, y, 40, 1, {0.9 - 0.01 * y, 0.9, 0.9});
  }
  FillRectangle(image, 10, 6, 20, 8, {0, 0, 0});
  const std::string bytes = PagePng(EncodePng(image));
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  ASSERT_NE(png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()), 0);
  ASSERT_EQ(png.width, 20u);
  ASSERT_EQ(png.height, 10u);
  png.format = PNG_FORMAT_RGBA;
  std::vector<std::uint8_t> pixels(PNG_IMAGE_SIZE(png), 77);
  ASSERT_NE(png_image_finish_read(&png, nullptr, pixels.data(), 0, nullptr), 0);
  for (int y = 0; y < 10; ++y) {
    for (int x = 0; x < 20; ++x) {
      const bool is_square = x >= 5 && x < 15 && y >= 3 && y < 7;
      const std::uint8_t* const p = &pixels[4 * (20 * y + x)];
      EXPECT_EQ(p[3], is_square ? 255 : 0) << x << " " << y;
      if (is_square) {
        EXPECT_EQ(p[0] + p[1] + p[2], 0) << x << " " << y;
      }
    }
  }
  EXPECT_THROW(PagePng("no picture"), InputError);
}

TEST(Png, SameBytesEachTimeWithoutATimestamp) {
  const std::string bytes = EncodePng(Gradient(40, 30));
  EXPECT_EQ(bytes, EncodePng(Gradient(40, 30)));
  EXPECT_THAT(bytes, Not(HasSubstr("tIME")));
  EXPECT_THAT(bytes, Not(HasSubstr("tEXt")));
}

TEST(Png, AnEmptyPictureIsAnError) {
  EXPECT_THROW(EncodePng(Image{}), InputError);
  EXPECT_THROW(MakeImage(0, 5, {}), InputError);
}

TEST(Image, DrawingIsClippedToThePicture) {
  Image image = MakeImage(4, 3, {1, 1, 1});
  FillRectangle(image, -2, -2, 3, 3, {1, 0, 0});
  Paste(image, MakeImage(5, 5, {0, 0, 1}), 3, 2);
  BlendPixel(image, 9, 9, {0, 0, 0}, 1);
  ExpectPictureColour(PixelAt(image, 0, 0), {1, 0, 0}, 0);
  ExpectPictureColour(PixelAt(image, 1, 1), {1, 1, 1}, 0);
  ExpectPictureColour(PixelAt(image, 3, 2), {0, 0, 1}, 0);
}

TEST(Image, PasteCopiesEachPixelAndClipsAtTheEdges) {
  const Image picture = Gradient(5, 4);
  const Image paper = MakeImage(4, 3, {1, 1, 1});
  for (const auto& [x, y] : {std::array{0, 0}, std::array{-2, -3}, std::array{2, 1},
                             std::array{4, 0}, std::array{0, 3}, std::array{-5, -4}}) {
    Image image = paper;
    Paste(image, picture, x, y);
    for (int row = 0; row < image.height; ++row) {
      for (int column = 0; column < image.width; ++column) {
        const bool is_covered =
            column >= x && row >= y && column < x + picture.width && row < y + picture.height;
        ExpectPictureColour(
            PixelAt(image, column, row),
            is_covered ? PixelAt(picture, column - x, row - y) : PixelAt(paper, column, row), 0);
      }
    }
  }
}

TEST(ColourMap, EndsAndBeyond) {
  const ColourMap depth = SequentialMap(2, 30);
  ExpectPictureColour(ColourAt(depth, 2), HexColour(0x440154), 0);
  ExpectPictureColour(ColourAt(depth, 30), HexColour(0xfde725), 0);
  ExpectPictureColour(ColourAt(depth, -1e9), ColourAt(depth, 2), 0);
  ExpectPictureColour(ColourAt(depth, 1e9), ColourAt(depth, 30), 0);
}

TEST(ColourMap, SequentialLuminanceRisesAllTheWayWithoutJumps) {
  const ColourMap map = SequentialMap(0, 1);
  double before = Luminance(ColourAt(map, 0));
  for (int i = 1; i <= 500; ++i) {
    const double now = Luminance(ColourAt(map, i / 500.0));
    EXPECT_GT(now, before) << i;
    EXPECT_LT(now, before + 0.01) << i;
    before = now;
  }
}

TEST(ColourMap, DivergingIsWhiteAtZeroBlueBelowRedAboveAndEvenlyDark) {
  const ColourMap map = DivergingMap(5);
  EXPECT_GT(Luminance(ColourAt(map, 0)), 0.85);
  for (const double mm : {1.0, 2.5, 4.0, 5.0}) {
    const Colour below = ColourAt(map, -mm), above = ColourAt(map, mm);
    EXPECT_GT(below.b, below.r) << mm;
    EXPECT_GT(above.r, above.b) << mm;
    EXPECT_NEAR(Luminance(below), Luminance(above), 0.08) << mm;
  }
}

TEST(ColourMap, NoDataIsGreyAndNoValueHasThatGrey) {
  for (const ColourMap& map : {SequentialMap(0, 10), DivergingMap(10)}) {
    ExpectPictureColour(ColourAt(map, kNaN), kNoDataColour, 0);
    EXPECT_EQ(kNoDataColour.r, kNoDataColour.g);
    EXPECT_EQ(kNoDataColour.g, kNoDataColour.b);
    for (double mm = -10; mm <= 10; mm += 0.1) {
      const Colour c = ColourAt(map, mm);
      const double distance = std::abs(c.r - kNoDataColour.r) + std::abs(c.g - kNoDataColour.g) +
                              std::abs(c.b - kNoDataColour.b);
      EXPECT_GT(distance, 0.15) << mm;
    }
  }
}

TEST(ColourMap, AnEmptyRangeIsAnError) {
  EXPECT_THROW(SequentialMap(3, 3), InputError);
  EXPECT_THROW(SequentialMap(kNaN, 3), InputError);
  EXPECT_THROW(DivergingMap(0), InputError);
}

TEST(ColourMap, StepsRunFromEndToEndAndLinesBetweenThemAreClose) {
  const ColourMap map = DivergingMap(5);
  const std::vector<std::string> steps = ColourSteps(map);
  ASSERT_EQ(steps.size(), 33u);
  EXPECT_EQ(steps.front(), HexText(ColourAt(map, -5)));
  EXPECT_EQ(steps[16], HexText(ColourAt(map, 0)));
  EXPECT_EQ(steps.back(), HexText(ColourAt(map, 5)));
  for (int k = 0; k < 32; ++k) {
    const auto at = [&](double step) { return ColourAt(map, -5 + 10 * step / 32); };
    const Colour a = at(k), b = at(k + 1);
    ExpectPictureColour(at(k + 0.5), {(a.r + b.r) / 2, (a.g + b.g) / 2, (a.b + b.b) / 2}, 0.01);
  }
}

}  // namespace
}  // namespace semblance::problems
