// SPDX-License-Identifier: GPL-3.0-or-later
// Geometry as short text: quantised, base64, named by its content.
#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// Collects blobs; each Add returns the name of what it added.
class SceneBlobs {
 public:
  using Segment = std::array<std::int32_t, 2>;

  // {low, step, points: 3 x uint16 a point, triangles: 3 x uint16 or uint32}; a coordinate is
  // low + step * number.
  std::string AddMesh(const TriMesh& mesh);
  std::string AddLines(std::span<const Vec3> points, std::span<const Segment> segments);
  // {values: int16, in 0.01 mm; the least int16 is "no value"}. Beyond +-320 mm: the nearest.
  std::string AddValues(std::span<const double> values_mm);

  const nlohmann::ordered_json& All() const { return blobs_; }

 private:
  std::string Add(nlohmann::ordered_json blob);

  nlohmann::ordered_json blobs_ = nlohmann::ordered_json::object();
};

// What AddMesh adds.
nlohmann::ordered_json BlobOfMesh(const TriMesh& mesh);

// What AddMesh has made of a mesh, as a mesh again; a coordinate is off by half a step at most.
// Throws InputError, or what the JSON library throws, for a blob that is no mesh.
TriMesh MeshOfBlob(const nlohmann::ordered_json& blob);

}  // namespace semblance
