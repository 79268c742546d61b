// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/bust/obj_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <sstream>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> Lines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  bool continues = false;
  for (std::string line; std::getline(in, line);) {
    if (!line.empty() && line.back() == '\r') {
      line.pop_back();
    }
    const bool more = !line.empty() && line.back() == '\\';
    if (more) {
      line.back() = ' ';
    }
    if (continues) {
      lines.back() += line;
    } else {
      lines.push_back(line);
    }
    continues = more;
  }
  return lines;
}

std::vector<std::string> Words(const std::string& line) {
  std::istringstream in(line);
  std::vector<std::string> words;
  for (std::string word; in >> word && word[0] != '#';) {
    words.push_back(word);
  }
  return words;
}

// What follows the keyword, for names with spaces.
std::string Rest(const std::string& line) {
  const std::size_t key = line.find_first_not_of(" \t");
  const std::size_t end = line.find_first_of(" \t", key);
  const std::size_t begin = end == std::string::npos ? end : line.find_first_not_of(" \t", end);
  if (begin == std::string::npos) {
    return "";
  }
  return line.substr(begin, line.find_last_not_of(" \t") + 1 - begin);
}

double NumberOf(const std::string& word, const std::string& name, std::size_t line) {
  double value = kNaN;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value)) {
    throw InputError(
        fmt::format("{}: line {}: '{}' is not a number", name, line, word.substr(0, 40)));
  }
  return value;
}

// A file that another one names: only below the folder of both, so that no mesh can have foreign
// files copied into the results.
fs::path Beside(const fs::path& folder, std::string name, const std::string& who) {
  std::ranges::replace(name, '\\', '/');
  const fs::path path(name);
  if (path.is_absolute() || std::ranges::find(path, fs::path("..")) != path.end()) {
    throw InputError(
        fmt::format("{}: it names the file '{}', which is not below its own folder; "
                    "put it there and correct the name",
                    who, name));
  }
  return folder / path;
}

bool IsMap(const std::string& word) {
  return word.starts_with("map_") || word == "bump" || word == "disp" || word == "decal" ||
         word == "norm" || word == "refl";
}

class ObjReader {
 public:
  explicit ObjReader(const fs::path& path) : path_(path), name_(path.string()) {
    obj_.lines = Lines(ReadFileBytes(path));
    std::string material;
    for (std::size_t k = 0; k < obj_.lines.size(); ++k) {
      const std::vector<std::string> words = Words(obj_.lines[k]);
      if (words.empty()) {
        continue;
      }
      if (words[0] == "v") {
        ++points_;
      } else if (words[0] == "vt") {
        Texture(words, k + 1);
      } else if (words[0] == "usemtl") {
        material = Rest(obj_.lines[k]);
      } else if (words[0] == "mtllib") {
        Library(Rest(obj_.lines[k]));
      } else if (words[0] == "f") {
        Face(words, material, k + 1);
      }
    }
  }
  ObjText Take() { return std::move(obj_); }

 private:
  void Texture(const std::vector<std::string>& words, std::size_t line) {
    const auto at = [&](std::size_t k) {
      return k < words.size() ? NumberOf(words[k], name_, line) : 0.0;
    };
    obj_.texture.emplace_back(at(1), at(2));
  }

  std::int32_t Index(const std::string& word, std::size_t count, std::size_t line) const {
    const double given = NumberOf(word, name_, line);
    const double index = given < 0 ? static_cast<double>(count) + given : given - 1;
    if (!(index >= 0 && index < static_cast<double>(count))) {
      throw InputError(fmt::format("{}: line {}: index {} is not among the {} before it", name_,
                                   line, word.substr(0, 40), count));
    }
    return static_cast<std::int32_t>(index);
  }

  void Face(const std::vector<std::string>& words, const std::string& material, std::size_t line) {
    ObjFace face{{}, material};
    for (std::size_t k = 1; k < words.size(); ++k) {
      const std::size_t slash = words[k].find('/');
      ObjCorner corner{Index(words[k].substr(0, slash), points_, line), -1};
      if (slash != std::string::npos) {
        const std::string texture =
            words[k].substr(slash + 1, words[k].find('/', slash + 1) - slash - 1);
        corner.texture = texture.empty() ? -1 : Index(texture, obj_.texture.size(), line);
      }
      face.corners.push_back(corner);
    }
    obj_.faces.push_back(std::move(face));
  }

  void Library(const std::string& name) {
    const fs::path path = Beside(path_.parent_path(), name, name_);
    const std::string text = ReadFileBytes(path);
    obj_.mtl += text;
    if (!text.empty() && text.back() != '\n') {
      obj_.mtl += '\n';
    }
    std::string material;
    for (const std::string& line : Lines(text)) {
      const std::vector<std::string> words = Words(line);
      if (words.size() < 2) {
        continue;
      }
      if (words[0] == "newmtl") {
        material = Rest(line);
        obj_.materials[material] = {};
      } else if (words[0] == "Kd" && words.size() >= 4) {
        for (int c = 0; c < 3; ++c) {
          obj_.materials[material].colour[c] =
              std::clamp(NumberOf(words[c + 1], path.string(), 0), 0.0, 1.0);
        }
      } else if (IsMap(words[0])) {
        const fs::path texture = Beside(path.parent_path(), words.back(), path.string());
        if (!fs::is_regular_file(texture)) {
          throw IoError(
              fmt::format("{}: the texture '{}' is not there", path.string(), texture.string()));
        }
        if (words[0] == "map_Kd") {
          obj_.materials[material].texture = texture;
        }
        if (std::ranges::find(obj_.textures, texture) == obj_.textures.end()) {
          obj_.textures.push_back(texture);
        }
      }
    }
  }

  const fs::path path_;
  const std::string name_;
  ObjText obj_;
  std::size_t points_ = 0;
};

std::string FaceWithoutNormals(const std::vector<std::string>& words) {
  std::string line = "f";
  for (std::size_t k = 1; k < words.size(); ++k) {
    const std::size_t first = words[k].find('/');
    const std::size_t second = first == std::string::npos ? first : words[k].find('/', first + 1);
    std::string corner = words[k].substr(0, second);
    if (!corner.empty() && corner.back() == '/') {
      corner.pop_back();
    }
    line += ' ' + corner;
  }
  return line;
}

}  // namespace

ObjText ReadObjText(const fs::path& path) { return ObjReader(path).Take(); }

std::string ObjWithPoints(const ObjText& obj, const std::vector<Vec3>& points,
                          const std::string& library) {
  std::string text;
  std::size_t next = 0;
  bool named = false;
  for (const std::string& line : obj.lines) {
    const std::vector<std::string> words = Words(line);
    const std::string key = words.empty() ? "" : words[0];
    if (key == "v") {
      const Eigen::Vector3f p = points.at(next++).cast<float>();
      text += fmt::format("v {} {} {}", p.x(), p.y(), p.z());
      for (std::size_t k = 4; k < words.size(); ++k) {
        text += ' ' + words[k];
      }
    } else if (key == "vn" || (key == "mtllib" && (library.empty() || named))) {
      continue;
    } else if (key == "mtllib") {
      text += "mtllib " + library;
      named = true;
    } else if (key == "f") {
      text += FaceWithoutNormals(words);
    } else {
      text += line;
    }
    text += '\n';
  }
  return text;
}

std::string FlatMtl(const ObjText& obj) {
  std::string text;
  for (const std::string& line : Lines(obj.mtl)) {
    std::vector<std::string> words = Words(line);
    if (words.size() < 2 || !IsMap(words[0])) {
      text += line + '\n';
      continue;
    }
    std::string file = words.back();
    std::ranges::replace(file, '\\', '/');
    words.back() = fs::path(file).filename().string();
    std::string flat;
    for (const std::string& word : words) {
      flat += (flat.empty() ? "" : " ") + word;
    }
    text += flat + '\n';
  }
  return text;
}

}  // namespace semblance
