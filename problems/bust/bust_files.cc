// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/bust/bust_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "surfaces/base/srgb.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr std::array<double, 3> kSkinColour = {0.85, 0.65, 0.54};

// One colour or texture of the bust.
struct Piece {
  std::string name;
  std::array<double, 3> colour = kSkinColour;  // sRGB
  fs::path texture;                            // empty without
  double roughness = 0.6;
  std::vector<Vec3> points, normals;
  std::vector<Vec2> uv;  // one per point, or none; v upwards
  std::vector<Triangle> triangles;
};

Piece PieceOf(const EyePart& part) {
  return {.name = part.name,
          .colour = part.colour,
          .texture = {},
          .roughness = 0.1,
          .points = part.mesh.points,
          .normals = VertexNormals(part.mesh),
          .uv = {},
          .triangles = part.mesh.triangles};
}

// The faces of an OBJ by material; a point with two texture coordinates becomes two.
std::vector<Piece> TexturedPieces(const TriMesh& skin, const ObjText& obj) {
  const std::vector<Vec3> normals = VertexNormals(skin);
  std::map<std::string, Piece> pieces;
  std::map<std::string, std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t>> numbers;
  for (const ObjFace& face : obj.faces) {
    Piece& piece = pieces[face.material];
    auto& number = numbers[face.material];
    std::vector<std::int32_t> corners;
    for (const ObjCorner& corner : face.corners) {
      const auto [it, is_new] = number.try_emplace({corner.point, corner.texture},
                                                   static_cast<std::int32_t>(piece.points.size()));
      if (is_new) {
        piece.points.push_back(skin.points[corner.point]);
        piece.normals.push_back(normals[corner.point]);
        piece.uv.push_back(corner.texture < 0 ? Vec2(0, 0) : obj.texture[corner.texture]);
      }
      corners.push_back(it->second);
    }
    for (std::size_t k = 2; k < corners.size(); ++k) {
      piece.triangles.push_back({corners[0], corners[k - 1], corners[k]});
    }
  }
  std::vector<Piece> result;
  for (auto& [name, piece] : pieces) {
    piece.name = name.empty() ? "skin" : name;
    if (const auto found = obj.materials.find(name); found != obj.materials.end()) {
      const Vec3& c = found->second.colour;
      piece.colour = {c.x(), c.y(), c.z()};
      piece.texture = found->second.texture;
    }
    if (obj.texture.empty()) {
      piece.uv.clear();
    }
    result.push_back(std::move(piece));
  }
  return result;
}

// Both eyes' parts of a name together.
std::vector<Piece> EyePieces(const std::vector<EyePart>& parts) {
  std::map<std::string, Piece> pieces;
  for (const EyePart& part : parts) {
    Piece more = PieceOf(part);
    const auto [at, is_new] = pieces.try_emplace(part.name, more);
    if (is_new) {
      continue;
    }
    Piece& piece = at->second;
    const auto first = static_cast<std::int32_t>(piece.points.size());
    piece.points.insert(piece.points.end(), more.points.begin(), more.points.end());
    piece.normals.insert(piece.normals.end(), more.normals.begin(), more.normals.end());
    for (const Triangle& t : more.triangles) {
      piece.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    }
  }
  std::vector<Piece> result;
  for (auto& [name, piece] : pieces) {
    result.push_back(std::move(piece));
  }
  return result;
}

std::vector<Piece> PiecesOf(const Bust& bust, const BustModel& model) {
  std::vector<Piece> pieces;
  if (model.obj) {
    pieces = TexturedPieces(bust.skin, *model.obj);
  } else {
    pieces.push_back({.name = "skin",
                      .texture = {},
                      .points = bust.skin.points,
                      .normals = VertexNormals(bust.skin),
                      .uv = {},
                      .triangles = bust.skin.triangles});
  }
  for (Piece& piece : EyePieces(bust.eyes)) {
    pieces.push_back(std::move(piece));
  }
  return pieces;
}

// ---------------------------------------------------------------------------------------------
// glTF
// ---------------------------------------------------------------------------------------------

// From LPS to glTF's axes: +z up becomes +y up, the face looks along +z.
Eigen::Vector3f ToGltf(const Vec3& v) { return Vec3(v.x(), v.z(), -v.y()).cast<float>(); }

class GlbWriter {
 public:
  std::string Write(const std::vector<Piece>& pieces) {
    json_["asset"] = {{"version", "2.0"}, {"generator", "semblance"}};
    json_["scene"] = 0;
    json_["scenes"] = Json::array({{{"nodes", {0}}}});
    json_["nodes"] = Json::array({{{"mesh", 0}, {"name", "bust"}}});
    Json primitives = Json::array();
    for (const Piece& piece : pieces) {
      primitives.push_back(Primitive(piece));
    }
    json_["meshes"] = Json::array({{{"primitives", primitives}}});
    json_["buffers"] = Json::array({{{"byteLength", binary_.size()}}});
    return Bytes();
  }

 private:
  Json Primitive(const Piece& piece) {
    Json attributes = {{"POSITION", Positions(piece.points)}, {"NORMAL", Normals(piece.normals)}};
    if (!piece.uv.empty()) {
      std::string bytes;
      for (const Vec2& uv : piece.uv) {
        Append(bytes, static_cast<float>(uv.x()));
        Append(bytes, static_cast<float>(1 - uv.y()));  // glTF's v goes down
      }
      attributes["TEXCOORD_0"] = Accessor(bytes, kFloat, piece.uv.size(), "VEC2", kVertices);
    }
    std::string bytes;
    for (const Triangle& t : piece.triangles) {
      for (const std::int32_t corner : t) {
        Append(bytes, static_cast<std::uint32_t>(corner));
      }
    }
    const int indices = Accessor(bytes, kUnsigned, 3 * piece.triangles.size(), "SCALAR", kIndices);
    return {{"attributes", attributes}, {"indices", indices}, {"material", Material(piece)}};
  }

  int Positions(const std::vector<Vec3>& points) {
    std::string bytes;
    Eigen::AlignedBox3f box;
    for (const Vec3& point : points) {
      const Eigen::Vector3f p = ToGltf(point / 1000);
      box.extend(p);
      Append(bytes, p);
    }
    const int accessor = Accessor(bytes, kFloat, points.size(), "VEC3", kVertices);
    json_["accessors"][accessor]["min"] = {box.min().x(), box.min().y(), box.min().z()};
    json_["accessors"][accessor]["max"] = {box.max().x(), box.max().y(), box.max().z()};
    return accessor;
  }

  int Normals(const std::vector<Vec3>& normals) {
    std::string bytes;
    for (const Vec3& normal : normals) {
      Append(bytes, ToGltf(normal.isZero() ? -Vec3::UnitY() : normal));  // glTF allows no zero
    }
    return Accessor(bytes, kFloat, normals.size(), "VEC3", kVertices);
  }

  int Material(const Piece& piece) {
    const auto& c = piece.colour;
    Json look = {
        {"baseColorFactor", {LinearFromSrgb(c[0]), LinearFromSrgb(c[1]), LinearFromSrgb(c[2]), 1}},
        {"metallicFactor", 0},
        {"roughnessFactor", piece.roughness}};
    if (!piece.texture.empty()) {
      look["baseColorFactor"] = {1, 1, 1, 1};
      look["baseColorTexture"] = {{"index", Texture(piece.texture)}};
    }
    json_["materials"].push_back({{"name", piece.name}, {"pbrMetallicRoughness", look}});
    return static_cast<int>(json_["materials"].size()) - 1;
  }

  int Texture(const fs::path& file) {
    if (const auto known = textures_.find(file); known != textures_.end()) {
      return known->second;
    }
    std::string ending = file.extension().string();
    std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
    const int view = View(ReadFileBytes(file), std::nullopt);
    json_["images"].push_back(
        {{"bufferView", view}, {"mimeType", ending == ".png" ? "image/png" : "image/jpeg"}});
    json_["textures"].push_back({{"source", json_["images"].size() - 1}});
    return textures_[file] = static_cast<int>(json_["textures"].size()) - 1;
  }

  int View(const std::string& bytes, std::optional<int> target) {
    Json view = {{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", bytes.size()}};
    if (target) {
      view["target"] = *target;
    }
    binary_ += bytes;
    binary_.append((4 - binary_.size() % 4) % 4, '\0');
    json_["bufferViews"].push_back(view);
    return static_cast<int>(json_["bufferViews"].size()) - 1;
  }

  int Accessor(const std::string& bytes, int component, std::size_t count, const char* type,
               int target) {
    json_["accessors"].push_back({{"bufferView", View(bytes, target)},
                                  {"componentType", component},
                                  {"count", count},
                                  {"type", type}});
    return static_cast<int>(json_["accessors"].size()) - 1;
  }

  // glTF's numbers are little-endian whatever the machine.
  static void Append(std::string& bytes, std::uint32_t value) {
    for (int k = 0; k < 4; ++k) {
      bytes += static_cast<char>(value >> (8 * k) & 0xff);
    }
  }
  static void Append(std::string& bytes, float value) {
    Append(bytes, std::bit_cast<std::uint32_t>(value));
  }
  static void Append(std::string& bytes, const Eigen::Vector3f& v) {
    for (const float x : {v.x(), v.y(), v.z()}) {
      Append(bytes, x);
    }
  }

  std::string Bytes() const {
    std::string text = json_.dump();
    text.append((4 - text.size() % 4) % 4, ' ');
    std::string bytes = "glTF";
    Append(bytes, std::uint32_t{2});
    Append(bytes, static_cast<std::uint32_t>(12 + 8 + text.size() + 8 + binary_.size()));
    Append(bytes, static_cast<std::uint32_t>(text.size()));
    bytes += "JSON" + text;
    Append(bytes, static_cast<std::uint32_t>(binary_.size()));
    bytes.append("BIN\0", 4);
    return bytes + binary_;
  }

  static constexpr int kFloat = 5126, kUnsigned = 5125, kVertices = 34962, kIndices = 34963;
  Json json_;
  std::string binary_;
  std::map<fs::path, int> textures_;
};

// ---------------------------------------------------------------------------------------------
// OBJ
// ---------------------------------------------------------------------------------------------

void AppendObj(const std::string& name, const TriMesh& mesh, std::size_t points_before,
               std::string& text) {
  text += fmt::format("o {}\nusemtl {}\n", name, name);
  for (const Vec3& point : mesh.points) {
    const Eigen::Vector3f p = point.cast<float>();
    text += fmt::format("v {} {} {}\n", p.x(), p.y(), p.z());
  }
  for (const Triangle& t : mesh.triangles) {
    text += fmt::format("f {} {} {}\n", t[0] + points_before + 1, t[1] + points_before + 1,
                        t[2] + points_before + 1);
  }
}

void AppendMtl(const std::string& name, const std::array<double, 3>& colour, double gloss,
               std::string& text) {
  text += fmt::format("newmtl {}\nKd {} {} {}\nKs {} {} {}\nNs 60\n", name, colour[0], colour[1],
                      colour[2], gloss, gloss, gloss);
}

std::pair<std::string, std::string> ObjAndMtl(const Bust& bust, const BustModel& model) {
  std::string mtl = model.obj ? FlatMtl(*model.obj) : "";
  std::string obj;
  std::size_t points = bust.skin.points.size();
  if (model.obj) {
    obj = ObjWithPoints(*model.obj, bust.skin.points, mtl.empty() ? "" : "bust.mtl");
  } else {
    obj = "# mm, LPS: +x subject left, +y posterior, +z up\nmtllib bust.mtl\n";
    AppendObj("skin", bust.skin, 0, obj);
    AppendMtl("skin", kSkinColour, 0.1, mtl);
  }
  for (const Piece& piece : EyePieces(bust.eyes)) {
    AppendObj(piece.name, {piece.points, piece.triangles}, points, obj);
    AppendMtl(piece.name, piece.colour, 0.5, mtl);
    points += piece.points.size();
  }
  return {obj, mtl};
}

}  // namespace

std::vector<NamedBytes> BustToFiles(const Bust& bust, const BustModel& model) {
  std::vector<NamedBytes> files = {{"bust.glb", GlbWriter().Write(PiecesOf(bust, model))}};
  auto [obj, mtl] = ObjAndMtl(bust, model);
  files.push_back({"bust.obj", std::move(obj)});
  if (!mtl.empty()) {
    files.push_back({"bust.mtl", std::move(mtl)});
  }
  if (model.obj) {
    for (const fs::path& texture : model.obj->textures) {
      files.push_back({texture.filename().string(), ReadFileBytes(texture)});
    }
  }
  return files;
}

}  // namespace semblance
