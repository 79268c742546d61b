// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/bust/obj_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <sstream>
#include <system_error>
#include <utility>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/base/lower_case.h"
#include "surfaces/mesh_files/glb.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

// Lines end as in TextLines, which reads the same bytes, and a byte order mark is skipped.
std::vector<std::string> Lines(std::string text) {
  std::vector<std::string> lines;
  if (text.starts_with("\xEF\xBB\xBF")) {
    text.erase(0, 3);
  }
  const std::size_t end = text.find_first_of("\r\n");
  if (end != std::string::npos && text[end] == '\r' && text.substr(end + 1, 1) != "\n") {
    std::ranges::replace(text, '\r', '\n');
  }
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    if (!line.empty() && line.back() == '\r') {
      line.pop_back();
    }
    lines.push_back(std::move(line));
  }
  return lines;
}

// A line without a comment goes on in the next one after a backslash at its end.
std::vector<std::string> JoinContinued(const std::vector<std::string>& lines) {
  std::vector<std::string> joined;
  bool continues = false;
  for (const std::string& line : lines) {
    if (!continues) {
      joined.emplace_back();
    }
    joined.back() += line;
    continues = line.ends_with('\\') && line.find('#') == line.npos;
    if (continues) {
      joined.back().back() = ' ';
    }
  }
  return joined;
}

std::vector<std::string> Words(const std::string& line) {
  std::istringstream in(line);
  std::vector<std::string> words;
  for (std::string word; in >> word && word[0] != '#';) {
    words.push_back(word);
  }
  return words;
}

// The text after the keyword, which may be a name with spaces.
std::string Rest(const std::string& line) {
  const std::size_t key = line.find_first_not_of(" \t");
  const std::size_t end = line.find_first_of(" \t", key);
  const std::size_t begin = end == std::string::npos ? end : line.find_first_not_of(" \t", end);
  if (begin == std::string::npos) {
    return "";
  }
  return line.substr(begin, line.find_last_not_of(" \t") + 1 - begin);
}

std::optional<double> FiniteNumber(const std::string& word) {
  double value = kNaN;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  const bool whole = error == std::errc() && end == word.data() + word.size();
  return whole && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

// The path of a file that another one names. It must lie below the folder of the other one, so that
// no mesh can have foreign files copied into the results.
fs::path PathBelow(const fs::path& folder, std::string name, const std::string& who) {
  std::ranges::replace(name, '\\', '/');
  const fs::path path(name);
  if (path.is_absolute() || std::ranges::find(path, fs::path("..")) != path.end()) {
    throw InputError(
        fmt::format("{}: it names the file '{}', which is not below its own folder; "
                    "put it there and correct the name",
                    who, name));
  }
  return (folder / path).lexically_normal();
}

bool IsFile(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

bool IsMap(const std::string& word) {
  return word.starts_with("map_") || word == "bump" || word == "disp" || word == "decal" ||
         word == "norm" || word == "refl";
}

// The largest number of words that belong to an option of a `map_` line; -1 if it is no option.
int CountArguments(const std::string& option) {
  static const std::map<std::string, int> kArguments = {
      {"-blendu", 1}, {"-blendv", 1},  {"-bm", 1},  {"-boost", 1}, {"-cc", 1},
      {"-clamp", 1},  {"-imfchan", 1}, {"-mm", 2},  {"-o", 3},     {"-s", 3},
      {"-t", 3},      {"-texres", 1},  {"-type", 1}};
  const auto found = kArguments.find(option);
  return found == kArguments.end() ? -1 : found->second;
}

// The number of words before the name in `map_Kd -s 2 2 my skin.png`. The name has at least one
// word.
std::size_t CountWordsBeforeName(const std::vector<std::string>& words) {
  std::size_t k = 1;
  for (int most; k + 1 < words.size() && (most = CountArguments(words[k])) >= 0;) {
    ++k;
    for (int n = 0; n < most && k + 1 < words.size(); ++n) {
      if (most == 3 && n > 0 && !FiniteNumber(words[k])) {
        break;  // the second and third of -o, -s and -t may be left out
      }
      ++k;
    }
  }
  return k;
}

std::string WithoutComment(const std::string& line) {
  std::size_t end = line.size();
  for (std::size_t k = 1; k < end; ++k) {
    if (line[k] == '#' && (line[k - 1] == ' ' || line[k - 1] == '\t')) {
      end = k;
    }
  }
  return line.substr(0, line.find_last_not_of(" \t", end - 1) + 1);
}

class LibraryReader {
 public:
  LibraryReader(const fs::path& path, ObjText& obj)
      : folder_(path.parent_path()), name_(path.string()), obj_(obj) {}

  // given: the rest of a `mtllib` line, which is one name with spaces, or several names.
  void Read(const std::string& given) {
    const auto is_there = [&](const std::string& name) {
      return IsFile(PathBelow(folder_, name, name_));
    };
    std::vector<std::string> names = Words(given);
    if (is_there(given) || std::ranges::none_of(names, is_there)) {
      names = {given};
    }
    for (const std::string& name : names) {
      Library(PathBelow(folder_, name, name_));
    }
  }

 private:
  void Library(const fs::path& path) {
    obj_.libraries.push_back(path);
    std::string material;
    for (const std::string& line : JoinContinued(Lines(ReadFileBytes(path)))) {
      const std::vector<std::string> words = Words(line);
      if (words.size() >= 2 && IsMap(words[0])) {
        Map(line, path, material);
        continue;
      }
      obj_.mtl.push_back({line, std::nullopt});
      if (words.size() >= 2 && words[0] == "newmtl") {
        material = Rest(line);
        obj_.materials[material] = {};
      } else if (words.size() >= 4 && words[0] == "Kd") {
        obj_.materials[material].colour = ReadColour(words, path);
      }
    }
  }

  static Vec3 ReadColour(const std::vector<std::string>& words, const fs::path& library) {
    Vec3 colour;
    for (int c = 0; c < 3; ++c) {
      const std::optional<double> value = FiniteNumber(words[c + 1]);
      if (!value) {
        throw InputError(fmt::format("{}: '{}' is not a number; a colour is like Kd 0.8 0.6 0.5",
                                     library.string(), words[c + 1].substr(0, 40)));
      }
      colour[c] = std::clamp(*value, 0.0, 1.0);
    }
    return colour;
  }

  // The name follows the options. If there is no such file, the last word is taken, because the
  // line may have options that are not known here.
  void Map(const std::string& given, const fs::path& library, const std::string& material) {
    const std::string line = WithoutComment(given);
    const std::vector<std::string> words = Words(line);
    std::string name = line;
    for (std::size_t k = CountWordsBeforeName(words); k > 0; --k) {
      name = Rest(name);
    }
    const auto file_of = [&](const std::string& file) {
      return PathBelow(library.parent_path(), file, library.string());
    };
    if (!IsFile(file_of(name)) && IsFile(file_of(words.back()))) {
      name = words.back();
    }
    const fs::path file = file_of(name);
    if (!IsFile(file)) {
      throw IoError(
          fmt::format("{}: the texture '{}' is not there", library.string(), file.string()));
    }
    if (words[0] == "map_Kd") {
      CheckPicture(file, library);
      obj_.materials[material].texture = file;
    }
    obj_.mtl.push_back({line.substr(0, line.size() - name.size()), TextureNumber(file)});
  }

  // A GLB can hold no other pictures.
  static void CheckPicture(const fs::path& file, const fs::path& library) {
    if (!IsGlbPicture(ReadFileBytes(file))) {
      throw InputError(
          fmt::format("{}: the texture '{}' is neither a PNG nor a JPEG picture; save it as PNG or "
                      "JPEG, and name that file in the material",
                      library.string(), file.string()));
    }
  }

  int TextureNumber(const fs::path& file) {
    const auto known = std::ranges::find(obj_.textures, file, &ObjTexture::file);
    const auto number = static_cast<int>(known - obj_.textures.begin());
    if (known == obj_.textures.end()) {
      obj_.textures.push_back({file, TextureName(file)});
    }
    return number;
  }

  // The name has no spaces, because other programs would cut it there. It differs from the others
  // even where case does not count.
  std::string TextureName(const fs::path& file) const {
    std::string stem = file.stem().string(), ending = file.extension().string();
    std::ranges::replace(stem, ' ', '_');
    std::ranges::replace(ending, ' ', '_');
    std::string name = fmt::format("bust_textures/{}{}", stem, ending);
    const auto is_same = [&](const ObjTexture& texture) {
      return LowerCase(texture.name) == LowerCase(name);
    };
    for (int number = 2; std::ranges::any_of(obj_.textures, is_same); ++number) {
      name = fmt::format("bust_textures/{}_{}{}", stem, number, ending);
    }
    return name;
  }

  const fs::path folder_;
  const std::string name_;  // of the OBJ, for messages
  ObjText& obj_;
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

ObjText ReadObjText(const fs::path& path) {
  const std::string bytes = ReadFileBytes(path);
  ObjText obj{ReadObjFile(bytes, path.string()), JoinContinued(Lines(bytes)), {}, {}, {}, {}};
  LibraryReader reader(path, obj);
  for (const std::string& library : obj.file.libraries) {
    reader.Read(library);
  }
  return obj;
}

std::vector<fs::path> MaterialFiles(const fs::path& mesh) {
  if (LowerCase(mesh.extension().string()) != ".obj") {
    return {};
  }
  ObjText obj = ReadObjText(mesh);
  std::ranges::transform(obj.textures, std::back_inserter(obj.libraries), &ObjTexture::file);
  return obj.libraries;
}

std::string ObjWithPoints(const ObjText& obj, const std::vector<Vec3>& points,
                          std::string first_material) {
  bool named = obj.file.libraries.empty();
  std::string text = named ? "mtllib bust.mtl\n" : "";
  std::size_t next = 0;
  for (const std::string& line : obj.lines) {
    const std::vector<std::string> words = Words(line);
    const std::string key = words.empty() ? "" : words[0];
    if (key == "v") {
      const Eigen::Vector3f p = points.at(next++).cast<float>();
      text += fmt::format("v {} {} {}", p.x(), p.y(), p.z());
      for (std::size_t k = 4; k < words.size(); ++k) {
        text += ' ' + words[k];
      }
    } else if (key == "vn" || (key == "mtllib" && named)) {
      continue;
    } else if (key == "mtllib") {
      text += "mtllib bust.mtl";
      named = true;
    } else if (key == "f") {
      if (!first_material.empty()) {
        text += fmt::format("usemtl {}\n", std::exchange(first_material, ""));
      }
      text += FaceWithoutNormals(words);
    } else {
      text += line;
    }
    text += '\n';
  }
  return text;
}

std::string JoinMtl(const ObjText& obj) {
  std::string text;
  for (const MtlLine& line : obj.mtl) {
    text += line.text + (line.texture ? obj.textures[*line.texture].name : "") + '\n';
  }
  return text;
}

}  // namespace semblance::problems
