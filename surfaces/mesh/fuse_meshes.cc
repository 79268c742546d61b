// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/fuse_meshes.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/connected_components.h>
#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Polygon_mesh_processing/measure.h>
#include <CGAL/Surface_mesh.h>
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "surfaces/base/error.h"

namespace semblance::surfaces {
namespace {

namespace PMP = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
using Vertex = Mesh::Vertex_index;
using Face = Mesh::Face_index;
using HalfEdge = Mesh::Halfedge_index;
using IsSeam = Mesh::Property_map<Mesh::Edge_index, bool>;
using ComponentOfFace = Mesh::Property_map<Face, std::size_t>;

constexpr const char* kMoveALittle = "move the feature a little";

// A mesh that is cut along the seam.
struct Part {
  std::string name;  // "body" or "feature"
  Mesh mesh;
  IsSeam is_seam;
};

Vec3 ToVec3(const Kernel::Point_3& p) { return {p.x(), p.y(), p.z()}; }
Vec3 At(const Mesh& mesh, Vertex v) { return ToVec3(mesh.point(v)); }

std::string Place(const Vec3& p) {
  return fmt::format("({:.1f}, {:.1f}, {:.1f})", p.x(), p.y(), p.z());
}

Part ToPart(const TriMesh& from, std::string name) {
  Part part{.name = std::move(name), .mesh = {}, .is_seam = {}};
  std::vector<Vertex> vertices;
  for (const Vec3& p : from.points) {
    vertices.push_back(part.mesh.add_vertex({p.x(), p.y(), p.z()}));
  }
  for (const Triangle& t : from.triangles) {
    if (part.mesh.add_face(vertices[t[0]], vertices[t[1]], vertices[t[2]]) == Mesh::null_face()) {
      throw InputError(
          fmt::format("the {} is not a consistently oriented manifold at {}; repair it first",
                      part.name, Place(from.points[t[0]])));
    }
  }
  part.is_seam = part.mesh.add_property_map<Mesh::Edge_index, bool>("e:seam", false).first;
  return part;
}

// Cuts both meshes along the curves where they meet, so that these consist of edges of both, with
// the same points. Faults elsewhere do not matter.
void CutAlongSeam(Part& body, Part& feature) try {
  PMP::corefine(
      body.mesh, feature.mesh,
      PMP::parameters::edge_is_constrained_map(body.is_seam).throw_on_self_intersection(true),
      PMP::parameters::edge_is_constrained_map(feature.is_seam));
} catch (const PMP::Corefinement::Self_intersection_exception&) {
  throw InputError(
      "the body or the feature meets itself where the two meshes meet; repair it first");
}

// The seam in one mesh, as half-edges by their two points. Both directions of an edge are listed.
// Rounding can give two points of the seam the same coordinates; the edge between them is left out.
using Coordinates = std::array<double, 3>;
using Seam = std::map<std::array<Coordinates, 2>, HalfEdge>;

Coordinates CoordinatesOf(const Mesh& mesh, Vertex v) {
  const Kernel::Point_3& p = mesh.point(v);
  return {p.x(), p.y(), p.z()};
}

Seam FindSeam(const Part& part) {
  Seam seam;
  for (const HalfEdge h : part.mesh.halfedges()) {
    const std::array ends = {CoordinatesOf(part.mesh, source(h, part.mesh)),
                             CoordinatesOf(part.mesh, target(h, part.mesh))};
    if (part.is_seam[edge(h, part.mesh)] && ends[0] != ends[1]) {
      seam[ends] = h;
    }
  }
  return seam;
}

// Throws if the seam is empty or ends somewhere: then it does not separate a mesh into parts.
void CheckSeam(const Part& part, const Seam& seam) {
  if (seam.empty()) {
    throw InputError(
        "the feature does not meet the body; move it until it reaches into the body all round");
  }
  std::map<Coordinates, int> edges_at;
  for (const auto& [ends, h] : seam) {
    edges_at[ends[0]]++;
    if (is_border(h, part.mesh)) {
      throw InputError(fmt::format("the border of the {} lies on the other mesh at {}; {}",
                                   part.name, Place(Vec3(ends[0].data())), kMoveALittle));
    }
  }
  for (const auto& [at, count] : edges_at) {
    if (count == 1) {
      throw InputError(fmt::format(
          "the two meshes meet along a curve that ends at {}; the border of the feature must lie "
          "inside the body all round, and the border of the body outside the feature",
          Place(Vec3(at.data()))));
    }
    if (count > 2) {
      throw InputError(fmt::format("the two meshes lie on each other or touch at {}; {}",
                                   Place(Vec3(at.data())), kMoveALittle));
    }
  }
}

// The angle of a triangle's third corner around the axis from p to q, seen against the axis.
class AxisAngles {
 public:
  AxisAngles(const Vec3& p, const Vec3& q) : p_(p), axis_((q - p).normalized()) {
    Eigen::Index least = 0;
    axis_.cwiseAbs().minCoeff(&least);
    x_ = axis_.cross(Vec3::Unit(least)).normalized();
    y_ = axis_.cross(x_);
  }
  double Of(const Vec3& corner) const {
    return std::atan2((corner - p_).dot(y_), (corner - p_).dot(x_));
  }

 private:
  Vec3 p_, axis_, x_, y_;
};

double Turn(double from, double to) {
  const double full = 2 * std::numbers::pi;
  const double turn = std::fmod(to - from, full);
  return turn < 0 ? turn + full : turn;
}

Vec3 ThirdCorner(const Mesh& mesh, HalfEdge h) { return At(mesh, target(next(h, mesh), mesh)); }

// True if the triangle of `part` to the left of half-edge h lies outside the surface `other`, whose
// half-edge along the same two points is o. The outer side of a surface begins at the triangle on
// the left of o and ends at the one on its right, when turning about the axis.
bool IsOutside(const Part& part, HalfEdge h, const Part& other, HalfEdge o) {
  const AxisAngles angles(At(part.mesh, source(h, part.mesh)), At(part.mesh, target(h, part.mesh)));
  const double left = angles.Of(ThirdCorner(other.mesh, o));
  const double right = angles.Of(ThirdCorner(other.mesh, opposite(o, other.mesh)));
  return Turn(left, angles.Of(ThirdCorner(part.mesh, h))) < Turn(left, right);
}

// The lengths of seam at which a component is outside and inside the other mesh, mm.
struct SeamVotes {
  double outside_mm = 0, inside_mm = 0;
  Vec3 at = Vec3::Zero();  // on the seam
};

// Rounding moves the corners of edges much shorter than 1e-6 mm, so that some of them vote for the
// wrong side. This share of a seam may do so. Half of it does where meshes lie on each other.
constexpr double kWrongVotes = 1e-3;

std::vector<SeamVotes> CountVotes(const Part& part, const Seam& seam, const Part& other,
                                  const Seam& other_seam, const ComponentOfFace& component,
                                  std::size_t count) {
  std::vector<SeamVotes> votes(count);
  for (const auto& [ends, h] : seam) {
    SeamVotes& vote = votes[component[face(h, part.mesh)]];
    vote.at = Vec3(ends[0].data());
    const double length_mm = (Vec3(ends[1].data()) - vote.at).norm();
    (IsOutside(part, h, other, other_seam.at(ends)) ? vote.outside_mm : vote.inside_mm) +=
        length_mm;
  }
  return votes;
}

// One entry per face of a part.
struct Sides {
  std::vector<bool> kept;   // not inside the other mesh
  std::vector<bool> apart;  // in a component that no seam touches
};

Sides FindSides(Part& part, const Seam& seam, const Part& other, const Seam& other_seam) {
  auto component = part.mesh.add_property_map<Face, std::size_t>("f:component", 0).first;
  const std::size_t count = PMP::connected_components(
      part.mesh, component, PMP::parameters::edge_is_constrained_map(part.is_seam));
  const std::vector<SeamVotes> votes = CountVotes(part, seam, other, other_seam, component, count);
  for (const SeamVotes& vote : votes) {
    if (std::min(vote.outside_mm, vote.inside_mm) >
        kWrongVotes * (vote.outside_mm + vote.inside_mm)) {
      throw InputError(
          fmt::format("a part of the {} is neither inside nor outside the other mesh "
                      "at {}; {}",
                      part.name, Place(vote.at), kMoveALittle));
    }
  }
  Sides sides;
  for (const Face f : part.mesh.faces()) {
    const SeamVotes& vote = votes[component[f]];
    sides.kept.push_back(vote.outside_mm >= vote.inside_mm);
    sides.apart.push_back(vote.outside_mm + vote.inside_mm == 0);
  }
  return sides;
}

void RefusePiecesApart(const Part& feature, const Sides& sides) {
  for (const Face f : feature.mesh.faces()) {
    if (sides.apart[f]) {
      const Vertex at = target(halfedge(f, feature.mesh), feature.mesh);
      throw InputError(
          fmt::format("a piece of the feature does not meet the body, at {}; remove it or move it",
                      Place(At(feature.mesh, at))));
    }
  }
}

// Adds the faces of a part for which keep[f] is true. `known` holds the points that are already in
// the mesh, so that those of the seam are not doubled. A triangle with two equal corners is left
// out.
void AddFaces(const Part& part, const std::vector<bool>& keep,
              std::map<Coordinates, std::int32_t>& known, TriMesh& mesh) {
  for (const Face f : part.mesh.faces()) {
    if (!keep[f]) {
      continue;
    }
    Triangle t;
    int corner = 0;
    for (const Vertex v : CGAL::vertices_around_face(halfedge(f, part.mesh), part.mesh)) {
      const auto [entry, is_new] = known.try_emplace(CoordinatesOf(part.mesh, v),
                                                     static_cast<std::int32_t>(mesh.points.size()));
      if (is_new) {
        mesh.points.push_back(At(part.mesh, v));
      }
      t[corner++] = entry->second;
    }
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) {
      mesh.triangles.push_back(t);
    }
  }
}

double AreaWhere(const Part& part, const std::vector<bool>& chosen) {
  double area_mm2 = 0;
  for (const Face f : part.mesh.faces()) {
    area_mm2 += chosen[f] ? PMP::face_area(f, part.mesh) : 0;
  }
  return area_mm2;
}

double SeamLength(const Seam& seam) {
  double twice_mm = 0;
  for (const auto& [ends, h] : seam) {
    twice_mm += (Vec3(ends[1].data()) - Vec3(ends[0].data())).norm();
  }
  return twice_mm / 2;
}

// An inside-out feature would keep the part of the body that it should cover.
void RefuseTurned(const FusedMesh& fused, double body_mm2) {
  if (fused.covered_mm2 > body_mm2 / 2 || CheckEdges(fused.mesh).inconsistent > 0) {
    throw InputError(fmt::format(
        "the feature would cover {:.0f} of the body's {:.0f} mm2; the triangles of both must be "
        "counter-clockwise seen from outside, and the body is the larger of the two",
        fused.covered_mm2, body_mm2));
  }
}

}  // namespace

FusedMesh FuseMeshes(const TriMesh& body, const TriMesh& feature) {
  Part base = ToPart(body, "body");
  Part added = ToPart(feature, "feature");
  CutAlongSeam(base, added);
  const Seam base_seam = FindSeam(base), added_seam = FindSeam(added);
  CheckSeam(base, base_seam);
  CheckSeam(added, added_seam);
  const Sides of_base = FindSides(base, base_seam, added, added_seam);
  const Sides of_added = FindSides(added, added_seam, base, base_seam);
  RefusePiecesApart(added, of_added);

  FusedMesh fused;
  std::map<Coordinates, std::int32_t> known;
  AddFaces(base, of_base.kept, known, fused.mesh);
  AddFaces(added, of_added.kept, known, fused.mesh);
  fused.seam_mm = SeamLength(base_seam);
  fused.covered_mm2 = Area(body) - AreaWhere(base, of_base.kept);
  fused.added_mm2 = AreaWhere(added, of_added.kept);
  RefuseTurned(fused, Area(body));
  return fused;
}

}  // namespace semblance::surfaces
