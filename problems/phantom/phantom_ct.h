// SPDX-License-Identifier: GPL-3.0-or-later
// A phantom as a CT scan of it would show it, to try the whole way from the scanner's files.
#pragma once

#include <string>

#include "problems/subject/phantom.h"
#include "problems/volumes/ct_volume.h"

namespace semblance {

// Bone that is lost: a ball about the place of a site.
struct BoneDefect {
  std::string site;  // empty: none
  double radius_mm = 22;
};

struct PhantomCtOptions {
  double pixel_mm = 1;      // between columns and rows
  double slice_mm = 1.5;    // between slices
  double margin_mm = 12;    // of air about the head
  double bone_mm = 7;       // about how thick the skull is
  bool head_holder = true;  // a sheet of plastic behind the head
  BoneDefect defect = {};
  int threads = 1;
};

// Air -1000, tissue and brain 40, bone 1000, plastic 100 HU; each voxel the mean of what is in it
// (exact along x, of 3 x 3 lines across). In the phantom's frame; the mesh must be closed. Throws
// InputError for spacings that are not positive, and a defect at a site that the phantom lacks.
CtVolume VoxelisePhantom(const Phantom& phantom, const PhantomCtOptions& options);

// Where a phantom's bone is lost: the ball of a defect, its site looked up once.
class LostBone {
 public:
  // Throws InputError for a site that the phantom lacks.
  LostBone(const Phantom& phantom, const BoneDefect& defect);
  bool Holds(const Vec3& point) const { return (point - centre_).norm() < radius_mm_; }

 private:
  Vec3 centre_ = Vec3::Zero();
  double radius_mm_ = -1;  // holds nothing
};

}  // namespace semblance
