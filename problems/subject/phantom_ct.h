// SPDX-License-Identifier: GPL-3.0-or-later
// A CT scan of a phantom, to test the whole chain that begins with a scanner's files.
#pragma once

#include <string>

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

// Air has -1000 HU, tissue and brain 40, bone 1000, plastic 100. A voxel has the mean over its
// volume (exact along x, over 3 x 3 lines across it). The volume is in the phantom's frame. The
// mesh must be closed. Throws InputError for a spacing that is not positive, and for a defect at a
// site that the phantom lacks.
CtVolume VoxelisePhantom(const Phantom& phantom, const PhantomCtOptions& options);

// The ball of a defect of a phantom's bone.
class LostBone {
 public:
  // Throws InputError for a site that the phantom lacks.
  LostBone(const Phantom& phantom, const BoneDefect& defect);
  bool Holds(const Vec3& point) const { return (point - centre_).norm() < radius_mm_; }

 private:
  Vec3 centre_ = Vec3::Zero();
  double radius_mm_ = -1;  // an empty ball
};

}  // namespace semblance::problems
