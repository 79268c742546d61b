// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/propose/reference_head.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "problems/landmark_files/read_landmarks.h"
#include "problems/subject/landmark_mistakes.h"
#include "problems/subject/phantom.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh/mesh_check.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;

constexpr double kPlacedByAPerson_mm = 4, kPhantom_mm = 7;

std::vector<SitePoint> SitesOf(const LandmarkFile& file) {
  std::vector<SitePoint> sites;
  for (const Landmark& l : file.landmarks) {
    sites.push_back({l.site, {l.point[0], l.point[1], l.point[2]}});
  }
  return sites;
}

void CheckReference(const fs::path& path, const LandmarkFile& file, const TriMesh& skull) {
  constexpr std::size_t kFewest = 6;
  if (file.landmarks.size() < kFewest) {
    throw InputError(fmt::format("{}: a reference needs at least {} landmarks, and has {}",
                                 path.string(), kFewest, file.landmarks.size()));
  }
  const LandmarkMistakes found =
      FindLandmarkMistakes(file, skull, MeshQuery(skull), PlaceOptions{});
  if (!found.errors.empty()) {
    throw InputError(fmt::format("reference {}: {}", path.string(), fmt::join(found.errors, "\n")));
  }
}

}  // namespace

ReferenceHead MakeReference(const std::string& name, const TriMesh& skull,
                            std::span<const SitePoint> sites, int threads) {
  const Similarity pose = FitAverageSkull(sites).skull_from_average;
  const Mat3 back = pose.rotation.transpose();
  const Similarity turn = {.scale = 1, .rotation = back, .translation = -(back * pose.translation)};
  ReferenceHead head{.name = name,
                     .shell = MakeShell(Transformed(skull, turn), name, threads),
                     .sites = {sites.begin(), sites.end()},
                     .site_error_mm = kPlacedByAPerson_mm};
  for (SitePoint& s : head.sites) {
    s.point = turn * s.point;
  }
  return head;
}

ReferenceHead ReadReference(const fs::path& skull, const fs::path& landmarks, int threads) {
  const TriMesh mesh = ReadMesh(skull);
  CheckHeadMesh(mesh, skull.string());
  const LandmarkFile file = ReadLandmarks(landmarks).file;
  CheckReference(landmarks, file, mesh);
  return MakeReference(skull.string(), mesh, SitesOf(file), threads);
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
          .site_error_mm = kPhantom_mm};
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
          .site_error_mm = head.site_error_mm};
}

}  // namespace semblance
