// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh_files/glb.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <bit>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <string_view>

#include "surfaces/base/error.h"
#include "surfaces/mesh_files/srgb.h"

namespace semblance::surfaces {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kFloat = 5126, kUnsigned = 5125, kShort = 5123, kVertices = 34962, kIndices = 34963;

// Converts LPS to the axes of glTF: +z up becomes +y up, and the face looks along +z.
Eigen::Vector3f ToGltf(const Vec3& v) { return Vec3(v.x(), v.z(), -v.y()).cast<float>(); }

// The numbers of glTF are little-endian on every machine.
template <class Integer>
void Append(std::string& bytes, Integer value) {
  for (std::size_t k = 0; k < sizeof(Integer); ++k) {
    bytes += static_cast<char>(value >> (8 * k) & 0xff);
  }
}
void AppendFloat(std::string& bytes, float value) {
  Append(bytes, std::bit_cast<std::uint32_t>(value));
}
void AppendVector(std::string& bytes, const Eigen::Vector3f& v) {
  for (const float x : {v.x(), v.y(), v.z()}) {
    AppendFloat(bytes, x);
  }
}

// A channel of 8 bits needs 16 bits in linear light, or dark colours would lose steps.
std::uint16_t LinearShort(std::uint8_t srgb) {
  return static_cast<std::uint16_t>(std::lround(65535 * LinearFromSrgb(srgb / 255.0)));
}

bool IsPng(std::string_view bytes) { return bytes.starts_with("\x89PNG\r\n\x1a\n"); }

void CheckPart(const GlbPart& part) {
  const auto fits = [&](std::size_t size) { return size == 0 || size == part.points.size(); };
  if (part.triangles.empty() || part.normals.size() != part.points.size() ||
      !fits(part.uv.size()) || !fits(part.colours.size())) {
    throw InputError(fmt::format(
        "glTF '{}': {} triangles, {} points, {} normals, {} uv and {} colours; at least one "
        "triangle and one normal per point are needed, and uv and colours of all points or none",
        part.material.name, part.triangles.size(), part.points.size(), part.normals.size(),
        part.uv.size(), part.colours.size()));
  }
  if (!part.material.texture.empty() && !IsGlbPicture(part.material.texture)) {
    throw InputError(fmt::format(
        "glTF '{}': its texture is neither a PNG nor a JPEG picture; save it as one of them",
        part.material.name));
  }
}

class GlbWriter {
 public:
  std::string Write(std::span<const GlbNode> nodes) {
    json_["asset"] = {{"version", "2.0"}, {"generator", "semblance"}};
    json_["scene"] = 0;
    json_["scenes"] = Json::array({Json::object()});
    json_["nodes"] = Json::array();
    json_["scenes"][0]["nodes"] = Nodes(nodes);
    json_["buffers"] = Json::array({{{"byteLength", binary_.size()}}});
    return Bytes();
  }

 private:
  Json Nodes(std::span<const GlbNode> nodes) {
    Json numbers = Json::array();
    for (const GlbNode& node : nodes) {
      const std::size_t number = json_["nodes"].size();
      numbers.push_back(number);
      json_["nodes"].push_back({{"name", node.name}});
      if (!node.offset_mm.isZero()) {
        const Eigen::Vector3f t = ToGltf(node.offset_mm / 1000);
        json_["nodes"][number]["translation"] = {t.x(), t.y(), t.z()};
      }
      if (node.turn_s) {
        Turn(number, node);
      }
      if (!node.parts.empty()) {
        json_["nodes"][number]["mesh"] = Mesh(node);
      }
      if (!node.children.empty()) {
        const Json children = Nodes(node.children);
        json_["nodes"][number]["children"] = children;
      }
    }
    return numbers;
  }

  // Rotations in steps of an eighth, because viewers take the shorter way from one to the next.
  void Turn(std::size_t number, const GlbNode& node) {
    constexpr int kSteps = 8;
    if (!(*node.turn_s > 0)) {
      throw InputError(fmt::format("glTF '{}': a turn of {} s; a time above 0 is needed", node.name,
                                   *node.turn_s));
    }
    std::string times, rotations;
    for (int k = 0; k <= kSteps; ++k) {
      const double half_angle = -std::numbers::pi * k / kSteps;  // about +y
      AppendFloat(times, static_cast<float>(*node.turn_s * k / kSteps));
      for (const double x : {0.0, std::sin(half_angle), 0.0, std::cos(half_angle)}) {
        AppendFloat(rotations, static_cast<float>(x));
      }
    }
    const std::size_t input = Accessor(times, kFloat, kSteps + 1, "SCALAR", std::nullopt);
    json_["accessors"][input]["min"] = {0};
    json_["accessors"][input]["max"] = {static_cast<float>(*node.turn_s)};
    AddChannel(number, input, Accessor(rotations, kFloat, kSteps + 1, "VEC4", std::nullopt));
  }

  void AddChannel(std::size_t node, std::size_t times, std::size_t rotations) {
    Json& animation = json_["animations"][0];
    animation["name"] = "turn";
    animation["samplers"].push_back(
        {{"input", times}, {"output", rotations}, {"interpolation", "LINEAR"}});
    animation["channels"].push_back({{"sampler", animation["samplers"].size() - 1},
                                     {"target", {{"node", node}, {"path", "rotation"}}}});
  }

  std::size_t Mesh(const GlbNode& node) {
    Json primitives = Json::array();
    for (const GlbPart& part : node.parts) {
      CheckPart(part);
      primitives.push_back(Primitive(part));
    }
    json_["meshes"].push_back({{"name", node.name}, {"primitives", primitives}});
    return json_["meshes"].size() - 1;
  }

  Json Primitive(const GlbPart& part) {
    Json attributes = {{"POSITION", Positions(part.points)}, {"NORMAL", Normals(part.normals)}};
    if (!part.uv.empty()) {
      attributes["TEXCOORD_0"] = TextureCoordinates(part.uv);
    }
    if (!part.colours.empty()) {
      attributes["COLOR_0"] = Colours(part.colours);
    }
    std::string bytes;
    for (const Triangle& t : part.triangles) {
      for (const std::int32_t corner : t) {
        Append(bytes, static_cast<std::uint32_t>(corner));
      }
    }
    const std::size_t indices =
        Accessor(bytes, kUnsigned, 3 * part.triangles.size(), "SCALAR", kIndices);
    return {{"attributes", attributes}, {"indices", indices}, {"material", Material(part)}};
  }

  std::size_t Positions(const std::vector<Vec3>& points) {
    std::string bytes;
    Eigen::AlignedBox3f box;
    for (const Vec3& point : points) {
      const Eigen::Vector3f p = ToGltf(point / 1000);
      box.extend(p);
      AppendVector(bytes, p);
    }
    const std::size_t accessor = Accessor(bytes, kFloat, points.size(), "VEC3", kVertices);
    json_["accessors"][accessor]["min"] = {box.min().x(), box.min().y(), box.min().z()};
    json_["accessors"][accessor]["max"] = {box.max().x(), box.max().y(), box.max().z()};
    return accessor;
  }

  std::size_t Normals(const std::vector<Vec3>& normals) {
    std::string bytes;
    for (const Vec3& normal : normals) {
      const bool none = !(normal.norm() > 0);
      AppendVector(bytes, ToGltf(none ? Vec3(-Vec3::UnitY()) : Vec3(normal.normalized())));
    }
    return Accessor(bytes, kFloat, normals.size(), "VEC3", kVertices);
  }

  std::size_t TextureCoordinates(const std::vector<Vec2>& coordinates) {
    std::string bytes;
    for (const Vec2& uv : coordinates) {
      AppendFloat(bytes, static_cast<float>(uv.x()));
      AppendFloat(bytes, static_cast<float>(1 - uv.y()));  // glTF's v goes down
    }
    return Accessor(bytes, kFloat, coordinates.size(), "VEC2", kVertices);
  }

  std::size_t Colours(const std::vector<std::array<std::uint8_t, 3>>& colours) {
    std::string bytes;
    for (const auto& colour : colours) {
      for (const std::uint8_t channel : colour) {
        Append(bytes, LinearShort(channel));
      }
      Append(bytes, std::uint16_t{65535});  // opaque; it keeps the entries aligned
    }
    const std::size_t accessor = Accessor(bytes, kShort, colours.size(), "VEC4", kVertices);
    json_["accessors"][accessor]["normalized"] = true;
    return accessor;
  }

  std::size_t Material(const GlbPart& part) {
    const GlbMaterial& material = part.material;
    const auto& c = material.colour;
    Json look = {
        {"baseColorFactor", {LinearFromSrgb(c[0]), LinearFromSrgb(c[1]), LinearFromSrgb(c[2]), 1}},
        {"metallicFactor", 0},
        {"roughnessFactor", material.roughness}};
    if (!material.texture.empty()) {
      look["baseColorFactor"] = {1, 1, 1, 1};
      look["baseColorTexture"] = {{"index", Texture(material.texture)}};
    }
    const Json json = {
        {"name", material.name}, {"pbrMetallicRoughness", look}, {"doubleSided", true}};
    const auto [known, is_new] = materials_.try_emplace(json.dump(), materials_.size());
    if (is_new) {
      json_["materials"].push_back(json);
    }
    return known->second;
  }

  std::size_t Texture(const std::string& bytes) {
    const auto [known, is_new] = textures_.try_emplace(bytes, textures_.size());
    if (is_new) {
      json_["images"].push_back({{"bufferView", View(bytes, std::nullopt)},
                                 {"mimeType", IsPng(bytes) ? "image/png" : "image/jpeg"}});
      json_["textures"].push_back({{"source", json_["images"].size() - 1}});
    }
    return known->second;
  }

  std::size_t View(const std::string& bytes, std::optional<int> target) {
    Json view = {{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", bytes.size()}};
    if (target) {
      view["target"] = *target;
    }
    binary_ += bytes;
    binary_.append((4 - binary_.size() % 4) % 4, '\0');
    json_["bufferViews"].push_back(view);
    return json_["bufferViews"].size() - 1;
  }

  std::size_t Accessor(const std::string& bytes, int component, std::size_t count, const char* type,
                       std::optional<int> target) {
    json_["accessors"].push_back({{"bufferView", View(bytes, target)},
                                  {"componentType", component},
                                  {"count", count},
                                  {"type", type}});
    return json_["accessors"].size() - 1;
  }

  std::string Bytes() const {
    std::string text = json_.dump(-1, ' ', false, Json::error_handler_t::replace);
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

  Json json_;
  std::string binary_;
  std::map<std::string, std::size_t> materials_, textures_;
};

}  // namespace

bool IsGlbPicture(std::string_view bytes) {
  return IsPng(bytes) || bytes.starts_with("\xff\xd8\xff");
}

std::string EncodeGlb(std::span<const GlbNode> nodes) { return GlbWriter().Write(nodes); }

}  // namespace semblance::surfaces
