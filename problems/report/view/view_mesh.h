// SPDX-License-Identifier: GPL-3.0-or-later
// Geometry for the 3-D view: meshes with fewer triangles, and their points and values as short text
// (quantised, base64). view_geometry.js reads this text.
#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

inline constexpr int kViewTriangles = 24000;  // enough for one mesh of a report on a screen

// Reduces any mesh to about `most_triangles` of its own vertices, without a bound on the distance:
// it is a picture. A mesh of many small pieces may keep twice as many.
TriMesh SimplifyForView(const TriMesh& mesh, int most_triangles = kViewTriangles);

// Collects blobs of geometry. Each Add returns the name of its blob, a hash of the content, so
// equal blobs are stored once.
class SceneBlobs {
 public:
  using Segment = std::array<std::int32_t, 2>;

  // {low, step, points: 3 x uint16 per point, triangles: 3 x uint16 or uint32 per triangle}. A
  // coordinate is low + step * number.
  std::string AddMesh(const TriMesh& mesh);
  // The same with segments: 2 x uint16 or uint32 per segment.
  std::string AddLines(std::span<const Vec3> points, std::span<const Segment> segments);
  // {values: int16 in 0.01 mm}. The least int16 stands for "no value". Values beyond +-320 mm are
  // clamped.
  std::string AddValues(std::span<const double> values_mm);

  const nlohmann::ordered_json& All() const { return blobs_; }

 private:
  std::string Add(nlohmann::ordered_json blob);

  nlohmann::ordered_json blobs_ = nlohmann::ordered_json::object();
};

// The blob that AddMesh adds.
nlohmann::ordered_json EncodeMeshBlob(const TriMesh& mesh);

// The inverse of EncodeMeshBlob. A coordinate is off by half a step at most. Throws InputError, or
// an exception of the JSON library, if the blob is not a mesh.
TriMesh DecodeMeshBlob(const nlohmann::ordered_json& blob);

}  // namespace semblance::problems
