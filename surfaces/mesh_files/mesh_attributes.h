// SPDX-License-Identifier: GPL-3.0-or-later
// What a file of a mesh may carry beside the shape.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance {

struct VertexScalar {
  std::string name;            // in a PLY: MeshLab shows "quality", CloudCompare any "scalar_..."
  std::vector<double> values;  // NaN where there is no data
};

// Each vector is empty or has one entry per vertex.
struct MeshAttributes {
  std::vector<Vec3> normals;
  std::vector<std::array<std::uint8_t, 3>> colors;  // sRGB
  std::vector<VertexScalar> scalars;
};

// Throws InputError if one has another number of entries.
void CheckAttributes(std::size_t vertices, const MeshAttributes& attributes);

}  // namespace semblance
