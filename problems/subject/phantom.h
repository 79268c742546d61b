// SPDX-License-Identifier: GPL-3.0-or-later
// A phantom: a made-up head whose skull, skin and tissue depths are known exactly. With it, the
// error of a recovered face is the error of the method alone.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "problems/subject/landmarks.h"
#include "surfaces/base/fields.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

enum class PhantomBone { kSmooth, kLikePeople };
constexpr auto EnumNames(PhantomBone) {
  return std::to_array<std::string_view>({"smooth", "like_people"});
}

struct PhantomOptions {
  static constexpr std::string_view kName = "phantom";
  std::uint64_t random_seed = 1;
  int rings = 100;
  PhantomBone bone = PhantomBone::kSmooth;
};
template <class Visitor>
void Fields(Visitor& visit, PhantomOptions& o) {
  visit(
      FieldInfo{
          .name = "random_seed",
          .doc = "selects the head: sizes, features, asymmetry and tissue depths follow from it"},
      o.random_seed);
  visit(
      FieldInfo{
          .name = "rings",
          .min = 16,
          .max = 1000,
          .doc = "bands of triangles from crown to throat; the mesh has about 3 rings^2 triangles"},
      o.rings);
  visit(
      FieldInfo{
          .name = "bone",
          .doc =
              "smooth: depths vary little along the bone; like_people: hollows, ridges and a rough "
              "field under the same smooth skin, so that depths vary as people's do"},
      o.bone);
}

struct PhantomSite {
  std::string site;                    // landmark code with side, e.g. "g", "go_l", "go_r"
  Vec3 base = Vec3::Constant(kNaN);    // on the exact skull, mm
  Vec3 normal = Vec3::Constant(kNaN);  // unit, outward; like_people: mean over 3 mm around
  double depth_mm = kNaN;              // tissue depth along the normal, > 0
};

struct Phantom {
  TriMesh skull;                   // closed, outward; LPS, nasion at the origin
  std::vector<double> depth_mm;    // tissue depth along the bone's normal, one per skull vertex,
                                   // > 0; smooth: exact normal, like_people: the mesh's normal
  TriMesh face;                    // the skin; same triangles as the skull
  std::vector<PhantomSite> sites;  // all 32: midline from the forehead down, then pairs
  Vec3 centre = Vec3::Constant(kNaN);  // every ray from here meets the skull once
  double thickness = kNaN;             // factor of all depths relative to an average adult
};

// The fault of options.rings and its remedy; empty if there is none. Allowed are 8 to 1000 rings
// (at least 16 in a configuration, because runs need them). Rough bone needs at least 30, because a
// coarser mesh would miss the sites by more than 3 mm.
std::string RingsFault(const PhantomOptions& options);

// The same options give the same bytes. Throws InputError for a RingsFault.
Phantom MakePhantom(const PhantomOptions& options);

// The landmarks that people would place on a phantom's skull: all sites, with their exact normals
// and the depths along them. `random_seed` only serves to name the subject.
LandmarkFile PhantomLandmarks(std::span<const PhantomSite> sites, std::uint64_t random_seed);

}  // namespace semblance::problems
