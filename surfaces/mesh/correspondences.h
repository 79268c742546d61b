// SPDX-License-Identifier: GPL-3.0-or-later
// Finds the point of a mesh that corresponds to a given point: the closest one, if it faces the
// same way.
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "surfaces/mesh/mesh_query.h"

namespace semblance::surfaces {

struct CorrespondenceOptions {
  double reach_mm = std::numeric_limits<double>::infinity();  // largest distance between the two
  double least_cosine = -1;  // of the angle between the two normals; -1 accepts every direction
};

// A scan ends at its open borders. The closest point of everything beyond a border lies on that
// border, so a fit that believed it would be drawn there.
enum class OpenBorder {
  kAccept,
  kReject  // no point corresponds to one in a triangle with a vertex on an open border
};

struct Correspondence {
  MeshPoint point;                     // on the mesh; distance_mm from the point asked about
  Vec3 normal = Vec3::Constant(kNaN);  // of the mesh there: unit, interpolated from its vertices
};

// Keeps a search tree for many questions. Const calls are safe from several threads at once.
class Correspondences {
 public:
  // Throws InputError as MeshQuery does.
  explicit Correspondences(const TriMesh& mesh, OpenBorder border = OpenBorder::kAccept);
  // With one normal per vertex in place of VertexNormals(mesh).
  Correspondences(const TriMesh& mesh, std::vector<Vec3> vertex_normals,
                  OpenBorder border = OpenBorder::kAccept);

  // The closest point of the mesh, if it corresponds to p. normal: unit, at p.
  std::optional<Correspondence> Find(const Vec3& p, const Vec3& normal,
                                     const CorrespondenceOptions& options) const;

  // The same for a point of the mesh that was found in another way, for example along a ray.
  std::optional<Correspondence> Check(const MeshPoint& point, const Vec3& normal,
                                      const CorrespondenceOptions& options) const;

  Vec3 NormalAt(const MeshPoint& point) const;  // unit
  const std::vector<Vec3>& vertex_normals() const { return normals_; }
  const MeshQuery& query() const { return query_; }

 private:
  std::vector<Triangle> triangles_;
  std::vector<Vec3> normals_;    // one per vertex
  std::vector<char> on_border_;  // one per vertex; empty if borders are accepted
  MeshQuery query_;
};

}  // namespace semblance::surfaces
