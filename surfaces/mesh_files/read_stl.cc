// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh_files/read_stl.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <unordered_map>
#include <utility>

#include "surfaces/base/error.h"
#include "surfaces/mesh_files/text_lines.h"

namespace semblance::surfaces {
namespace {

constexpr std::size_t kHeader = 84, kRecord = 50;  // bytes: 80 of words and a count; one triangle

using Corner = std::array<float, 3>;

struct CornerHash {
  std::size_t operator()(const Corner& corner) const {
    std::uint64_t hash = 0;
    for (const float x : corner) {
      hash = (hash ^ std::bit_cast<std::uint32_t>(x)) * 0x9E3779B97F4A7C15u;
      hash ^= hash >> 32;
    }
    return static_cast<std::size_t>(hash);
  }
};

// Joins separate triangles at equal corners.
class Welder {
 public:
  void Add(const std::array<Vec3, 3>& corners) {
    const Triangle t = {IndexOf(corners[0]), IndexOf(corners[1]), IndexOf(corners[2])};
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) {
      mesh_.triangles.push_back(t);
    }
  }
  TriMesh Take() { return std::move(mesh_); }

 private:
  std::int32_t IndexOf(const Vec3& p) {
    Corner key;
    for (int a = 0; a < 3; ++a) {
      key[a] = static_cast<float>(p[a]) + 0.0f;  // -0 is 0
    }
    const auto [it, is_new] =
        index_.try_emplace(key, static_cast<std::int32_t>(mesh_.points.size()));
    if (is_new) {
      mesh_.points.push_back(p);
    }
    return it->second;
  }

  std::unordered_map<Corner, std::int32_t, CornerHash> index_;
  TriMesh mesh_;
};

// Compares without regard to case.
bool Is(std::string_view word, std::string_view expected) {
  return std::equal(word.begin(), word.end(), expected.begin(), expected.end(),
                    [](unsigned char a, char b) { return std::tolower(a) == b; });
}

class TextReader {
 public:
  TextReader(std::string_view bytes, const std::string& name) : lines_(bytes, name, {}) {}

  TriMesh Read() {
    bool in_solid = false;
    while (lines_.NextLine()) {
      const std::string_view word = lines_.NextWord();
      if (in_solid && Is(word, "facet")) {
        ReadFacet();
      } else if (Is(word, in_solid ? "endsolid" : "solid")) {
        in_solid = !in_solid;  // the rest of the line is the name
      } else {
        lines_.Fail(fmt::format("'{}' where '{}' is expected; write the file again", Shown(word),
                                in_solid ? "facet' or 'endsolid" : "solid"));
      }
    }
    if (in_solid) {
      lines_.Fail("the file is truncated: it has no 'endsolid'; copy it again");
    }
    return welder_.Take();
  }

 private:
  void ReadFacet() {
    Expect("normal");
    for (int a = 0; a < 3; ++a) {
      NextWord();
    }
    Expect("outer");
    Expect("loop");
    std::array<Vec3, 3> corners;
    for (Vec3& corner : corners) {
      Expect("vertex");
      corner = lines_.NextPoint();
    }
    Expect("endloop");
    Expect("endfacet");
    lines_.ExpectLineEnd();
    welder_.Add(corners);
  }

  std::string_view NextWord() {
    if (lines_.AtLineEnd() && !lines_.NextLine()) {
      lines_.Fail("the file is truncated: it ends inside a facet; copy it again");
    }
    return lines_.NextWord();
  }

  void Expect(std::string_view expected) {
    const std::string_view word = NextWord();
    if (!Is(word, expected)) {
      lines_.Fail(
          fmt::format("'{}' where '{}' is expected; a facet is: facet normal x y z, outer "
                      "loop, three of vertex x y z, endloop, endfacet",
                      Shown(word), expected));
    }
  }

  TextLines lines_;
  Welder welder_;
};

std::uint32_t HeaderCount(std::string_view bytes) {
  static_assert(std::endian::native == std::endian::little);
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + kHeader - sizeof count, sizeof count);
  return count;
}

void CheckBinarySize(std::string_view bytes, const std::string& name) {
  if (bytes.size() < kHeader) {
    throw InputError(fmt::format(
        "{}: byte {}: the file is truncated: a binary STL has at least {} bytes, a text one begins "
        "with 'solid'",
        name, bytes.size(), kHeader));
  }
  const std::size_t expected = kHeader + kRecord * HeaderCount(bytes);
  if (bytes.size() < expected || !IsPadding(bytes.substr(expected))) {
    throw InputError(fmt::format(
        "{}: byte {}: the file is {}: its header says {} triangles, that is {} bytes; it has {}; "
        "copy it again",
        name, kHeader - 4, bytes.size() < expected ? "truncated" : "too long", HeaderCount(bytes),
        expected, bytes.size()));
  }
}

TriMesh ReadBinary(std::string_view bytes, const std::string& name) {
  CheckBinarySize(bytes, name);
  Welder welder;
  for (std::size_t at = kHeader, t = 0; t < HeaderCount(bytes); ++t, at += kRecord) {
    std::array<float, 9> x;
    std::memcpy(x.data(), bytes.data() + at + 12, sizeof x);  // behind the normal
    std::array<Vec3, 3> corners;
    for (std::size_t c = 0; c < 3; ++c) {
      corners[c] = Vec3(x[3 * c], x[3 * c + 1], x[3 * c + 2]);
      if (!corners[c].allFinite()) {
        throw InputError(
            fmt::format("{}: byte {}: triangle {}: a coordinate is not finite; repair the mesh",
                        name, at + 12 + 12 * c, t));
      }
    }
    welder.Add(corners);
  }
  return welder.Take();
}

// The words of many binary files begin with 'solid' too. Such a file has the size that its count
// requires, or zeros among the words.
bool IsText(std::string_view bytes) {
  if (bytes.size() >= kHeader && bytes.size() == kHeader + kRecord * HeaderCount(bytes)) {
    return false;
  }
  constexpr std::string_view kFirst = "solid";
  const std::size_t begin =
      bytes.find_first_not_of(" \t\r\n\xEF\xBB\xBF");  // with a byte order mark
  return begin != std::string_view::npos && Is(bytes.substr(begin, kFirst.size()), kFirst) &&
         bytes.substr(0, kHeader).find('\0') == std::string_view::npos;
}

}  // namespace

TriMesh ReadStl(std::string_view bytes, const std::string& name) {
  return IsText(bytes) ? TextReader(bytes, name).Read() : ReadBinary(bytes, name);
}

}  // namespace semblance::surfaces
