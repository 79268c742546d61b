// SPDX-License-Identifier: GPL-3.0-or-later
// A CT scan of a phantom, to test the whole chain that begins with a scanner's files.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "problems/io/volumes/ct_volume.h"
#include "problems/subject/phantom.h"

namespace semblance::problems {

// Lost bone: a ball around a site.
struct BoneDefect {
  std::string site;  // empty: none
  double radius_mm = 22;
};

struct PhantomCtOptions {
  double pixel_mm = 1;      // distance of columns and of rows
  double slice_mm = 1.5;    // distance of slices
  double margin_mm = 12;    // air around the head
  double bone_mm = 7;       // approximate thickness of the skull
  bool head_holder = true;  // a sheet of plastic behind the head
  BoneDefect defect = {};
  int threads = 1;
};

// The ball of a defect of a head's bone.
class LostBone {
 public:
  // Throws InputError for a site that is not among `sites`.
  LostBone(std::span<const PhantomSite> sites, const BoneDefect& defect);
  bool Holds(const Vec3& point) const { return (point - centre_).norm() < radius_mm_; }

 private:
  Vec3 centre_ = Vec3::Zero();
  double radius_mm_ = -1;  // an empty ball
};

// The parts of a head that a scanner tells apart.
struct ScannedHead {
  std::vector<const TriMesh*>
      tissue;  // closed meshes, the skin first; tissue is inside any of them
  // The share of bone in each voxel of a row, 0..1.
  std::function<std::vector<double>(const CtVolume&, int row, int slice)> bone;
  std::span<const PhantomSite> sites;  // at which options.defect may lie
};

// Air has -1000 HU, tissue and brain 40, bone 1000, plastic 100. A voxel has the mean over its
// volume (exact along x, over 3 x 3 lines across it). The volume is in the frame of the meshes.
// Throws InputError for a spacing that is not positive, and for a defect at a site that the head
// lacks.
CtVolume VoxeliseHead(const ScannedHead& head, const PhantomCtOptions& options);

// The same for a phantom by formula. Its bone is a shell of the same averaging.
CtVolume VoxelisePhantom(const Phantom& phantom, const PhantomCtOptions& options);

}  // namespace semblance::problems
