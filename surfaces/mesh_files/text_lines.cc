// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh_files/text_lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <system_error>
#include <utility>

#include "surfaces/base/error.h"

namespace semblance::surfaces {
namespace {

bool IsBlank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

// Like from_chars, but with a leading plus sign, which from_chars refuses.
template <class T>
std::from_chars_result Parse(const char* begin, const char* end, T& value) {
  if (end - begin > 1 && begin[0] == '+' && begin[1] != '-') {
    ++begin;
  }
  return std::from_chars(begin, end, value);
}

}  // namespace

double SingleStep(double coordinate) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const float single = std::abs(static_cast<float>(coordinate));
  return std::isfinite(single) ? double{std::nextafter(single, kInfinity)} - single : kInfinity;
}

void AppendFan(std::span<const std::int32_t> corners, std::vector<Triangle>& triangles) {
  for (std::size_t c = 2; c < corners.size(); ++c) {
    triangles.push_back({corners[0], corners[c - 1], corners[c]});
  }
}

std::string Shown(std::string_view piece) {
  constexpr std::size_t kLongest = 40;
  std::string shown(piece.substr(0, kLongest));
  std::replace_if(
      shown.begin(), shown.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return piece.size() > kLongest ? shown + "..." : shown;
}

bool IsPadding(std::string_view bytes) {
  return std::all_of(bytes.begin(), bytes.end(), [](char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\0';
  });
}

TextLines::TextLines(std::string_view text, std::string name, const Options& options)
    : text_(text),
      name_(std::move(name)),
      comment_(options.comment),
      number_(options.first_line - 1) {}

bool TextLines::NextLine() {
  while (next_ < text_.size()) {
    const std::size_t end = std::min(text_.find('\n', next_), text_.size());
    line_ = whole_line_ = text_.substr(next_, end - next_);
    next_ = std::min(end + 1, text_.size());
    ++number_;
    at_ = 0;
    if (comment_ != '\0') {
      line_ = line_.substr(0, line_.find(comment_));
    }
    if (!AtLineEnd()) {
      return true;
    }
  }
  line_ = whole_line_ = {};
  at_ = 0;
  return false;
}

bool TextLines::AtLineEnd() {
  while (at_ < line_.size() && IsBlank(line_[at_])) {
    ++at_;
  }
  return at_ == line_.size();
}

std::string_view TextLines::NextWord() {
  AtLineEnd();
  const std::size_t begin = at_;
  while (at_ < line_.size() && !IsBlank(line_[at_])) {
    ++at_;
  }
  return line_.substr(begin, at_ - begin);
}

std::string_view TextLines::RestOfLine() {
  AtLineEnd();
  return line_.substr(at_);
}

std::string_view TextLines::RestAsName() {
  std::string_view rest = whole_line_.substr(at_);
  while (!rest.empty() && IsBlank(rest.front())) {
    rest.remove_prefix(1);
  }
  while (!rest.empty() && IsBlank(rest.back())) {
    rest.remove_suffix(1);
  }
  return rest;
}

// A number that is too small for T becomes zero; one that is too large is an error.
template <class T>
T TextLines::OutOfRange(std::string_view word) const {
  double value = 0;
  const auto [end, error] = Parse(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || std::abs(value) >= 1) {
    Fail(fmt::format("'{}' is too large or too small a number; rescale the mesh to mm",
                     Shown(word)));
  }
  return static_cast<T>(value);
}

template <class T>
T TextLines::NextNumber() {
  if (AtLineEnd()) {
    Fail("a number is missing at the line's end; write the line again or repair the mesh");
  }
  T value = 0;
  const char *begin = line_.data() + at_, *line_end = line_.data() + line_.size();
  const auto [end, error] = Parse(begin, line_end, value);
  if (error == std::errc() && (end == line_end || IsBlank(*end))) {
    at_ = static_cast<std::size_t>(end - line_.data());
    return value;
  }
  const std::string_view word = NextWord();
  if (error == std::errc::result_out_of_range && end == word.data() + word.size()) {
    return OutOfRange<T>(word);
  }
  Fail(fmt::format("'{}' is not a number; numbers are like -12.5 or 1e-3", Shown(word)));
}

float TextLines::NextFloat() { return NextNumber<float>(); }
double TextLines::NextDouble() { return NextNumber<double>(); }

Vec3 TextLines::NextPoint() {
  Vec3 point;
  for (int a = 0; a < 3; ++a) {
    const std::size_t begin = at_;
    point[a] = NextFloat();
    if (SingleStep(point[a]) > kCoordinateStep_mm && std::isfinite(point[a])) {
      at_ = begin;
      point[a] = NextDouble();
    }
  }
  if (!point.allFinite()) {
    Fail("a coordinate is not finite; remove the vertex or repair the mesh");
  }
  return point;
}

std::int64_t TextLines::NextInteger(const char* what, std::int64_t lowest, std::int64_t highest) {
  const std::string_view word = NextWord();
  if (word.empty()) {
    Fail(fmt::format("the {} is missing at the line's end", what));
  }
  std::int64_t value = 0;
  const auto [end, error] = Parse(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size() || value < lowest ||
      value > highest) {
    Fail(fmt::format("'{}' cannot be the {}; allowed are whole numbers from {} to {}", Shown(word),
                     what, lowest, highest));
  }
  return value;
}

void TextLines::ExpectLineEnd() {
  if (!AtLineEnd()) {
    Fail(fmt::format("'{}' is more than this line may hold; remove it", Shown(RestOfLine())));
  }
}

void TextLines::FailAt(std::int64_t line, const std::string& what) const {
  throw InputError(fmt::format("{}: line {}: {}", name_, line, what));
}

}  // namespace semblance::surfaces
