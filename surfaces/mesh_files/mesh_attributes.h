// SPDX-License-Identifier: GPL-3.0-or-later
// Data per vertex that a mesh file can contain in addition to the shape.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance::surfaces {

struct VertexScalar {
  // In a PLY, MeshLab shows the scalar "quality", and CloudCompare every "scalar_...".
  std::string name;
  std::vector<double> values;  // NaN where there is no data
};

// Each vector is empty or has one entry per vertex.
struct MeshAttributes {
  std::vector<Vec3> normals;
  std::vector<std::array<std::uint8_t, 3>> colors;  // sRGB
  std::vector<VertexScalar> scalars;
};

// Throws InputError if an attribute has neither zero entries nor one per vertex.
void CheckAttributes(std::size_t vertices, const MeshAttributes& attributes);

}  // namespace semblance::surfaces
