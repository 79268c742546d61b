// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/mesh_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "surfaces/base/error.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::surfaces {
namespace {

// The unit in which the size is nearest to that of a head, with the remedy; otherwise the advice to
// check the unit.
std::string UnitGuess(double size, const std::string& remedy) {
  constexpr double kUsual_mm = 230;  // longest side of a skull or a head
  std::string guess = "check its unit";
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [unit, factor] : {std::pair("metres", 1000.0), std::pair("centimetres", 10.0),
                                     std::pair("inches", 25.4), std::pair("micrometres", 0.001)}) {
    const double size_mm = size * factor, off = std::abs(std::log(size_mm / kUsual_mm));
    if (size_mm >= 1.5 * kSmallestHead_mm && size_mm <= 0.8 * kLargestHead_mm && off < least) {
      least = off;
      guess = fmt::format("it looks like {}; {}", unit, fmt::format(fmt::runtime(remedy), factor));
    }
  }
  return guess;
}

// Beyond this distance the steps of single precision, which most files have, exceed 0.01 mm.
constexpr double kFarthest_mm = 1e5;

void CheckPlace(const TriMesh& mesh, const std::string& name) {
  const double off = Bounds(mesh).center().norm();
  if (!(off <= kFarthest_mm)) {
    throw InputError(
        fmt::format("{}: it lies {:.3g} mm from the origin, where its numbers are no longer exact; "
                    "move it to within {} m",
                    name, off, kFarthest_mm / 1000));
  }
}

void CheckArea(const TriMesh& mesh, const std::string& name) {
  constexpr double kLeast_mm2 = 1;
  const double area_mm2 = Area(mesh);
  if (!(area_mm2 >= kLeast_mm2)) {
    throw InputError(
        fmt::format("{}: its {} triangles have an area of {:.3g} mm² in all; give a "
                    "surface",
                    name, mesh.triangles.size(), area_mm2));
  }
}

// The share of rays from all sides towards the mesh that hit the outside of a triangle first.
double OutwardShare(const TriMesh& mesh, const MeshQuery& query) {
  const Box3 box = Bounds(mesh);
  const double radius = box.diagonal().norm();
  int outward_hits = 0, hits = 0;
  constexpr int kRays = 256;
  for (int n = 0; n < kRays; ++n) {  // directions of a Fibonacci sphere
    const double z = 1 - (2 * n + 1.0) / kRays, angle = n * std::numbers::pi * (3 - std::sqrt(5.0));
    const Vec3 outward(std::sqrt(1 - z * z) * std::cos(angle),
                       std::sqrt(1 - z * z) * std::sin(angle), z);
    if (const auto hit = query.FirstHit(box.center() + radius * outward, -outward, 2 * radius)) {
      ++hits;
      outward_hits += TriangleAreaVector(mesh, mesh.triangles[hit->triangle]).dot(outward) > 0;
    }
  }
  return hits > 0 ? static_cast<double>(outward_hits) / hits : kNaN;
}

// The share of the surface with another sheet within 0.25 mm that faces the same way.
double DoubledShare(const TriMesh& mesh, const MeshQuery& query) {
  constexpr double kNear_mm = 0.25;
  constexpr std::size_t kSamples = 400;
  const std::size_t step = mesh.triangles.size() / kSamples + 1;
  int samples = 0, doubled = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); t += step) {
    const Triangle& own = mesh.triangles[t];
    const Vec3 normal = TriangleAreaVector(mesh, own).normalized();
    const auto is_other_sheet = [&](const MeshPoint& hit) {
      const Triangle& other = mesh.triangles[hit.triangle];
      return std::ranges::find_first_of(own, other) == own.end() &&
             TriangleAreaVector(mesh, other).normalized().dot(normal) > 0.7;
    };
    samples += !normal.isZero();
    doubled += !normal.isZero() &&
               std::ranges::any_of(query.AllHits(TriangleCentroid(mesh, own) - kNear_mm * normal,
                                                 normal, 2 * kNear_mm),
                                   is_other_sheet);
  }
  return samples > 0 ? static_cast<double>(doubled) / samples : 0;
}

// A connected part of a mesh.
struct Piece {
  std::int64_t triangles = 0;
  double area_mm2 = 0;
  Box3 box;
};

// The pieces with at least a tenth of the triangles, by their number of triangles.
std::vector<Piece> LargePieces(const TriMesh& mesh) {
  const Components components = ConnectedComponents(mesh);
  std::vector<Piece> pieces(components.count);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    Piece& piece = pieces[components.of_triangle[t]];
    ++piece.triangles;
    piece.area_mm2 += TriangleAreaVector(mesh, mesh.triangles[t]).norm();
    for (const std::int32_t corner : mesh.triangles[t]) {
      piece.box.extend(mesh.points[corner]);
    }
  }
  std::erase_if(pieces, [&](const Piece& piece) {
    return 10 * piece.triangles < std::ssize(mesh.triangles);
  });
  std::ranges::stable_sort(pieces, {}, &Piece::triangles);
  return pieces;
}

// Notes two pieces that are the same but for a shift, as two registrations of one scan.
void NoteMovedCopies(const TriMesh& mesh, const std::string& name,
                     std::vector<std::string>& notes) {
  constexpr double kSame = 1e-4;  // relative; single precision and a shift round areas by less
  const std::vector<Piece> pieces = LargePieces(mesh);
  for (std::size_t k = 1; k < pieces.size(); ++k) {
    const Piece &a = pieces[k - 1], &b = pieces[k];
    const Vec3 shift = b.box.center() - a.box.center();
    if (a.triangles == b.triangles && std::abs(a.area_mm2 - b.area_mm2) < kSame * a.area_mm2 &&
        (a.box.sizes() - b.box.sizes()).norm() < kSame * a.box.diagonal().norm()) {
      notes.push_back(fmt::format(
          "{}: it holds two copies of one surface of {} triangles, {:.1f} mm apart; keep one of "
          "them",
          name, a.triangles, shift.norm()));
    }
  }
}

}  // namespace

void CheckHeadSize(double longest_mm, const std::string& name, const std::string& remedy) {
  if (!(longest_mm >= kSmallestHead_mm && longest_mm <= kLargestHead_mm)) {
    throw InputError(fmt::format(
        "{}: its longest side is {:.4g} mm, which is not that of a head ({} to {} mm); {}", name,
        longest_mm, kSmallestHead_mm, kLargestHead_mm, UnitGuess(longest_mm, remedy)));
  }
}

std::vector<std::string> CheckHeadMesh(const TriMesh& mesh, const std::string& name) {
  if (mesh.triangles.empty()) {
    throw InputError(fmt::format("{}: the mesh has no triangles", name));
  }
  CheckHeadSize(Bounds(mesh).sizes().maxCoeff(), name,
                "multiply by {}, or say its unit (subject.units)");
  CheckPlace(mesh, name);
  CheckArea(mesh, name);
  const MeshQuery query(mesh);
  const double outward = OutwardShare(mesh, query);
  if (outward < 0.5) {
    throw InputError(
        fmt::format("{}: {:.0f} % of its outside shows triangles' backs: the mesh is inside out; "
                    "flip its normals",
                    name, 100 * (1 - outward)));
  }
  const EdgeReport edges = CheckEdges(mesh);
  std::vector<std::string> notes;
  const auto note = [&](std::int64_t count, const char* what) {
    if (count > 0) {
      notes.push_back(fmt::format("{}: {} of {} edges {}", name, count, edges.edges, what));
    }
  };
  constexpr double kMostDoubled = 0.3;
  if (const double doubled = DoubledShare(mesh, query); doubled > kMostDoubled) {
    notes.push_back(fmt::format(
        "{}: {:.0f} % of its surface has a second sheet within 0.25 mm that faces the same way, as "
        "if it held two versions of one surface; keep one of them, or a face may lie too far out",
        name, 100 * doubled));
  }
  NoteMovedCopies(mesh, name, notes);
  note(edges.boundary, "are open borders");
  note(edges.non_manifold, "are non-manifold");
  note(edges.inconsistent, "join triangles of opposite orientation");
  return notes;
}

}  // namespace semblance::surfaces
