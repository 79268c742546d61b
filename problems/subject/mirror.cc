// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/mirror.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

// Two points that mirror each other. A site in the midline is its own twin.
struct Twins {
  Vec3 left, right;
  Vec3 Sum() const { return left + right; }
  Vec3 Between() const { return left - right; }
};

std::vector<Twins> FindTwins(std::span<const SitePoint> sites) {
  std::vector<Twins> twins;
  for (const Site& site : StandardSites()) {
    const auto one = std::ranges::find(sites, site.code, &SitePoint::site);
    const auto other = std::ranges::find(sites, site.mirror, &SitePoint::site);
    if (site.side != Side::kRight && one != sites.end() && other != sites.end()) {
      twins.push_back({one->point, other->point});
    }
  }
  return twins;
}

std::vector<std::vector<int>> TrianglesAtPoints(const TriMesh& mesh) {
  std::vector<std::vector<int>> at(mesh.points.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const auto p : mesh.triangles[t]) {
      at[p].push_back(static_cast<int>(t));
    }
  }
  return at;
}

// Finds the triangles of a skull that the other side lacks.
class MissingBoneSearch {
 public:
  MissingBoneSearch(const TriMesh& skull, const MidPlane& plane, const MirrorOptions& options,
                    int threads)
      : skull_(skull), options_(options), to_bone_mm_(skull.triangles.size()) {
    const MeshQuery query(skull);
    ParallelFor(to_bone_mm_.size(), threads, 256, [&](std::size_t t) {
      to_bone_mm_[t] =
          query.Closest(plane.Mirrored(TriangleCentroid(skull, skull.triangles[t]))).distance_mm;
    });
  }

  std::vector<bool> Run() const {
    std::vector<bool> missing = WithSeam(Core());
    DropSmall(missing);
    return missing;
  }

 private:
  Vec3 Middle(int t) const { return TriangleCentroid(skull_, skull_.triangles[t]); }

  std::vector<int> Core() const {
    std::vector<int> core;
    for (std::size_t t = 0; t < to_bone_mm_.size(); ++t) {
      if (to_bone_mm_[t] > options_.counterpart_mm) {
        core.push_back(static_cast<int>(t));
      }
    }
    return core;
  }

  // Grows the core from neighbour to neighbour, until mirrored bone is near the skull or the core
  // is far.
  std::vector<bool> WithSeam(std::vector<int> reached) const {
    constexpr double kTouching_mm = 2;  // the growth stops this near to bone
    const std::vector<std::vector<int>> at_point = TrianglesAtPoints(skull_);
    std::vector<bool> missing(skull_.triangles.size());
    std::vector<int> from = reached;  // the triangle of the core that each was reached from
    for (const int t : reached) {
      missing[t] = true;
    }
    for (std::size_t next = 0; next < reached.size(); ++next) {
      const int core = from[next];
      for (const auto p : skull_.triangles[reached[next]]) {
        for (const int t : at_point[p]) {
          if (!missing[t] && to_bone_mm_[t] > kTouching_mm &&
              (Middle(t) - Middle(core)).norm() <= options_.counterpart_mm) {
            missing[t] = true;
            reached.push_back(t);
            from.push_back(core);
          }
        }
      }
    }
    return missing;
  }

  void DropSmall(std::vector<bool>& missing) const {
    const TriMesh pieces = Submesh(skull_, missing);
    const Components components = ConnectedComponents(pieces);
    std::vector<double> area_cm2(components.count);
    for (std::size_t t = 0; t < pieces.triangles.size(); ++t) {
      area_cm2[components.of_triangle[t]] +=
          TriangleAreaVector(pieces, pieces.triangles[t]).norm() / 100;
    }
    std::size_t k = 0;
    for (std::size_t t = 0; t < missing.size(); ++t) {
      if (missing[t]) {
        missing[t] = area_cm2[components.of_triangle[k++]] >= options_.least_cm2;
      }
    }
  }

  const TriMesh& skull_;
  const MirrorOptions& options_;
  std::vector<double> to_bone_mm_;  // distance of each triangle's mirrored centroid from bone
};

void AddMirrored(const TriMesh& part, const MidPlane& plane, MirroredSkull& skull) {
  const auto first = static_cast<std::int32_t>(skull.mesh.points.size());
  for (const Vec3& p : part.points) {
    skull.mesh.points.push_back(plane.Mirrored(p));
  }
  for (const Triangle& t : part.triangles) {
    const bool from_left = plane.normal.dot(TriangleCentroid(part, t)) > plane.offset_mm;
    (from_left ? skull.to_right_cm2 : skull.to_left_cm2) +=
        TriangleAreaVector(part, t).norm() / 100;
    skull.mesh.triangles.push_back({first + t[0], first + t[2], first + t[1]});
    skull.origin.push_back(BoneOrigin::kMirrored);
  }
}

// Mirrors the landmark of the other side to the site, if it falls on mirrored bone.
std::optional<Landmark> MirroredLandmark(const Site& site, const LandmarkFile& file,
                                         const MidPlane& plane, const MirroredSkull& skull,
                                         const MeshQuery& query) {
  constexpr double kOnBone_mm = 3;  // the default of PlaceOptions::max_distance_mm
  const Landmark* const other = file.Find(site.mirror);
  if (file.Find(site.code) != nullptr || other == nullptr) {
    return std::nullopt;
  }
  const MeshPoint at = query.Closest(plane.Mirrored(other->Position()));
  if (at.distance_mm > kOnBone_mm || skull.origin[at.triangle] != BoneOrigin::kMirrored) {
    return std::nullopt;
  }
  Landmark landmark;
  landmark.site = site.code;
  landmark.MoveTo(at.position);
  landmark.certainty = Certainty::kLow;
  landmark.note = fmt::format("mirrored from {}", site.mirror);
  return landmark;
}

std::vector<std::string> MirrorLandmarks(const MidPlane& plane, const MirroredSkull& skull,
                                         LandmarkFile& file) {
  const MeshQuery query(skull.mesh);
  std::vector<Landmark> found;
  for (const Site& site : StandardSites()) {
    if (auto landmark = MirroredLandmark(site, file, plane, skull, query)) {
      found.push_back(std::move(*landmark));
    }
  }
  std::vector<std::string> sites;
  for (Landmark& landmark : found) {
    sites.push_back(landmark.site);
    std::erase_if(file.absent,
                  [&](const AbsentLandmark& absent) { return absent.site == landmark.site; });
    file.landmarks.push_back(std::move(landmark));
  }
  return sites;
}

void NoteMirrored(double cm2, const char* lacking, const char* giving,
                  std::vector<std::string>& notes) {
  if (cm2 > 0) {
    notes.push_back(fmt::format(
        "{:.1f} cm² of bone that the {} side lacks are mirrored from the {} side: invented, not "
        "observed",
        cm2, lacking, giving));
  }
}

}  // namespace

std::vector<BoneOrigin> OriginOfShell(const TriMesh& shell, const TriMesh& skull,
                                      std::span<const BoneOrigin> of_skull, int threads) {
  constexpr double kAtBone_mm = 2;  // farther from the skull, the shell bridges a gap
  const MeshQuery query(skull);
  std::vector<BoneOrigin> origin(shell.triangles.size());
  ParallelFor(origin.size(), threads, 256, [&](std::size_t t) {
    const MeshPoint bone = query.Closest(TriangleCentroid(shell, shell.triangles[t]));
    const BoneOrigin of_bone = of_skull.empty() ? BoneOrigin::kObserved
                                                : of_skull[static_cast<std::size_t>(bone.triangle)];
    origin[t] = bone.distance_mm > kAtBone_mm ? BoneOrigin::kInferred : of_bone;
  });
  return origin;
}

std::vector<BoneOrigin> OriginUnder(const TriMesh& face, const TriMesh& shell,
                                    std::span<const BoneOrigin> of_shell, int threads) {
  const MeshQuery query(shell);
  std::vector<BoneOrigin> origin(face.points.size());
  ParallelFor(origin.size(), threads, 256, [&](std::size_t v) {
    origin[v] = of_shell[static_cast<std::size_t>(query.Closest(face.points[v]).triangle)];
  });
  return origin;
}

std::array<double, 3> AreaByOrigin_cm2(const TriMesh& mesh, std::span<const BoneOrigin> origin) {
  std::array<double, 3> area_cm2{};
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    area_cm2[static_cast<std::size_t>(origin[t])] +=
        TriangleAreaVector(mesh, mesh.triangles[t]).norm() / 100;
  }
  return area_cm2;
}

// With s = left + right and d = left - right of each pair, normal n and offset c, the sum of
// squares is the sum of |d|^2 - (n.d)^2 + (n.s - 2 c)^2. It is least if c is half the mean of n.s
// and n is the eigenvector of the least eigenvalue of sum (s - mean)(s - mean)' - d d'.
MidPlane FitMidPlane(std::span<const SitePoint> sites) {
  const std::vector<Twins> twins = FindTwins(sites);
  MidPlane plane;
  Vec3 mean = Vec3::Zero(), to_left = Vec3::Zero();
  for (const Twins& t : twins) {
    mean += t.Sum() / static_cast<double>(twins.size());
    to_left += t.Between();
    ++(t.Between().isZero(0) ? plane.midline : plane.pairs);
  }
  Mat3 sums = Mat3::Zero();
  for (const Twins& t : twins) {
    sums += (t.Sum() - mean) * (t.Sum() - mean).transpose() - t.Between() * t.Between().transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(sums);
  // Two eigenvalues closer than (10 mm)^2 leave the direction of the normal undecided.
  constexpr double kMinEigenvalueGap_mm2 = 100;
  if (plane.pairs == 0 ||
      !(eigen.eigenvalues()[1] - eigen.eigenvalues()[0] > kMinEigenvalueGap_mm2)) {
    throw InputError(fmt::format(
        "mirror: {} pairs of sites and {} in the midline do not determine the mid-sagittal plane; "
        "place a pair and some in the midline, apart from each other",
        plane.pairs, plane.midline));
  }
  plane.normal = eigen.eigenvectors().col(0);
  plane.normal *= plane.normal.dot(to_left) < 0 ? -1 : 1;
  plane.offset_mm = plane.normal.dot(mean) / 2;
  double sum = 0;
  for (const Twins& t : twins) {
    sum += (plane.Mirrored(t.left) - t.right).squaredNorm();
  }
  plane.rms_mm = std::sqrt(sum / static_cast<double>(twins.size()));
  return plane;
}

MirroredSkull MirrorMissing(const TriMesh& skull, const MidPlane& plane,
                            const MirrorOptions& options, int threads) {
  MirroredSkull result{.mesh = skull, .origin = {}};
  result.origin.assign(skull.triangles.size(), BoneOrigin::kObserved);
  const TriMesh missing = Submesh(skull, MissingBoneSearch(skull, plane, options, threads).Run());
  const double part = Area(missing) / Area(skull);
  if (part > 0.5) {
    throw InputError(fmt::format(
        "mirror: {:.0f} % of the skull has no counterpart within {} mm on the other side: the "
        "plane through its landmarks does not mirror it; correct the landmarks, or raise "
        "counterpart_mm",
        100 * part, options.counterpart_mm));
  }
  AddMirrored(missing, plane, result);
  return result;
}

std::vector<std::string> PrepareMirrored(const MirrorOptions& options, TriMesh& skull,
                                         std::vector<BoneOrigin>& origin, LandmarkFile& landmarks,
                                         int threads) {
  if (!options.missing) {
    return {};
  }
  const MidPlane plane = FitMidPlane(landmarks.Points());
  MirroredSkull mirrored = MirrorMissing(skull, plane, options, threads);
  const std::vector<std::string> added = MirrorLandmarks(plane, mirrored, landmarks);
  std::vector<std::string> notes = {fmt::format(
      "mirrored through the plane of {} pairs and {} sites in the midline, which mirrors them "
      "within {:.1f} mm (RMS)",
      plane.pairs, plane.midline, plane.rms_mm)};
  NoteMirrored(mirrored.to_left_cm2, "left", "right", notes);
  NoteMirrored(mirrored.to_right_cm2, "right", "left", notes);
  if (mirrored.to_left_cm2 + mirrored.to_right_cm2 == 0) {
    notes.push_back(
        fmt::format("mirror: neither side lacks bone of {} cm² or more, so none is mirrored",
                    options.least_cm2));
  }
  if (!added.empty()) {
    notes.push_back(
        fmt::format("the points of sites {} are mirrored with it, their measured depths are not",
                    fmt::join(added, ", ")));
  }
  skull = std::move(mirrored.mesh);
  origin = std::move(mirrored.origin);
  return notes;
}

}  // namespace semblance::problems
