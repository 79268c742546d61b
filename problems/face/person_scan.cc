// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/person_scan.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "surfaces/mesh/correspondences.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

// The distance below a surface, > 0 inside, and whether the surface lies above or below at all.
class DepthBelow {
 public:
  explicit DepthBelow(const TriMesh& mesh) : surface_(mesh) {}

  struct Place {
    double depth_mm = kNaN;
    double distance_mm = kNaN;
    bool is_beside = false;  // the closest point lies on a border, not above or below
  };
  Place At(const Vec3& p) const {
    constexpr double kLeastCosine = 0.5;
    const MeshPoint at = surface_.query().Closest(p);
    const double along = (at.position - p).dot(surface_.NormalAt(at));
    return {std::copysign(at.distance_mm, along), at.distance_mm,
            std::abs(along) < kLeastCosine * at.distance_mm};
  }

 private:
  Correspondences surface_;
};

// The share of bone in the voxels of a row.
class BoneLayers {
 public:
  BoneLayers(const PersonPhantom& person, const PhantomCtOptions& options)
      : skull_(person.skull),
        skin_(person.skin),
        nasion_(person.nasion),
        bone_mm_(options.bone_mm),
        voxel_mm_(std::cbrt(options.pixel_mm * options.pixel_mm * options.slice_mm)) {}

  // A distance changes by no more than the way, so voxels that cannot be in a layer are passed
  // over.
  std::vector<double> Row(const CtVolume& volume, int row, int slice) const {
    std::vector<double> share(volume.columns, 0);
    const bool may_be_vault = IsVault(volume.World(0, row, slice));  // the same along x
    for (int i = 0; i < volume.columns; ++i) {
      const Vec3 p = volume.World(i, row, slice);
      const DepthBelow::Place place = skull_.At(p);
      double away_mm = place.distance_mm - bone_mm_ - voxel_mm_;
      share[i] = place.is_beside ? 0 : InLayer(place.depth_mm, 0);
      if (may_be_vault) {
        const double depth_mm = skin_.At(p).depth_mm;
        share[i] = std::max(share[i], InLayer(depth_mm, kPersonScalp_mm));
        away_mm = std::min(
            away_mm, std::max(kPersonScalp_mm - depth_mm, depth_mm - kPersonScalp_mm - bone_mm_) -
                         voxel_mm_);
      }
      i += std::max(0, static_cast<int>(away_mm / volume.spacing_mm.x()));
    }
    return share;
  }

 private:
  // The share of the voxel that lies in the layer between from_mm and from_mm + bone_mm_.
  double InLayer(double depth_mm, double from_mm) const {
    const double above = (depth_mm - from_mm) / voxel_mm_;
    const double below = (from_mm + bone_mm_ - depth_mm) / voxel_mm_;
    return std::clamp(0.5 + std::min(above, below), 0.0, 1.0);
  }
  // The mean skull may end above the forehead, and behind the ears down to the height of the
  // occipital bone.
  bool IsVault(const Vec3& p) const {
    const Vec3 from_nasion = p - nasion_;
    return from_nasion.z() > 58 || (from_nasion.y() > 115 && from_nasion.z() > -25);
  }

  DepthBelow skull_, skin_;
  Vec3 nasion_;
  double bone_mm_, voxel_mm_;
};

}  // namespace

CtVolume VoxelisePerson(const PersonPhantom& person, const PhantomCtOptions& options) {
  const BoneLayers bone(person, options);
  ScannedHead head{.tissue = {&person.skin, &person.closing},
                   .bone = [&](const CtVolume& volume, int row,
                               int slice) { return bone.Row(volume, row, slice); },
                   .sites = person.sites};
  for (const TriMesh& eye : person.eyes) {
    head.tissue.push_back(&eye);
  }
  return VoxeliseHead(head, options);
}

}  // namespace semblance::problems
