// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/pictures/image.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "problems/pictures/colour_map.h"
#include "problems/pictures/stroke_font.h"
#include "surfaces/base/error.h"
#include "surfaces/base/geometry.h"
#include "surfaces/mesh_files/srgb.h"
#include "tests/testing/pixels.h"

namespace semblance {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::PixelAt;

// Relative luminance, 0..1 (IEC 61966-2-1).
double Luminance(const Colour& c) {
  return 0.2126 * LinearFromSrgb(c.r) + 0.7152 * LinearFromSrgb(c.g) + 0.0722 * LinearFromSrgb(c.b);
}

void ExpectColour(const Colour& a, const Colour& b, double tolerance) {
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

double Ink(const Image& image) {  // pixels worth of black on white
  double ink = 0;
  for (const std::uint8_t byte : image.rgb) {
    ink += (255 - byte) / (3 * 255.0);
  }
  return ink;
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

TEST(Png, SameBytesEachTimeAndNoTimeInThem) {
  const std::string bytes = EncodePng(Gradient(40, 30));
  EXPECT_EQ(bytes, EncodePng(Gradient(40, 30)));
  EXPECT_THAT(bytes, Not(HasSubstr("tIME")));
  EXPECT_THAT(bytes, Not(HasSubstr("tEXt")));
}

TEST(Png, NothingToWriteIsAnError) {
  EXPECT_THROW(EncodePng(Image{}), InputError);
  EXPECT_THROW(MakeImage(0, 5, {}), InputError);
}

TEST(Image, DrawingIsClippedToThePicture) {
  Image image = MakeImage(4, 3, {1, 1, 1});
  FillRectangle(image, -2, -2, 3, 3, {1, 0, 0});
  Paste(image, MakeImage(5, 5, {0, 0, 1}), 3, 2);
  BlendPixel(image, 9, 9, {0, 0, 0}, 1);
  ExpectColour(PixelAt(image, 0, 0), {1, 0, 0}, 0);
  ExpectColour(PixelAt(image, 1, 1), {1, 1, 1}, 0);
  ExpectColour(PixelAt(image, 3, 2), {0, 0, 1}, 0);
}

TEST(Image, APictureIsPastedPixelByPixelAndBeyondTheEdgesNotAtAll) {
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
        ExpectColour(
            PixelAt(image, column, row),
            is_covered ? PixelAt(picture, column - x, row - y) : PixelAt(paper, column, row), 0);
      }
    }
  }
}

TEST(Lettering, EveryPrintableCharacterHasItsOwnShape) {
  std::vector<std::vector<std::uint8_t>> shapes;
  for (char c = '!'; c <= '~'; ++c) {
    Image image = MakeImage(40, 40, {1, 1, 1});
    DrawText(image, 8, 28, std::string(1, c), {.cap_height_px = 20, .colour = {0, 0, 0}});
    EXPECT_GT(Ink(image), 3) << c;
    EXPECT_EQ(std::count(shapes.begin(), shapes.end(), image.rgb), 0) << c;
    shapes.push_back(image.rgb);
  }
}

TEST(Lettering, InkGrowsWithTheSquareOfTheSizeAndStaysInItsWidth) {
  const auto draw = [](double size) {
    Image image = MakeImage(600, 100, {1, 1, 1});
    const TextStyle style{.cap_height_px = size, .colour = {0, 0, 0}};
    DrawText(image, 20, 70, "H\u00b12.5 mm", style);
    const double width = TextWidth("H\u00b12.5 mm", style);
    for (int y = 0; y < image.height; ++y) {
      for (int x = static_cast<int>(20 + width + 0.1 * size) + 2; x < image.width; ++x) {
        EXPECT_EQ(PixelAt(image, x, y).r, 1) << x;
      }
    }
    return Ink(image);
  };
  EXPECT_NEAR(draw(40) / draw(20), 4, 0.15);
}

TEST(Lettering, AnchorsMoveTheTextByItsWidth) {
  const auto draw = [](double x, Anchor anchor) {
    Image image = MakeImage(200, 40, {1, 1, 1});
    DrawText(image, x, 30, "depth", {.cap_height_px = 16, .anchor = anchor});
    return image.rgb;
  };
  const double width = TextWidth("depth", {.cap_height_px = 16});
  EXPECT_EQ(draw(20, Anchor::kLeft), draw(20 + width, Anchor::kRight));
  EXPECT_EQ(draw(20, Anchor::kLeft), draw(20 + width / 2, Anchor::kCentre));
}

TEST(ColourMap, EndsAndBeyond) {
  const ColourMap depth = SequentialMap(2, 30);
  ExpectColour(ColourAt(depth, 2), HexColour(0x440154), 0);
  ExpectColour(ColourAt(depth, 30), HexColour(0xfde725), 0);
  ExpectColour(ColourAt(depth, -1e9), ColourAt(depth, 2), 0);
  ExpectColour(ColourAt(depth, 1e9), ColourAt(depth, 30), 0);
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

TEST(ColourMap, NoDataIsGreyAndNoValueIsThatGrey) {
  for (const ColourMap& map : {SequentialMap(0, 10), DivergingMap(10)}) {
    ExpectColour(ColourAt(map, kNaN), kNoDataColour, 0);
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

TEST(ColourMap, RangesThatAreNoneAreErrors) {
  EXPECT_THROW(SequentialMap(3, 3), InputError);
  EXPECT_THROW(SequentialMap(kNaN, 3), InputError);
  EXPECT_THROW(DivergingMap(0), InputError);
}

TEST(Legend, TicksAreRoundNumbersWithinTheRange) {
  EXPECT_THAT(Ticks(SequentialMap(0, 25), 5), ElementsAre(0, 5, 10, 15, 20, 25));
  EXPECT_THAT(Ticks(DivergingMap(5), 5), ElementsAre(-4, -2, 0, 2, 4));
  EXPECT_THAT(Ticks(SequentialMap(1.2, 3.9), 6), ElementsAre(1.5, 2, 2.5, 3, 3.5));
}

TEST(Legend, BarRunsThroughTheMapFromLeftToRight) {
  Image image = MakeImage(600, 84, {1, 1, 1});
  const ColourMap map = DivergingMap(5);
  DrawLegend(image, {.map = map, .title = "signed error"}, 0, 0, 600, 84);
  const int row = 84 / 2 + 2;
  ExpectColour(PixelAt(image, 121, row), ColourAt(map, -5), 0.02);
  ExpectColour(PixelAt(image, 300, row), ColourAt(map, 0), 0.02);
  ExpectColour(PixelAt(image, 478, row), ColourAt(map, 5), 0.02);
  ExpectColour(PixelAt(image, 519, row), kNoDataColour, 0.01);
}

// The columns of [top, bottom) with ink in them, in groups that at least `gap` blank ones part.
int InkedGroups(const Image& image, int top, int bottom, int gap) {
  int groups = 0, blank = gap;
  for (int x = 0; x < image.width; ++x) {
    bool inked = false;
    for (int y = top; y < bottom; ++y) {
      inked = inked || PixelAt(image, x, y).g < 0.5;
    }
    groups += inked && blank >= gap ? 1 : 0;
    blank = inked ? 0 : blank + 1;
  }
  return groups;
}

TEST(Legend, EachTickHasALabelWithRoomAroundItWhateverTheSizeOfTheNumbers) {
  for (const double high : {3e-12, 2.3e-6, 4.7e-4, 0.031, 1.0, 25.0, 8800.0, 7.1e5, 4e9}) {
    for (const int width : {400, 600, 1200}) {
      Image image = MakeImage(width, 84, {1, 1, 1});
      DrawLegend(image,
                 {.map = SequentialMap(0, high), .title = "distance", .shows_no_data = false}, 0, 0,
                 width, 84);
      const int ticks = InkedGroups(image, 52, 54, 1);
      EXPECT_GE(ticks, 2) << high;
      EXPECT_EQ(InkedGroups(image, 58, 74, 7), ticks) << high << " in " << width;
    }
  }
}

}  // namespace
}  // namespace semblance
