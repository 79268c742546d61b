// SPDX-License-Identifier: GPL-3.0-or-later
// Writes meshes as binary glTF 2.0, which most viewers open.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance::surfaces {

struct GlbMaterial {
  std::string name;
  std::array<double, 3> colour = {0.8, 0.8, 0.8};  // sRGB, 0..1; ignored if there is a texture
  double roughness = 0.8;                          // 0..1
  std::string texture = {};                        // bytes of a PNG or JPEG; empty: none
};

// The triangles of one material.
struct GlbPart {
  GlbMaterial material;
  std::vector<Vec3> points, normals;  // mm, LPS; one normal per point
  std::vector<Vec2> uv = {};          // one per point, v upwards, or none
  // sRGB, one per point, or none. Viewers multiply them with the colour of the material.
  std::vector<std::array<std::uint8_t, 3>> colours = {};
  std::vector<Triangle> triangles;
};

struct GlbNode {
  std::string name;
  std::vector<GlbPart> parts = {};
  std::vector<GlbNode> children = {};
  Vec3 offset_mm = Vec3::Zero();      // from the parent's origin, LPS
  std::optional<double> turn_s = {};  // turns about its vertical axis, once in so many seconds
};

// True if the bytes can be a texture: the first ones are those of a PNG or a JPEG.
bool IsGlbPicture(std::string_view bytes);

// Writes the nodes as one scene with, if a node turns, one animation named "turn": the subject's
// left side comes to the front first. Lengths are in metres, with +y up, the face towards +z and
// the subject's left at +x, in single precision. Equal materials and textures are written once.
// Surfaces are visible from both sides. A normal of zero becomes (0, 0, 1) because glTF allows no
// zero normals. Throws InputError for a turn that does not take a positive time, a part without
// triangles, with another number of normals, uv or colours than points, or with a texture that is
// neither PNG nor JPEG.
std::string EncodeGlb(std::span<const GlbNode> nodes);

}  // namespace semblance::surfaces
