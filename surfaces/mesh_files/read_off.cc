// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh_files/read_off.h"

#include <fmt/format.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "surfaces/mesh_files/text_lines.h"

namespace semblance::surfaces {
namespace {

class OffReader {
 public:
  OffReader(std::string_view bytes, const std::string& name)
      : lines_(bytes, name, {.comment = '#'}), name_(name) {}

  TriMesh Read() {
    ReadKeyword();
    ReadCounts();
    ReadVertices();
    ReadFaces();
    if (lines_.NextLine()) {
      lines_.Fail(fmt::format("more lines than the header says: it says {} vertices and {} faces",
                              vertices_, faces_));
    }
    fans_.Finish(mesh_, name_);
    return std::move(mesh_);
  }

 private:
  void ReadKeyword() {
    constexpr const char* kAllowed =
        "an OFF file begins with OFF, or with ST, C and N before it, as in COFF";
    if (!lines_.NextLine()) {
      lines_.Fail(fmt::format("there is nothing to read; {}", kAllowed));
    }
    const std::string_view word = lines_.NextWord();
    const std::size_t off = word.find("OFF");
    if (off == std::string_view::npos || !TakeExtras(word.substr(0, off))) {
      lines_.Fail(fmt::format("'{}' is not a header that is read; {}", Shown(word), kAllowed));
    }
    lines_.StepBack(word.size() - off - 3);  // some files continue with the counts: OFF8 6 12
  }

  // Counts the numbers that each vertex has in addition to x y z.
  bool TakeExtras(std::string_view prefix) {
    while (!prefix.empty()) {
      const bool texture = prefix.starts_with("ST"), colour = prefix.front() == 'C';
      if (!texture && !colour && prefix.front() != 'N') {
        return false;
      }
      fewest_extras_ += texture ? 2 : 3;
      most_extras_ += texture ? 2 : colour ? 4 : 3;
      prefix.remove_prefix(texture ? 2 : 1);
    }
    return true;
  }

  void ReadCounts() {
    if (lines_.AtLineEnd() && !lines_.NextLine()) {
      lines_.Fail("the file ends before its counts: vertices, faces and edges");
    }
    if (lines_.RestOfLine().starts_with("BINARY")) {
      lines_.Fail("binary OFF is not read; write the mesh as text OFF or as PLY");
    }
    vertices_ = lines_.NextInteger("number of vertices", 0, kMaxElements);
    faces_ = lines_.NextInteger("number of faces", 0, kMaxElements);
    if (!lines_.AtLineEnd()) {
      lines_.NextInteger("number of edges", 0, 2 * kMaxElements);
    }
    lines_.ExpectLineEnd();
    constexpr std::int64_t kShortestVertex = 6, kShortestFace = 8;  // "0 0 0\n", "3 0 1 2\n"
    const std::int64_t fewest_bytes = kShortestVertex * vertices_ + kShortestFace * faces_ - 1;
    if (fewest_bytes > static_cast<std::int64_t>(lines_.BytesLeft())) {
      lines_.Fail(
          fmt::format("{} vertices and {} faces need at least {} bytes, the file has {} "
                      "more; correct the counts or write the file again",
                      vertices_, faces_, fewest_bytes, lines_.BytesLeft()));
    }
  }

  void ReadVertices() {
    mesh_.points.reserve(static_cast<std::size_t>(vertices_));
    for (std::int64_t v = 0; v < vertices_; ++v) {
      ExpectLine("vertices", v, vertices_);
      mesh_.points.push_back(lines_.NextPoint());
      int extras = 0;
      for (; !lines_.AtLineEnd(); ++extras) {
        lines_.NextDouble();
      }
      if (extras < fewest_extras_ || extras > most_extras_) {
        lines_.Fail(fmt::format("a vertex of {} numbers; by the header's first word it has {}{}",
                                3 + extras, 3 + fewest_extras_,
                                most_extras_ > fewest_extras_ ? " or one more" : ""));
      }
    }
  }

  void ReadFaces() {
    mesh_.triangles.reserve(static_cast<std::size_t>(faces_));
    std::vector<std::int32_t> corners;
    for (std::int64_t f = 0; f < faces_; ++f) {
      ExpectLine("faces", f, faces_);
      const std::int64_t size = lines_.NextInteger("number of corners", 3, kMaxElements);
      corners.clear();
      for (std::int64_t c = 0; c < size; ++c) {
        corners.push_back(
            static_cast<std::int32_t>(lines_.NextInteger("index of a vertex", 0, vertices_ - 1)));
      }
      fans_.Append(corners, mesh_.triangles);
      SkipColour();
    }
  }

  // A colour is nothing, an index, or three or four numbers.
  void SkipColour() {
    for (int k = 0; k < 4 && !lines_.AtLineEnd(); ++k) {
      lines_.NextDouble();
    }
    lines_.ExpectLineEnd();
  }

  void ExpectLine(const char* what, std::int64_t done, std::int64_t count) {
    if (!lines_.NextLine()) {
      lines_.Fail(fmt::format("the file is truncated: it ends after {} of {} {}; copy it again",
                              done, count, what));
    }
  }

  TextLines lines_;
  const std::string& name_;
  TriMesh mesh_;
  PolygonFans fans_;
  std::int64_t vertices_ = 0, faces_ = 0;
  int fewest_extras_ = 0, most_extras_ = 0;  // numbers of a vertex beside its position
};

}  // namespace

TriMesh ReadOff(std::string_view bytes, const std::string& name) {
  return OffReader(bytes, name).Read();
}

}  // namespace semblance::surfaces
