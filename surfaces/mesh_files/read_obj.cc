// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh_files/read_obj.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <system_error>
#include <unordered_set>
#include <utility>
#include <vector>

#include "surfaces/mesh_files/read_parts.h"
#include "surfaces/mesh_files/text_lines.h"

namespace semblance {
namespace {

// What an OBJ may hold beside a triangle mesh.
constexpr std::array<std::string_view, 18> kNotKept = {
    "vt", "vn", "vp",  "g",     "o",        "s",        "usemtl",     "mtllib",    "l",
    "p",  "mg", "lod", "bevel", "c_interp", "d_interp", "shadow_obj", "trace_obj", "usemap"};

class ObjReader {
 public:
  ObjReader(std::string_view bytes, const std::string& name)
      : lines_(bytes, name, {.comment = '#'}) {}

  TriMesh Read() {
    while (lines_.NextLine()) {
      const std::string_view keyword = lines_.NextWord();
      if (keyword == "v") {
        ReadVertex();
      } else if (keyword == "f") {
        ReadFace();
      } else if (std::find(kNotKept.begin(), kNotKept.end(), keyword) == kNotKept.end()) {
        lines_.Fail(
            fmt::format("'{}' is not a keyword of a polygon mesh; vertices begin with 'v', "
                        "faces with 'f', comments with '#'",
                        Shown(keyword)));
      }
    }
    CheckHighest();
    return std::move(mesh_);
  }

 private:
  // x y z, then nothing, a weight, a colour, or both.
  void ReadVertex() {
    if (static_cast<std::int64_t>(mesh_.points.size()) == kMostElements) {
      lines_.Fail(fmt::format("more than {} vertices; decimate the mesh", kMostElements));
    }
    mesh_.points.push_back(lines_.NextPoint());
    int more = 0;
    for (; !lines_.AtLineEnd(); ++more) {
      lines_.NextDouble();
    }
    if (more == 2 || more > 4) {
      lines_.Fail(fmt::format("a vertex has 3, 4, 6 or 7 numbers, this has {}", 3 + more));
    }
  }

  void ReadFace() {
    corners_.clear();
    while (!lines_.AtLineEnd()) {
      corners_.push_back(ReadCorner(lines_.NextWord()));
    }
    if (corners_.size() < 3) {
      lines_.Fail(fmt::format("a face of {} corners; it needs at least 3", corners_.size()));
    }
    RemoveRepeats();
    AppendFan(corners_, mesh_.triangles);
  }

  // Leaves each vertex at its first place among the corners.
  void RemoveRepeats() {
    if (corners_.size() == 3 && corners_[0] != corners_[1] && corners_[1] != corners_[2] &&
        corners_[2] != corners_[0]) {
      return;
    }
    std::unordered_set<std::int32_t> seen;
    std::erase_if(corners_, [&](std::int32_t corner) { return !seen.insert(corner).second; });
  }

  // "7", "7/1", "7//3", "7/1/3": the vertex, then what is not kept.
  std::int32_t ReadCorner(std::string_view word) {
    std::int64_t vertex = 0;
    std::string_view rest = word;
    if (!TakeInteger(rest, vertex) || !IsTextureAndNormal(rest)) {
      lines_.Fail(fmt::format(
          "'{}' is not a corner of a face; corners are like 7, 7/1, 7//3 or 7/1/3", Shown(word)));
    }
    const auto count = static_cast<std::int64_t>(mesh_.points.size());
    const std::int64_t index = vertex > 0 ? vertex - 1 : count + vertex;
    if (vertex == 0 || index < 0 || index >= kMostElements) {
      lines_.Fail(fmt::format(
          "a face names vertex {}; allowed are 1 to the number of vertices, or -1 to -{}", vertex,
          count));
    }
    if (index > highest_) {
      highest_ = index;
      highest_line_ = lines_.LineNumber();
    }
    return static_cast<std::int32_t>(index);
  }

  // Takes a whole number off the beginning of the word.
  static bool TakeInteger(std::string_view& word, std::int64_t& value) {
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error == std::errc()) {
      word.remove_prefix(static_cast<std::size_t>(end - word.data()));
    }
    return error == std::errc();
  }

  static bool IsTextureAndNormal(std::string_view rest) {
    for (int part = 0; part < 2 && rest.starts_with('/'); ++part) {
      rest.remove_prefix(1);
      std::int64_t ignored = 0;
      if (!rest.empty() && rest.front() != '/') {
        if (!TakeInteger(rest, ignored)) {
          return false;
        }
      }
    }
    return rest.empty();
  }

  // A face may name vertices that follow it.
  void CheckHighest() const {
    if (highest_ >= static_cast<std::int64_t>(mesh_.points.size())) {
      lines_.FailAt(highest_line_, fmt::format("a face names vertex {}; the file has {}",
                                               highest_ + 1, mesh_.points.size()));
    }
  }

  TextLines lines_;
  TriMesh mesh_;
  std::vector<std::int32_t> corners_;
  std::int64_t highest_ = -1, highest_line_ = 0;
};

}  // namespace

TriMesh ReadObj(std::string_view bytes, const std::string& name) {
  return ObjReader(bytes, name).Read();
}

}  // namespace semblance
