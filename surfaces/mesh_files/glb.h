// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes as binary glTF 2.0, for viewers of all kinds.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

struct GlbMaterial {
  std::string name;
  std::array<double, 3> colour = {0.8, 0.8, 0.8};  // sRGB, 0..1; not used under a texture
  double roughness = 0.8;                          // 0..1
  std::string texture = {};                        // bytes of a PNG or JPEG; empty: none
};

// Triangles of one material.
struct GlbPart {
  GlbMaterial material;
  std::vector<Vec3> points, normals;                      // mm, LPS; one normal per point
  std::vector<Vec2> uv = {};                              // one per point, v upwards, or none
  std::vector<std::array<std::uint8_t, 3>> colours = {};  // sRGB, one per point, or none: each is
                                                          // multiplied with the material's
  std::vector<Triangle> triangles;
};

struct GlbNode {
  std::string name;
  std::vector<GlbPart> parts = {};
  std::vector<GlbNode> children = {};
};

// Whether a texture may be these bytes: by its first ones, a PNG or JPEG.
bool IsGlbPicture(std::string_view bytes);

// One scene of these nodes: in metres, +y up, the face towards +z, subject left +x; single
// precision. Materials and textures that are equal are written once. Surfaces are seen from both
// sides. A normal of zero is written as (0, 0, 1), for glTF allows none. Throws InputError for a
// part without triangles, with another number of normals, uv or colours than points, or
// with a texture that is neither PNG nor JPEG.
std::string EncodeGlb(std::span<const GlbNode> nodes);

}  // namespace semblance
