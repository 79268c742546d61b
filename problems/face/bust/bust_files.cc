// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/bust/bust_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <utility>

#include "surfaces/base/atomic_file.h"
#include "surfaces/mesh_files/glb.h"
#include "surfaces/mesh_files/text_lines.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

constexpr std::array<double, 3> kSkinColour = {0.85, 0.65, 0.54};
constexpr std::array<double, 3> kWhite = {1, 1, 1};  // leaves the colours of points unchanged

// A part of the bust with one colour or texture.
struct Piece {
  std::string name;
  std::array<double, 3> colour = kSkinColour;  // sRGB
  fs::path texture;                            // empty: none
  double roughness = 0.6;
  std::vector<Vec3> points, normals;
  std::vector<Vec2> uv;                                   // one per point, or none; v upwards
  std::vector<std::array<std::uint8_t, 3>> colours = {};  // sRGB, one per point, or none
  std::vector<Triangle> triangles;
};

Piece MakePiece(const EyePart& part) {
  return {.name = part.name,
          .colour = part.colour,
          .texture = {},
          .roughness = 0.1,
          .points = part.mesh.points,
          .normals = VertexNormals(part.mesh),
          .uv = {},
          .triangles = part.mesh.triangles};
}

std::array<std::uint8_t, 3> ToBytes(const Vec3& colour) {
  std::array<std::uint8_t, 3> bytes{};
  for (int c = 0; c < 3; ++c) {
    bytes[c] = static_cast<std::uint8_t>(std::lround(255 * colour[c]));
  }
  return bytes;
}

// The colour of faces whose material no library describes.
std::array<double, 3> PlainColour(const ObjText& obj) {
  return obj.file.colours.empty() ? kSkinColour : kWhite;
}

std::string MaterialName(const std::string& material) {
  return material.empty() ? "skin" : material;
}

// Gives a piece the looks of its material. The colours of its points stay with a plain material.
// With a picture, which usually contains them, they would count twice.
void GiveLooks(const std::string& material, const ObjText& obj, Piece& piece) {
  piece.name = MaterialName(material);
  piece.colour = PlainColour(obj);
  if (const auto found = obj.materials.find(material); found != obj.materials.end()) {
    const Vec3& c = found->second.colour;
    piece.colour = {c.x(), c.y(), c.z()};
    piece.texture = found->second.texture;
    if (!piece.texture.empty()) {
      piece.colours.clear();
    }
  }
  if (obj.file.texture.empty()) {
    piece.uv.clear();
  }
}

// The faces of an OBJ by material. A point with two texture coordinates becomes two points.
std::vector<Piece> TexturedPieces(const TriMesh& skin, const ObjText& obj) {
  const std::vector<Vec3> normals = VertexNormals(skin);
  std::map<std::string, Piece> pieces;
  std::map<std::string, std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t>> numbers;
  for (const ObjPolygon& face : obj.file.polygons) {
    Piece& piece = pieces[face.material];
    auto& number = numbers[face.material];
    std::vector<std::int32_t> corners;
    for (const ObjPolygonCorner& corner : face.corners) {
      const auto [it, is_new] = number.try_emplace({corner.point, corner.texture},
                                                   static_cast<std::int32_t>(piece.points.size()));
      if (is_new) {
        piece.points.push_back(skin.points[corner.point]);
        piece.normals.push_back(normals[corner.point]);
        piece.uv.push_back(corner.texture < 0 ? Vec2(0, 0) : obj.file.texture[corner.texture]);
        if (!obj.file.colours.empty()) {
          piece.colours.push_back(ToBytes(obj.file.colours[corner.point]));
        }
      }
      corners.push_back(it->second);
    }
    AppendFan(corners, piece.triangles);
  }
  std::vector<Piece> result;
  for (auto& [name, piece] : pieces) {
    GiveLooks(name, obj, piece);
    result.push_back(std::move(piece));
  }
  return result;
}

// Joins the parts of both eyes that have the same name.
std::vector<Piece> EyePieces(const std::vector<EyePart>& parts) {
  std::map<std::string, Piece> pieces;
  for (const EyePart& part : parts) {
    Piece more = MakePiece(part);
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

std::vector<Piece> MakePieces(const Bust& bust, const BustModel& model) {
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

GlbPart MakeGlbPart(const Piece& piece) {
  return {.material = {.name = piece.name,
                       .colour = piece.colour,
                       .roughness = piece.roughness,
                       .texture = piece.texture.empty() ? "" : ReadFileBytes(piece.texture)},
          .points = piece.points,
          .normals = piece.normals,
          .uv = piece.uv,
          .colours = piece.colours,
          .triangles = piece.triangles};
}

std::string BustGlb(const Bust& bust, const BustModel& model) {
  GlbNode node{.name = "bust"};
  for (const Piece& piece : MakePieces(bust, model)) {
    node.parts.push_back(MakeGlbPart(piece));
  }
  return EncodeGlb({&node, 1});
}

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

// Describes the materials of an OBJ without a library.
void AppendPlainMtl(const ObjText& obj, std::string& mtl) {
  std::set<std::string> names;
  for (const ObjPolygon& face : obj.file.polygons) {
    names.insert(MaterialName(face.material));
  }
  for (const std::string& name : names) {
    AppendMtl(name, PlainColour(obj), 0.1, mtl);
  }
}

std::pair<std::string, std::string> ObjAndMtl(const Bust& bust, const BustModel& model) {
  std::string mtl = model.obj ? JoinMtl(*model.obj) : "";
  std::string obj;
  std::size_t points = bust.skin.points.size();
  if (model.obj) {
    const bool is_plain = model.obj->materials.empty();
    if (is_plain) {
      AppendPlainMtl(*model.obj, mtl);
    }
    const bool starts_without = is_plain && model.obj->file.polygons.front().material.empty();
    obj = ObjWithPoints(*model.obj, bust.skin.points, starts_without ? MaterialName("") : "");
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
  std::vector<NamedBytes> files = {{"bust.glb", BustGlb(bust, model)}};
  auto [obj, mtl] = ObjAndMtl(bust, model);
  files.push_back({"bust.obj", std::move(obj)});
  files.push_back({"bust.mtl", std::move(mtl)});
  if (model.obj) {
    for (const ObjTexture& texture : model.obj->textures) {
      files.push_back({texture.name, ReadFileBytes(texture.file)});
    }
  }
  return files;
}

}  // namespace semblance::problems
