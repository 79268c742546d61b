// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/propose/reference_head.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <set>
#include <utility>

#include "problems/subject/landmark_files/read_landmarks.h"
#include "problems/subject/landmark_mistakes.h"
#include "problems/subject/phantom.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"
#include "surfaces/mesh/join_copies.h"
#include "surfaces/mesh/mesh_check.h"
#include "surfaces/mesh/mesh_query.h"
#include "surfaces/mesh/tri_mesh.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance::problems {
namespace {

// A connected part of a mesh.
struct BonePiece {
  double area_mm2 = 0;
  Box3 box;
};

std::vector<BonePiece> MeasureBodies(const TriMesh& mesh, const Components& components) {
  std::vector<BonePiece> bodies(components.count);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    BonePiece& body = bodies[components.of_triangle[t]];
    body.area_mm2 += TriangleAreaVector(mesh, mesh.triangles[t]).norm();
    body.box.extend(TriangleCentroid(mesh, mesh.triangles[t]));
  }
  return bodies;
}

// Refuses a mesh with two skulls. A mandible is no second skull: it is about 0.7 times as long as
// its cranium and has a quarter of its area, hence the limits 0.8 and 0.5.
void CheckOneSkull(std::vector<BonePiece> bodies, const std::string& name) {
  std::ranges::sort(bodies, std::greater<>(), &BonePiece::area_mm2);
  if (bodies.size() < 2) {
    return;
  }
  const double area = bodies[1].area_mm2 / bodies[0].area_mm2;
  const double length = bodies[1].box.diagonal().norm() / bodies[0].box.diagonal().norm();
  if (area > 0.5 && length > 0.8) {
    throw InputError(fmt::format(
        "{}: it has two bodies as large as a skull ({:.0f} and {:.0f} cm^2 outside); leave only "
        "one skull in the file",
        name, bodies[0].area_mm2 / 100, bodies[1].area_mm2 / 100));
  }
}

TriMesh WithoutSpecks(const TriMesh& mesh, const std::string& name) {
  constexpr double kMinArea_mm2 = 300;
  const Components components = ConnectedComponents(mesh);
  const std::vector<BonePiece> bodies = MeasureBodies(mesh, components);
  CheckOneSkull(bodies, name);
  std::vector<bool> keep(mesh.triangles.size());
  for (std::size_t t = 0; t < keep.size(); ++t) {
    keep[t] = bodies[components.of_triangle[t]].area_mm2 >= kMinArea_mm2;
  }
  return Submesh(mesh, keep);
}

// The part that is visible from outside. Visibility is computed on a coarser mesh, which takes a
// quarter of the time; triangles near its visible part that face alike are kept.
TriMesh OuterPart(const TriMesh& mesh, int threads) {
  constexpr double kCell_mm = 4;
  constexpr CorrespondenceOptions kSameBone = {.reach_mm = 4, .least_cosine = 0.3};
  const TriMesh coarse = ClusterVertices(mesh, kCell_mm);
  const std::vector<bool> seen = SeenFromOutside(coarse, threads);
  if (std::ranges::find(seen, true) == seen.end()) {
    return {};
  }
  const Correspondences outer(Submesh(coarse, seen));
  std::vector<std::uint8_t> keep(mesh.triangles.size());  // bytes, so that threads can write them
  ParallelFor(keep.size(), threads, 256, [&](std::size_t t) {
    const Vec3 normal = TriangleAreaVector(mesh, mesh.triangles[t]).normalized();
    const Vec3 centroid = TriangleCentroid(mesh, mesh.triangles[t]);
    keep[t] = outer.Find(centroid, normal, kSameBone) ? 1 : 0;
  });
  return Submesh(mesh, {keep.begin(), keep.end()});
}

namespace fs = std::filesystem;

// ReferenceHead::site_error_mm of a person's landmarks and of a phantom, which is only roughly a
// skull.
constexpr double kPersonError_mm = 4, kPhantomError_mm = 7;

void CheckReference(const fs::path& path, const LandmarkFile& file, const TriMesh& skull) {
  constexpr std::size_t kMinLandmarks = 6;
  if (file.landmarks.size() < kMinLandmarks) {
    throw InputError(fmt::format("{}: a reference needs at least {} landmarks, and has {}",
                                 path.string(), kMinLandmarks, file.landmarks.size()));
  }
  const InputMistakes found = FindLandmarkMistakes(file, skull, MeshQuery(skull), PlaceOptions{});
  if (!found.errors.empty()) {
    throw InputError(fmt::format("reference {}: {}", path.string(), fmt::join(found.errors, "\n")));
  }
}

}  // namespace

SkullShell AsShell(TriMesh mesh) {
  Correspondences surface(mesh);
  return {.mesh = std::move(mesh), .surface = std::move(surface)};
}

SkullShell MakeShell(const TriMesh& skull, const std::string& name, int threads) {
  constexpr double kCell_mm = 2;
  TriMesh outer = WithoutSpecks(OuterPart(ClusterVertices(skull, kCell_mm), threads), name);
  if (outer.triangles.empty()) {
    throw InputError(
        fmt::format("{}: no body of it has 3 cm^2 that are visible from outside, so there is no "
                    "skull; check the "
                    "file",
                    name));
  }
  return AsShell(std::move(outer));
}

std::vector<ShellPoint> SpreadPoints(const SkullShell& shell, double cell_mm) {
  std::set<std::array<long, 3>> taken;
  std::vector<ShellPoint> points;
  for (std::size_t t = 0; t < shell.mesh.triangles.size(); ++t) {
    const Vec3 p = TriangleCentroid(shell.mesh, shell.mesh.triangles[t]);
    const auto cell = [&](int i) { return std::lround(p[i] / cell_mm); };
    if (taken.insert({cell(0), cell(1), cell(2)}).second) {
      const MeshPoint centroid{.position = p,
                               .triangle = static_cast<int>(t),
                               .distance_mm = 0,
                               .weights = Vec3::Constant(1.0 / 3)};
      points.push_back({p, shell.surface.NormalAt(centroid)});
    }
  }
  return points;
}

ReferenceHead MakeReference(const std::string& name, const TriMesh& skull,
                            std::span<const SitePoint> sites, int threads) {
  const Similarity pose = FitAverageSkull(sites).skull_from_average;
  const Mat3 back = pose.rotation.transpose();
  const Similarity turn = {.scale = 1, .rotation = back, .translation = -(back * pose.translation)};
  ReferenceHead head{.name = name,
                     .shell = MakeShell(Transformed(skull, turn), name, threads),
                     .sites = {sites.begin(), sites.end()},
                     .site_error_mm = kPersonError_mm};
  for (SitePoint& s : head.sites) {
    s.point = turn * s.point;
  }
  return head;
}

ReferenceHead ReadReference(const fs::path& skull, const fs::path& landmarks, int threads) {
  std::vector<std::string> ignored;  // a turn from RAS, which does not change the reference
  TriMesh mesh = ReadMeshInLps(skull, ignored);
  JoinCopies(mesh, skull.string());
  CheckHeadMesh(mesh, skull.string());
  const LandmarkFile file = ReadLandmarks(landmarks).file;
  CheckReference(landmarks, file, mesh);
  return MakeReference(skull.string(), mesh, file.Points(), threads);
}

ReferenceHead PhantomReference(std::uint64_t random_seed) {
  constexpr int kRings = 80;
  Phantom phantom = MakePhantom({.random_seed = random_seed, .rings = kRings});
  std::vector<SitePoint> sites;
  for (const PhantomSite& s : phantom.sites) {
    sites.push_back({s.site, s.base});
  }
  return {.name = fmt::format("phantom {}", random_seed),
          .shell = AsShell(std::move(phantom.skull)),
          .sites = std::move(sites),
          .site_error_mm = kPhantomError_mm};
}

ReferenceHead Mirrored(const ReferenceHead& head) {
  TriMesh mesh = head.shell.mesh;
  for (Vec3& p : mesh.points) {
    p.x() = -p.x();
  }
  for (Triangle& t : mesh.triangles) {
    std::swap(t[1], t[2]);
  }
  std::vector<SitePoint> sites;
  for (const SitePoint& s : head.sites) {
    const auto site = std::ranges::find(StandardSites(), s.site, &Site::code);
    sites.push_back({site->mirror, {-s.point.x(), s.point.y(), s.point.z()}});
  }
  return {.name = head.name + ", mirrored",
          .shell = AsShell(std::move(mesh)),
          .sites = std::move(sites),
          .site_error_mm = head.site_error_mm,
          .error_of_site_mm = head.error_of_site_mm};
}

}  // namespace semblance::problems
