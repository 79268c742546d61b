// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh_files/read_obj.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <system_error>
#include <unordered_set>
#include <utility>
#include <vector>

#include "surfaces/mesh_files/text_lines.h"

namespace semblance::surfaces {
namespace {

// Keywords that do not describe the shape.
constexpr std::array<std::string_view, 18> kSkipped = {
    "vt", "vn", "vp",  "g",     "o",        "s",        "usemtl",     "mtllib",    "l",
    "p",  "mg", "lod", "bevel", "c_interp", "d_interp", "shadow_obj", "trace_obj", "usemap"};

class ObjReader {
 public:
  enum class Keep { kShape, kLooks };
  ObjReader(std::string_view bytes, const std::string& name, Keep keep)
      : lines_(bytes, name, {.comment = '#', .goes_on_after_backslash = true}),
        name_(name),
        keeps_looks_(keep == Keep::kLooks) {}

  ObjFile Read() {
    while (lines_.NextLine()) {
      const std::string_view keyword = lines_.NextWord();
      if (keyword == "v") {
        ReadVertex();
      } else if (keyword == "f") {
        ReadFace();
      } else if (keeps_looks_ && ReadLooks(keyword)) {
        continue;
      } else if (std::find(kSkipped.begin(), kSkipped.end(), keyword) == kSkipped.end()) {
        lines_.Fail(
            fmt::format("'{}' is not a keyword of a polygon mesh; vertices begin with 'v', "
                        "faces with 'f', comments with '#'",
                        Shown(keyword)));
      }
    }
    CheckHighest();
    fans_.Finish(mesh_, name_);
    if (obj_.colours.size() != mesh_.points.size()) {
      obj_.colours.clear();
    }
    return std::move(obj_);
  }

 private:
  // x y z, then nothing, a weight, a colour, or both.
  void ReadVertex() {
    if (static_cast<std::int64_t>(mesh_.points.size()) == kMaxElements) {
      lines_.Fail(fmt::format("more than {} vertices; decimate the mesh", kMaxElements));
    }
    mesh_.points.push_back(lines_.NextPoint());
    std::array<double, 4> numbers;
    std::size_t more = 0;
    for (; !lines_.AtLineEnd(); ++more) {
      numbers[more % numbers.size()] = lines_.NextDouble();
    }
    if (more == 2 || more > 4) {
      lines_.Fail(fmt::format("a vertex has 3, 4, 6 or 7 numbers, this has {}", 3 + more));
    }
    if (keeps_looks_ && more >= 3) {
      KeepColour({numbers[more - 3], numbers[more - 2], numbers[more - 1]});
    }
  }

  void KeepColour(const Vec3& colour) {
    if ((colour.array() >= 0).all() && (colour.array() <= 1).all()) {
      obj_.colours.push_back(colour);
    }
  }

  // True if the line was one that decides the looks.
  bool ReadLooks(std::string_view keyword) {
    if (keyword == "vt") {
      const double u = lines_.NextDouble(), v = lines_.AtLineEnd() ? 0 : lines_.NextDouble();
      if (!std::isfinite(u) || !std::isfinite(v)) {
        lines_.Fail("a texture coordinate is not finite; export the mesh again");
      }
      obj_.texture.emplace_back(u, v);
    } else if (keyword == "usemtl") {
      material_ = lines_.RestAsName();
    } else if (keyword == "mtllib") {
      obj_.libraries.emplace_back(lines_.RestAsName());
    } else {
      return false;
    }
    return true;
  }

  void ReadFace() {
    corners_.clear();
    ObjPolygon polygon{{}, material_};
    while (!lines_.AtLineEnd()) {
      const ObjPolygonCorner corner = ReadCorner(lines_.NextWord());
      corners_.push_back(corner.point);
      if (keeps_looks_) {
        polygon.corners.push_back(corner);
      }
    }
    if (corners_.size() < 3) {
      lines_.Fail(fmt::format("a face of {} corners; it needs at least 3", corners_.size()));
    }
    if (keeps_looks_) {
      obj_.polygons.push_back(std::move(polygon));
    }
    RemoveRepeats();
    fans_.Append(corners_, mesh_.triangles);
  }

  // Removes the corners that repeat an earlier one.
  void RemoveRepeats() {
    if (corners_.size() == 3 && corners_[0] != corners_[1] && corners_[1] != corners_[2] &&
        corners_[2] != corners_[0]) {
      return;
    }
    std::unordered_set<std::int32_t> seen;
    std::erase_if(corners_, [&](std::int32_t corner) { return !seen.insert(corner).second; });
  }

  // "7", "7/1", "7//3" or "7/1/3": a vertex, a texture coordinate and a normal, which is skipped.
  ObjPolygonCorner ReadCorner(std::string_view word) {
    constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::min();
    std::int64_t vertex = 0, texture = kNone;
    std::string_view rest = word;
    if (!TakeInteger(rest, vertex) || !TakeTextureAndNormal(rest, texture)) {
      lines_.Fail(fmt::format(
          "'{}' is not a corner of a face; corners are like 7, 7/1, 7//3 or 7/1/3", Shown(word)));
    }
    ObjPolygonCorner corner{
        .point = FindIndex(vertex, "vertex", "vertices", mesh_.points.size(), highest_vertex_)};
    if (keeps_looks_ && texture != kNone) {
      corner.texture = FindIndex(texture, "texture coordinate", "texture coordinates",
                                 obj_.texture.size(), highest_texture_);
    }
    return corner;
  }

  struct HighestIndex {
    std::int64_t index = -1, line = 0;
  };

  // The index from 0 of a thing that a face names from 1, or from -1 backwards.
  std::int32_t FindIndex(std::int64_t given, const char* thing, const char* things,
                         std::size_t so_far, HighestIndex& highest) const {
    const auto count = static_cast<std::int64_t>(so_far);
    const std::int64_t index = given > 0 ? given - 1 : count + given;
    if (given == 0 || index < 0 || index >= kMaxElements) {
      lines_.Fail(fmt::format("a face names {} {}; allowed are 1 to the number of {}, or -1 to -{}",
                              thing, given, things, count));
    }
    if (index > highest.index) {
      highest = {index, lines_.LineNumber()};
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

  // texture: stays as it is if the corner has none.
  static bool TakeTextureAndNormal(std::string_view rest, std::int64_t& texture) {
    std::int64_t normal = 0;
    for (std::int64_t* part : {&texture, &normal}) {
      if (!rest.starts_with('/')) {
        break;
      }
      rest.remove_prefix(1);
      if (!rest.empty() && rest.front() != '/' && !TakeInteger(rest, *part)) {
        return false;
      }
    }
    return rest.empty();
  }

  // A face may name things that follow it.
  void CheckHighest() const {
    Check(highest_vertex_, "vertex", mesh_.points.size());
    Check(highest_texture_, "texture coordinate", obj_.texture.size());
  }

  void Check(const HighestIndex& highest, const char* thing, std::size_t count) const {
    if (highest.index >= static_cast<std::int64_t>(count)) {
      lines_.FailAt(highest.line, fmt::format("a face names {} {}; the file has {}", thing,
                                              highest.index + 1, count));
    }
  }

  TextLines lines_;
  const std::string& name_;
  bool keeps_looks_;
  PolygonFans fans_;
  ObjFile obj_;
  TriMesh& mesh_ = obj_.mesh;
  std::string material_;
  std::vector<std::int32_t> corners_;
  HighestIndex highest_vertex_, highest_texture_;
};

}  // namespace

TriMesh ReadObj(std::string_view bytes, const std::string& name) {
  return ObjReader(bytes, name, ObjReader::Keep::kShape).Read().mesh;
}

ObjFile ReadObjFile(std::string_view bytes, const std::string& name) {
  return ObjReader(bytes, name, ObjReader::Keep::kLooks).Read();
}

}  // namespace semblance::surfaces
