// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/pictures/image.h"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "problems/io/output_folder.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

std::uint8_t Byte(double value) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(value, 0.0, 1.0)));
}

std::size_t Offset(const Image& image, int x, int y) {
  return 3 * (static_cast<std::size_t>(y) * image.width + x);
}

// Called by libpng. The string has reserved enough memory.
void AppendBytes(png_structp png, png_bytep data, png_size_t size) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<char*>(data), size);
}

void Flush(png_structp) {}

// Pixels row by row, 3 (RGB) or 4 (RGBA) bytes each.
struct PixelRows {
  int width = 0, height = 0, channels = 3;
  const std::uint8_t* bytes = nullptr;
};

// Two of libpng's five filters: all five take 1.5 times as long and save no bytes. libpng reports
// errors by longjmp, so no object in this function has a destructor.
bool WriteRows(png_structp png, png_infop info, const PixelRows& image, PngEffort effort) {
  const bool quick = effort == PngEffort::kQuick;
  if (setjmp(png_jmpbuf(png)) != 0) {
    return false;
  }
  png_set_IHDR(png, info, static_cast<png_uint_32>(image.width),
               static_cast<png_uint_32>(image.height), 8,
               image.channels == 4 ? PNG_COLOR_TYPE_RGBA : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
  png_set_filter(png, PNG_FILTER_TYPE_BASE, quick ? PNG_FILTER_UP : PNG_FILTER_SUB | PNG_FILTER_UP);
  png_set_compression_level(png, quick ? 2 : 4);
  png_write_info(png, info);
  for (int row = 0; row < image.height; ++row) {
    png_write_row(png, image.bytes + static_cast<std::size_t>(row) * image.width * image.channels);
  }
  png_write_end(png, info);
  return true;
}

// Returns false if libpng runs out of memory.
bool WritePng(const PixelRows& image, PngEffort effort, std::string& bytes) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png != nullptr ? png_create_info_struct(png) : nullptr;
  if (info != nullptr) {
    png_set_write_fn(png, &bytes, AppendBytes, Flush);
  }
  const bool written = info != nullptr && WriteRows(png, info, image, effort);
  png_destroy_write_struct(&png, &info);
  return written;
}

bool IsInside(const Image& image, int x, int y) {
  return x >= 0 && y >= 0 && x < image.width && y < image.height;
}

// Reads a PNG file as rows of red, green, blue and alpha.
struct RgbaImage {
  int width = 0, height = 0;  // pixels
  std::vector<std::uint8_t> bytes;
};

RgbaImage DecodePng(const std::string& png) {
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&header, png.data(), png.size()) == 0) {
    throw InputError("picture: libpng cannot read it; it is no PNG file");
  }
  header.format = PNG_FORMAT_RGBA;
  RgbaImage image{.width = static_cast<int>(header.width),
                  .height = static_cast<int>(header.height),
                  .bytes = std::vector<std::uint8_t>(PNG_IMAGE_SIZE(header))};
  if (png_image_finish_read(&header, nullptr, image.bytes.data(), 0, nullptr) == 0) {
    throw InputError("picture: libpng cannot read it; the PNG file is damaged");
  }
  return image;
}

void ClearBackground(RgbaImage& image) {
  for (int y = 0; y < image.height; ++y) {
    std::uint8_t* const row = &image.bytes[4 * static_cast<std::size_t>(y) * image.width];
    const std::array<std::uint8_t, 3> first = {row[0], row[1], row[2]};
    for (int x = 0; x < image.width; ++x) {
      if (std::equal(first.begin(), first.end(), row + 4 * x)) {
        row[4 * x + 3] = 0;
      }
    }
  }
}

// Means of two by two pixels, weighted by alpha. An odd last row or column is left out.
RgbaImage Halved(const RgbaImage& image) {
  RgbaImage half{
      .width = std::max(image.width / 2, 1), .height = std::max(image.height / 2, 1), .bytes = {}};
  for (int y = 0; y < half.height; ++y) {
    for (int x = 0; x < half.width; ++x) {
      std::array<unsigned, 4> sums = {};  // colours times alpha, alpha
      for (const auto& [dx, dy] : {std::pair(0, 0), {1, 0}, {0, 1}, {1, 1}}) {
        const int column = std::min(2 * x + dx, image.width - 1);
        const int row = std::min(2 * y + dy, image.height - 1);
        const std::uint8_t* const p =
            &image.bytes[4 * (static_cast<std::size_t>(row) * image.width + column)];
        for (int c = 0; c < 3; ++c) {
          sums[c] += p[c] * p[3];
        }
        sums[3] += p[3];
      }
      for (int c = 0; c < 3; ++c) {
        half.bytes.push_back(static_cast<std::uint8_t>(sums[3] > 0 ? sums[c] / sums[3] : 0));
      }
      half.bytes.push_back(static_cast<std::uint8_t>(sums[3] / 4));
    }
  }
  return half;
}

std::string EncodePixels(const PixelRows& image, PngEffort effort) {
  std::string bytes;
  png_image largest{};
  largest.width = static_cast<png_uint_32>(image.width);
  largest.height = static_cast<png_uint_32>(image.height);
  largest.format = image.channels == 4 ? PNG_FORMAT_RGBA : PNG_FORMAT_RGB;
  bytes.reserve(PNG_IMAGE_PNG_SIZE_MAX(largest));  // so that AppendBytes allocates nothing
  if (!WritePng(image, effort, bytes)) {
    throw InputError(fmt::format("picture of {} x {} pixels: libpng cannot write it", image.width,
                                 image.height));
  }
  return bytes;
}

}  // namespace

std::string PagePng(const std::string& png) {
  RgbaImage image = DecodePng(png);
  ClearBackground(image);
  const RgbaImage half = Halved(image);
  return EncodePixels({half.width, half.height, 4, half.bytes.data()}, PngEffort::kSmall);
}

Colour HexColour(std::uint32_t rrggbb) {
  return {((rrggbb >> 16) & 255) / 255.0, ((rrggbb >> 8) & 255) / 255.0, (rrggbb & 255) / 255.0};
}

std::string HexText(const Colour& colour) {
  const auto byte = [](double x) { return std::lround(255 * std::clamp(x, 0.0, 1.0)); };
  return fmt::format("#{:02x}{:02x}{:02x}", byte(colour.r), byte(colour.g), byte(colour.b));
}

Image MakeImage(int width, int height, const Colour& colour) {
  if (width < 1 || height < 1) {
    throw InputError(
        fmt::format("picture of {} x {} pixels: both sides must be at least 1", width, height));
  }
  Image image{.width = width, .height = height, .rgb = {}};
  image.rgb.resize(Offset(image, 0, height));
  FillRectangle(image, 0, 0, width, height, colour);
  return image;
}

void BlendPixel(Image& image, int x, int y, const Colour& colour, double coverage) {
  if (!IsInside(image, x, y) || !(coverage > 0)) {
    return;
  }
  std::uint8_t* pixel = &image.rgb[Offset(image, x, y)];
  const double c = std::min(coverage, 1.0);
  pixel[0] = Byte((1 - c) * pixel[0] / 255 + c * colour.r);
  pixel[1] = Byte((1 - c) * pixel[1] / 255 + c * colour.g);
  pixel[2] = Byte((1 - c) * pixel[2] / 255 + c * colour.b);
}

void FillRectangle(Image& image, int x, int y, int width, int height, const Colour& colour) {
  const std::uint8_t bytes[3] = {Byte(colour.r), Byte(colour.g), Byte(colour.b)};
  const int left = std::max(x, 0), right = std::min(x + width, image.width);
  const int top = std::max(y, 0), bottom = std::min(y + height, image.height);
  if (left >= right || top >= bottom) {
    return;
  }
  for (int column = left; column < right; ++column) {
    std::copy_n(bytes, 3, &image.rgb[Offset(image, column, top)]);
  }
  for (int row = top + 1; row < bottom; ++row) {
    std::copy_n(&image.rgb[Offset(image, left, top)], 3 * (right - left),
                &image.rgb[Offset(image, left, row)]);
  }
}

void Paste(Image& onto, const Image& picture, int x, int y) {
  const int left = std::max(x, 0), right = std::min(x + picture.width, onto.width);
  const int top = std::max(y, 0), bottom = std::min(y + picture.height, onto.height);
  for (int row = top; row < bottom && left < right; ++row) {
    std::copy_n(&picture.rgb[Offset(picture, left - x, row - y)], 3 * (right - left),
                &onto.rgb[Offset(onto, left, row)]);
  }
}

std::string EncodePng(const Image& image, PngEffort effort) {
  if (image.width < 1 || image.height < 1 || image.rgb.size() != Offset(image, 0, image.height)) {
    throw InputError(fmt::format("picture of {} x {} pixels with {} bytes: it has no valid pixels",
                                 image.width, image.height, image.rgb.size()));
  }
  return EncodePixels({image.width, image.height, 3, image.rgb.data()}, effort);
}

}  // namespace semblance::problems
