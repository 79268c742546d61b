// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh_files/text_lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
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

namespace {

// The corners of a polygon in the plane across its mean normal, counterclockwise.
std::vector<Vec2> Flattened(const std::vector<Vec3>& corners) {
  Vec3 normal = Vec3::Zero();
  for (std::size_t k = 0; k < corners.size(); ++k) {
    normal += (corners[k] - corners[0]).cross(corners[(k + 1) % corners.size()] - corners[0]);
  }
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  const int a = (axis + 1) % 3, b = (axis + 2) % 3;
  std::vector<Vec2> flat;
  for (const Vec3& p : corners) {
    flat.push_back(normal[axis] < 0 ? Vec2(p[b], p[a]) : Vec2(p[a], p[b]));
  }
  return flat;
}

// Twice the signed area of a triangle.
double Turn(const Vec2& a, const Vec2& b, const Vec2& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

bool IsConvex(const std::vector<Vec2>& flat) {
  const std::size_t n = flat.size();
  for (std::size_t k = 0; k < n; ++k) {
    if (Turn(flat[k], flat[(k + 1) % n], flat[(k + 2) % n]) < 0) {
      return false;
    }
  }
  return true;
}

// Cuts ears off a polygon until three corners are left.
class EarCutter {
 public:
  explicit EarCutter(std::vector<Vec2> flat) : flat_(std::move(flat)), left_(flat_.size()) {
    std::iota(left_.begin(), left_.end(), std::size_t{0});
  }

  // Returns triangles of positions in the polygon.
  std::vector<std::array<std::size_t, 3>> Cut() {
    std::vector<std::array<std::size_t, 3>> triangles;
    while (left_.size() >= 3) {
      const std::size_t k = FindEar();
      triangles.push_back({Before(k), left_[k], After(k)});
      left_.erase(left_.begin() + static_cast<std::ptrdiff_t>(k));
    }
    return triangles;
  }

 private:
  std::size_t Before(std::size_t k) const { return left_[(k + left_.size() - 1) % left_.size()]; }
  std::size_t After(std::size_t k) const { return left_[(k + 1) % left_.size()]; }

  // The first corner whose triangle turns left and has no other corner inside; the second corner if
  // there is none, which cuts a triangle of the fan.
  std::size_t FindEar() const {
    for (std::size_t k = 0; k < left_.size(); ++k) {
      if (IsEar(Before(k), left_[k], After(k))) {
        return k;
      }
    }
    return 1;
  }

  bool IsEar(std::size_t a, std::size_t b, std::size_t c) const {
    const Vec2 &p = flat_[a], &q = flat_[b], &r = flat_[c];
    return Turn(p, q, r) > 0 && std::ranges::none_of(left_, [&](std::size_t other) {
             const Vec2& s = flat_[other];
             const bool is_corner = s == p || s == q || s == r;
             return !is_corner && Turn(p, q, s) >= 0 && Turn(q, r, s) >= 0 && Turn(r, p, s) >= 0;
           });
  }

  std::vector<Vec2> flat_;
  std::vector<std::size_t> left_;  // positions of the corners that are left
};

}  // namespace

void PolygonFans::Append(std::span<const std::int32_t> corners, std::vector<Triangle>& triangles) {
  if (corners.size() > 3) {
    fans_.push_back({.first = triangles.size(), .corners = corners.size()});
  }
  AppendFan(corners, triangles);
}

void PolygonFans::Finish(TriMesh& mesh, const std::string& name) const {
  constexpr std::size_t kMostCorners = 1000;
  for (const Fan& fan : fans_) {
    const Triangle* const triangles = mesh.triangles.data() + fan.first;
    std::vector<std::int32_t> corners = {triangles[0][0], triangles[0][1]};
    for (std::size_t k = 0; k + 2 < fan.corners; ++k) {
      corners.push_back(triangles[k][2]);
    }
    std::vector<Vec3> points;
    std::ranges::transform(corners, std::back_inserter(points),
                           [&](std::int32_t v) { return mesh.points[v]; });
    std::vector<Vec2> flat = Flattened(points);
    if (IsConvex(flat)) {
      continue;
    }
    if (fan.corners > kMostCorners) {
      throw InputError(fmt::format(
          "{}: a face of {} corners that is not convex; triangulate the mesh in another program",
          name, fan.corners));
    }
    std::size_t next = fan.first;
    for (const auto& [a, b, c] : EarCutter(std::move(flat)).Cut()) {
      mesh.triangles[next++] = {corners[a], corners[b], corners[c]};
    }
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
      goes_on_(options.goes_on_after_backslash),
      number_(options.first_line - 1) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  next_ = text_.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0;
  const std::size_t first = text_.find_first_of("\r\n");
  if (first != text_.npos && text_[first] == '\r' && text_.substr(first + 1, 1) != "\n") {
    line_end_ = '\r';
  }
}

std::string_view TextLines::TakeLine() {
  const std::size_t end = std::min(text_.find(line_end_, next_), text_.size());
  const std::string_view line = text_.substr(next_, end - next_);
  next_ = std::min(end + 1, text_.size());
  ++number_;
  return line;
}

bool TextLines::GoesOn() const {
  const std::size_t last = goes_on_ ? whole_line_.find_last_not_of(" \t\r") : whole_line_.npos;
  return last != whole_line_.npos && whole_line_[last] == '\\' && next_ < text_.size() &&
         whole_line_.find(comment_) == whole_line_.npos;
}

// Replaces the backslash by blanks and appends the next line, as long as there is another one.
void TextLines::JoinNextLines() {
  joined_ = whole_line_;
  do {
    joined_[joined_.find_last_of('\\')] = ' ';
    joined_ += ' ';
    joints_.push_back(joined_.size());
    joined_ += TakeLine();
    whole_line_ = joined_;
  } while (GoesOn());
}

bool TextLines::NextLine() {
  joints_.clear();
  while (next_ < text_.size()) {
    whole_line_ = TakeLine();
    if (GoesOn()) {
      JoinNextLines();
    }
    line_ = whole_line_;
    at_ = 0;
    if (comment_ != '\0') {
      line_ = line_.substr(0, line_.find(comment_));
    }
    if (!AtLineEnd()) {
      return true;
    }
    joints_.clear();
  }
  line_ = whole_line_ = {};
  at_ = 0;
  return false;
}

std::int64_t TextLines::LineNumber() const {
  return number_ - std::ranges::count_if(joints_, [&](std::size_t k) { return k >= at_; });
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
