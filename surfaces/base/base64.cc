// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/base/base64.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

constexpr std::string_view kDigits =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

// The value of each character; -1 if it is no digit.
std::array<int, 256> DigitValues() {
  std::array<int, 256> values;
  values.fill(-1);
  for (std::size_t k = 0; k < kDigits.size(); ++k) {
    values[static_cast<unsigned char>(kDigits[k])] = static_cast<int>(k);
  }
  return values;
}

std::size_t Padding(std::string_view text) {
  return text.ends_with("==") ? 2 : text.ends_with('=') ? 1 : 0;
}

}  // namespace

std::string Base64(std::string_view bytes) {
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      group = (group << 8) | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      text += k <= count ? kDigits[(group >> (18 - 6 * k)) & 63] : '=';
    }
  }
  return text;
}

std::string FromBase64(std::string_view text) {
  static const std::array<int, 256> kValues = DigitValues();
  if (text.size() % 4 != 0) {
    throw InputError(fmt::format("Base64: {} characters are not a multiple of 4", text.size()));
  }
  const std::size_t digits = text.size() - Padding(text);
  std::string bytes;
  bytes.reserve(text.size() / 4 * 3);
  for (std::size_t i = 0; i < digits; i += 4) {
    std::uint32_t group = 0;
    const std::size_t count = std::min<std::size_t>(4, digits - i);
    for (std::size_t k = 0; k < 4; ++k) {
      const int value = k < count ? kValues[static_cast<unsigned char>(text[i + k])] : 0;
      if (value < 0) {
        throw InputError(fmt::format("Base64: character {} is not one of its digits", i + k + 1));
      }
      group = (group << 6) | static_cast<std::uint32_t>(value);
    }
    for (std::size_t k = 0; k + 1 < count; ++k) {
      bytes += static_cast<char>((group >> (16 - 8 * k)) & 0xFF);
    }
  }
  return bytes;
}

}  // namespace semblance
