// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/config/utf8_check.h"

#include <unicode/normalizer2.h>
#include <unicode/unistr.h>

#include <algorithm>

namespace semblance::problems {
namespace {

unsigned char ByteAt(std::string_view text, std::size_t i) {
  return static_cast<unsigned char>(text[i]);
}

// Checks the first two bytes of a sequence of several bytes. Returns false for a sequence that is
// longer than needed, for half of a UTF-16 pair (U+D800 to U+DFFF), and above U+10FFFF.
bool IsValidStart(unsigned char first, unsigned char second) {
  switch (first) {
    case 0xE0:
      return second >= 0xA0;
    case 0xED:
      return second < 0xA0;
    case 0xF0:
      return second >= 0x90;
    case 0xF4:
      return second < 0x90;
    default:
      return true;
  }
}

// Returns the length of the UTF-8 sequence at `i`, or 0 if it is not UTF-8.
std::size_t SequenceLength(std::string_view text, std::size_t i) {
  const unsigned char first = ByteAt(text, i);
  const std::size_t length = first < 0x80                    ? 1
                             : first >= 0xC2 && first < 0xE0 ? 2
                             : first >= 0xE0 && first < 0xF0 ? 3
                             : first >= 0xF0 && first < 0xF5 ? 4
                                                             : 0;
  if (length == 0 || i + length > text.size()) {
    return 0;
  }
  for (std::size_t k = 1; k < length; ++k) {
    if ((ByteAt(text, i + k) & 0xC0) != 0x80) {
      return 0;
    }
  }
  return length == 1 || IsValidStart(first, ByteAt(text, i + 1)) ? length : 0;
}

bool IsControl(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return byte < 0x20 || byte == 0x7F;
}

// Returns the first fault of a line, or "", and sets `column` to its place, from 0.
std::string_view FindFault(std::string_view line, std::size_t& column) {
  const std::size_t first = line.find_first_not_of(" \t");
  const bool is_comment = first != line.npos && line[first] == '#';
  for (column = 0; column < line.size();) {
    const std::size_t length = SequenceLength(line, column);
    if (length == 0) {
      return "a byte that is not UTF-8; save the file as UTF-8";
    }
    if (line[column] == '\t' && !is_comment) {
      return "a tab; use spaces (in a text, write \"\\t\")";
    }
    if (line[column] != '\t' && IsControl(line[column])) {
      return "a control character; remove it";
    }
    column += length;
  }
  return {};
}

}  // namespace

bool RequireReadableBytes(std::string_view text, const std::shared_ptr<const ConfigSource>& source,
                          ConfigErrors& errors) {
  bool is_readable = true;
  int line_number = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    ++line_number;
    if (line.ends_with('\r')) {
      line.remove_suffix(1);
    }
    std::size_t column = 0;
    const std::string_view fault = FindFault(line, column);
    if (!fault.empty()) {
      errors.Add({source, line_number, static_cast<int>(column) + 1}, "", fault);
      is_readable = false;
    }
  }
  return is_readable;
}

std::vector<Character> SplitCharacters(std::string_view text) {
  std::vector<Character> characters;
  for (std::size_t k = 0; k < text.size();) {
    const std::size_t length = SequenceLength(text, k);
    Character next{.bytes = text.substr(k, std::max<std::size_t>(length, 1))};
    if (length > 0) {
      constexpr unsigned kFirstBits[] = {0, 0x7F, 0x1F, 0x0F, 0x07}, kMore = 0x3F;
      next.code = ByteAt(text, k) & kFirstBits[length];
      for (std::size_t n = 1; n < length; ++n) {
        next.code = next.code << 6 | (ByteAt(text, k + n) & kMore);
      }
    }
    characters.push_back(next);
    k += next.bytes.size();
  }
  return characters;
}

bool ControlsText(char32_t code) {
  const auto is_in = [code](char32_t first, char32_t last) {
    return first <= code && code <= last;
  };
  return code < 0x20 || is_in(0x7F, 0x9F) || code == 0x061C || is_in(0x200E, 0x200F) ||
         is_in(0x2028, 0x202E) || is_in(0x2066, 0x2069) || code == Character::kNotUtf8;
}

std::string Normalized(std::string_view text, NormalForm form) {
  const bool is_ascii = std::ranges::all_of(text, [](unsigned char c) { return c < 0x80; });
  if (is_ascii || LineThatIsNotUtf8(text)) {
    return std::string(text);
  }
  UErrorCode error = U_ZERO_ERROR;
  const icu::Normalizer2* const normalizer = form == NormalForm::kComposed
                                                 ? icu::Normalizer2::getNFCInstance(error)
                                                 : icu::Normalizer2::getNFDInstance(error);
  std::string normalized;
  const auto length = static_cast<std::int32_t>(text.size());
  if (U_SUCCESS(error)) {
    normalizer->normalize(icu::UnicodeString::fromUTF8({text.data(), length}), error)
        .toUTF8String(normalized);
  }
  return U_SUCCESS(error) ? normalized : std::string(text);
}

std::optional<int> LineThatIsNotUtf8(std::string_view text) {
  int line = 1;
  for (std::size_t k = 0; k < text.size();) {
    const std::size_t length = SequenceLength(text, k);
    if (length == 0) {
      return line;
    }
    line += text[k] == '\n' ? 1 : 0;
    k += length;
  }
  return std::nullopt;
}

}  // namespace semblance::problems
