// SPDX-License-Identifier: GPL-3.0-or-later
// Keeps points away from people that would spoil a face: a depth marker there would stand on the
// inner side of the bone, at the end of the scan, or point into the skull.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "surfaces/mesh/cut_planes.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {

// The ends of a skull's surface: open borders of the mesh, and lids over the end of the scan.
class SurfaceEnds {
 public:
  explicit SurfaceEnds(const TriMesh& skull);

  bool IsNear(const Vec3& point, double distance_mm) const;

 private:
  std::optional<PointQuery> borders_;
  std::vector<CutPlane> lids_;
};

// A skull with its search structures.
struct SuggestedBone {
  const TriMesh& mesh;
  const MeshQuery& query;
  const SurfaceEnds& ends;
};

// The reason not to suggest the point; empty if there is none. `point` lies on the bone, `outward`
// is the unit direction that the site's bone should face. The point is refused if
//   - an end of the surface is within 2 mm;
//   - the bone faces more than 75 degrees away from that direction, on average within 3 mm;
//   - a straight line in the bone's direction meets more bone within 20 mm, as from an inner table,
//     a sinus or the floor of an orbit.
std::string SuggestionFault(const Vec3& point, const Vec3& outward, const SuggestedBone& bone);

// The direction of a depth marker at a suggested point, of unit length: the mean of the bone's
// direction within 3 mm and of `outward`. The bone's alone follows roots of teeth and rims, which
// lie elsewhere on each skull; at Supra M2 a turn of 20 degrees moves the marker's end by 7 mm.
Vec3 SuggestedDirection(const Vec3& point, const Vec3& outward, const SuggestedBone& bone);

// The outermost bone at a predicted point: the first that a line against `outward` meets, from
// 20 mm outside to 15 mm inside of it. None if there is no bone, or if it has a fault.
std::optional<Vec3> FindOuterPoint(const Vec3& predicted, const Vec3& outward,
                                   const SuggestedBone& bone);

}  // namespace semblance::problems
