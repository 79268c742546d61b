// SPDX-License-Identifier: GPL-3.0-or-later
// The section of a mesh by a plane, as lines in the plane.
#pragma once

#include <span>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance::surfaces {

// A plane with the axes of a picture. `right` and `up` are orthogonal unit vectors.
struct PicturePlane {
  Vec3 origin = Vec3::Constant(kNaN);  // mm
  Vec3 right = Vec3::UnitX();
  Vec3 up = Vec3::UnitZ();

  // The point's place in the picture, in mm from the origin to the right and upwards.
  Vec2 InPicture(const Vec3& p) const { return {right.dot(p - origin), up.dot(p - origin)}; }
  Vec3 InSpace(const Vec2& p) const { return origin + p.x() * right + p.y() * up; }
  // Positive on the viewer's side.
  double Height_mm(const Vec3& p) const { return right.cross(up).dot(p - origin); }
};

// Points in the picture, mm. A closed line does not repeat its first point.
struct SectionLine {
  std::vector<Vec2> points;
  bool closed = false;
};

// The lines in which the plane cuts the mesh. A vertex in the plane counts as being above it, so
// that each triangle is cut in one segment or not at all; a mesh without border therefore gives
// closed lines only. The solid lies on the left of a line if the triangles face outwards, so outer
// outlines run counter-clockwise and holes clockwise. Lines begin at the first cut triangle of the
// mesh that they contain, open ones at their end. Linear in the number of triangles.
std::vector<SectionLine> CutByPlane(const TriMesh& mesh, const PicturePlane& plane);

// The area that the closed lines enclose, in mm^2, with holes taken out.
double EnclosedArea(std::span<const SectionLine> lines);

}  // namespace semblance::surfaces
