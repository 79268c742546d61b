// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/pictures/stroke_font.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance {
namespace {

// A glyph: its width, then strokes. Points are pairs of base-36 digits (x right, y down): capitals
// reach from y = 0 to the baseline y = 16 (g), small letters from 6, descenders to 21 (l). A stroke
// is a polyline (-), a quadratic spline on its control polygon, open (~) or closed (@), or a dot
// (.). A control point given twice makes a corner.
struct Glyph {
  std::uint32_t code_point;
  std::string_view strokes;
};

constexpr Glyph kGlyphs[] = {
    {' ', "4"},
    {'!', "2 -101b .1f"},
    {'"', "5 -0004 -5054"},
    {'#', "b -412f -917f -05b5 -0bbb"},
    {'$', "a ~a4a20208a8ae0e0c -505g"},
    {'%', "c @00505606 @7acacg7g -b01g"},
    {'&', "c ~cg35209085080g8gb9"},
    {'\'', "1 -0004"},
    {'(', "4 ~40040c4g"},
    {')', "4 ~00444c0g"},
    {'*', "8 -4149 -0387 -8307"},
    {'+', "a -555f -0aaa"},
    {',', "2 -1e0i"},
    {'-', "6 -0a6a"},
    {'.', "1 .0f"},
    {'/', "7 -700g"},
    {'0', "a @00a0ag0g"},
    {'1', "5 -03505g"},
    {'2', "a ~0400a0a60g0gag"},
    {'3', "a ~0300909737 ~37a7ag0g0d"},
    {'4', "b -8g800bbb"},
    {'5', "a -901007 ~0725a5ag0g0d"},
    {'6', "a ~9390000b @06a6ag0g"},
    {'7', "a -00a03g"},
    {'8', "a @10909717 @07a7ag0g"},
    {'9', "a ~1d1gaga5 @00a0aa0a"},
    {':', "1 .07 .0f"},
    {';', "2 .17 -1e0i"},
    {'<', "9 -940a9g"},
    {'=', "a -07a7 -0dad"},
    {'>', "9 -049a0g"},
    {'?', "9 ~03009097474b .4f"},
    {'@', "g @00g0gg0g @55b5bb5b -b5bb"},
    {'A', "c -0g60cg -2bab"},
    {'B', "a -000g ~005090975707 ~0757a7ag5g0g"},
    {'C', "b ~b4b0000gbgbc"},
    {'D', "b -000g ~0040b0bg4g0g"},
    {'E', "9 -90000g9g -0888"},
    {'F', "9 -90000g -0888"},
    {'G', "b ~b4b0000gbgb9 -b969"},
    {'H', "b -000g -b0bg -08b8"},
    {'I', "1 -000g"},
    {'J', "8 ~808a8g0g0c"},
    {'K', "a -000g -a00a -37ag"},
    {'L', "8 -000g8g"},
    {'M', "c -0g006bc0cg"},
    {'N', "b -0g00bgb0"},
    {'O', "c @00c0cg0g"},
    {'P', "a -000g ~0050a0a95909"},
    {'Q', "c @00c0cg0g -8bdh"},
    {'R', "a -000g ~0050a0a85808 -58ag"},
    {'S', "a ~a3a00008a8ag0g0d"},
    {'T', "a -00a0 -505g"},
    {'U', "b ~000a0gbgbab0"},
    {'V', "c -006gc0"},
    {'W', "g -004g80cgg0"},
    {'X', "b -00bg -b00g"},
    {'Y', "c -0068c0 -686g"},
    {'Z', "a -00a00gag"},
    {'[', "4 -40000i4i"},
    {'\\', "7 -007g"},
    {']', "4 -00404i0i"},
    {'^', "8 -064086"},
    {'_', "a -0jaj"},
    {'`', "3 -0034"},
    {'a', "9 @06969g0g -969g"},
    {'b', "9 -000g @06969g0g"},
    {'c', "9 ~9996060g9g9d"},
    {'d', "9 @06969g0g -909g"},
    {'e', "9 ~0b9b9b96060g9g9d"},
    {'f', "6 ~7020282g -0666"},
    {'g', "9 @06969g0g ~969f9l0l0j"},
    {'h', "9 -000g ~0b06969b9g"},
    {'i', "1 -060g .01"},
    {'j', "3 ~363h3l0l .31"},
    {'k', "8 -000g -860c -3a8g"},
    {'l', "3 ~000c0g3g"},
    {'m', "e -060g ~0b06767b7g ~7b76e6ebeg"},
    {'n', "9 -060g ~0b06969b9g"},
    {'o', "9 @06969g0g"},
    {'p', "9 -060l @06969g0g"},
    {'q', "9 @06969g0g -969l"},
    {'r', "5 -060g ~0b0656"},
    {'s', "8 ~8886060b8b8g0g0e"},
    {'t', "6 ~202a2g6g -0666"},
    {'u', "9 ~060b0g9g9b -969g"},
    {'v', "a -065ga6"},
    {'w', "e -063g77bge6"},
    {'x', "9 -069g -960g"},
    {'y', "a -065g -a63l"},
    {'z', "9 -06960g9g"},
    {'{', "6 ~60303808 ~08383i6i"},
    {'|', "1 -000i"},
    {'}', "6 ~00303868 ~68383i0i"},
    {'~', "a ~0b285a8ca9"},
    {0xB0, "5 @00505505"},          // degree
    {0xB1, "a -535d -08a8 -0gag"},  // plus-minus
    {0xB2, "5 ~02005053080858"},    // square
    {0xD7, "9 -069g -960g"},        // times
    {0x2013, "a -0aaa"},            // en dash
    {0x2014, "g -0aga"},            // em dash
    {0x2212, "a -0aaa"},            // minus
};
constexpr std::string_view kBox = "9 -00900g9g -000g -909g";
constexpr double kCapHeight = 16, kGap = 4.2;  // grid units

std::string_view StrokesOf(std::uint32_t code_point) {
  const auto it = std::find_if(std::begin(kGlyphs), std::end(kGlyphs),
                               [&](const Glyph& g) { return g.code_point == code_point; });
  return it == std::end(kGlyphs) ? kBox : it->strokes;
}

int Digit(char c) { return c <= '9' ? c - '0' : c - 'a' + 10; }

// Malformed bytes count as one unknown character each.
std::vector<std::uint32_t> CodePoints(std::string_view text) {
  std::vector<std::uint32_t> points;
  for (std::size_t i = 0; i < text.size();) {
    const auto lead = static_cast<unsigned char>(text[i++]);
    const int more = lead >= 0xF0 ? 3 : lead >= 0xE0 ? 2 : lead >= 0xC0 ? 1 : 0;
    std::uint32_t code = more == 0 ? lead : lead & (0x3F >> more);
    for (int k = 0; k < more && i < text.size() && (text[i] & 0xC0) == 0x80; ++k) {
      code = (code << 6) | (text[i++] & 0x3F);
    }
    points.push_back(code);
  }
  return points;
}

using Polyline = std::vector<Vec2>;

void AddQuadratic(Polyline& line, const Vec2& control, const Vec2& to) {
  const Vec2 from = line.back();
  constexpr int kSteps = 8;
  for (int i = 1; i <= kSteps; ++i) {
    const double t = static_cast<double>(i) / kSteps;
    line.push_back((1 - t) * (1 - t) * from + 2 * t * (1 - t) * control + t * t * to);
  }
}

// Runs from midpoint to midpoint of the control polygon; an open one starts and ends at its ends.
Polyline CurveThrough(const Polyline& control, bool closed) {
  const std::size_t n = control.size();
  const auto mid = [&](std::size_t i) -> Vec2 {
    return (control[i % n] + control[(i + 1) % n]) / 2;
  };
  Polyline line = {closed ? mid(n - 1) : control[0]};
  for (std::size_t i = closed ? 0 : 1; i + (closed ? 0 : 1) < n; ++i) {
    AddQuadratic(line, control[i], !closed && i + 2 == n ? control[n - 1] : mid(i));
  }
  return line;
}

// In grid units. strokes: of one glyph, with its width.
std::vector<Polyline> Polylines(std::string_view strokes) {
  std::vector<Polyline> lines;
  char kind = ' ';
  Polyline points;
  const auto finish = [&] {
    if (!points.empty()) {
      lines.push_back(kind == '-' || kind == '.' ? points : CurveThrough(points, kind == '@'));
    }
    points.clear();
  };
  for (std::size_t i = 1; i < strokes.size();) {
    if (strokes[i] == ' ') {
      finish();
      kind = strokes[i + 1];
      i += 2;
    } else {
      points.emplace_back(Digit(strokes[i]), Digit(strokes[i + 1]));
      i += 2;
    }
  }
  finish();
  return lines;
}

double DistanceToSegment(const Vec2& p, const Vec2& a, const Vec2& b) {
  const Vec2 ab = b - a;
  const double length2 = ab.squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) : 0.0;
  return (p - a - t * ab).norm();
}

// The ink of one glyph, so that strokes that cross do not blend twice.
class Ink {
 public:
  Ink(Image& image, Vec2 origin, double scale, double pen_radius)
      : image_(image), origin_(std::move(origin)), scale_(scale), radius_(pen_radius) {}

  void Draw(const std::vector<Polyline>& lines, const Colour& colour) {
    Box box;
    for (const Polyline& line : lines) {
      for (const Vec2& p : line) {
        box.extend(ToPixels(p));
      }
    }
    if (box.isEmpty()) {
      return;
    }
    for (int y = Low(box.min().y()); y <= High(box.max().y()); ++y) {
      for (int x = Low(box.min().x()); x <= High(box.max().x()); ++x) {
        BlendPixel(image_, x, y, colour, 0.5 + radius_ - Distance({x + 0.5, y + 0.5}, lines));
      }
    }
  }

 private:
  using Box = Eigen::AlignedBox2d;
  Vec2 ToPixels(const Vec2& grid) const { return origin_ + scale_ * grid; }
  int Low(double v) const { return static_cast<int>(std::floor(v - radius_ - 1)); }
  int High(double v) const { return static_cast<int>(std::ceil(v + radius_ + 1)); }
  double Distance(const Vec2& p, const std::vector<Polyline>& lines) const {
    double distance = std::numeric_limits<double>::infinity();
    for (const Polyline& line : lines) {
      for (std::size_t i = 0; i < line.size(); ++i) {
        const Vec2& next = line[std::min(i + 1, line.size() - 1)];
        const double dot = line.size() == 1 ? 0.3 * radius_ : 0;  // a dot is a little heavier
        distance =
            std::min(distance, DistanceToSegment(p, ToPixels(line[i]), ToPixels(next)) - dot);
      }
    }
    return distance;
  }

  Image& image_;
  Vec2 origin_;
  double scale_, radius_;  // pixels per grid unit, pixels
};

}  // namespace

double TextWidth(std::string_view text, const TextStyle& style) {
  double width = 0;
  for (const std::uint32_t code_point : CodePoints(text)) {
    width += Digit(StrokesOf(code_point)[0]) + kGap;
  }
  return std::max(0.0, width - kGap) * style.cap_height_px / kCapHeight;
}

void DrawText(Image& image, double x, double baseline_y, std::string_view text,
              const TextStyle& style) {
  const double scale = style.cap_height_px / kCapHeight;
  const double width = TextWidth(text, style);
  x -= style.anchor == Anchor::kRight ? width : style.anchor == Anchor::kCentre ? width / 2 : 0;
  for (const std::uint32_t code_point : CodePoints(text)) {
    const std::string_view strokes = StrokesOf(code_point);
    Ink ink(image, {x, baseline_y - style.cap_height_px}, scale,
            std::max(0.5, style.stroke * style.cap_height_px / 2));
    ink.Draw(Polylines(strokes), style.colour);
    x += (Digit(strokes[0]) + kGap) * scale;
  }
}

}  // namespace semblance
