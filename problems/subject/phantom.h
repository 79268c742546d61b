// SPDX-License-Identifier: GPL-3.0-or-later
// A made-up head whose skull, skin and tissue depths are all known exactly, to measure how well a
// face is recovered where nothing is left to doubt but the method.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "surfaces/base/fields.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

enum class PhantomBone {
  kSmooth,     // as the skin
  kLikePeople  // hollows, ridges and roughness under the smooth one's skin
};
constexpr auto EnumNames(PhantomBone) {
  return std::to_array<std::string_view>({"smooth", "like_people"});
}

struct PhantomOptions {
  static constexpr std::string_view kName = "phantom";
  std::uint64_t random_seed = 1;  // which head
  int rings = 100;                // of triangles from crown to throat; about 3 rings^2 triangles
  PhantomBone bone = PhantomBone::kSmooth;  // like_people: under the same skin
};
template <class Visitor>
void Fields(Visitor& visit, PhantomOptions& o) {
  visit(FieldInfo{.name = "random_seed",
                  .doc = "which head: sizes, features, asymmetry and tissue depths follow from it"},
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
              "smooth: depths vary little along it; like_people: hollows, ridges and a rough field "
              "under the same smooth skin, so that they vary as people's do"},
      o.bone);
}

struct PhantomSite {
  std::string site;                    // landmark code with side, e.g. "g", "go_l", "go_r"
  Vec3 base = Vec3::Constant(kNaN);    // on the exact skull, mm
  Vec3 normal = Vec3::Constant(kNaN);  // of it, unit, outward; like_people: of 3 mm around
  double depth_mm = kNaN;              // of the tissue along the normal, > 0
};

struct Phantom {
  TriMesh skull;                       // closed, outward; LPS, nasion at the origin
  std::vector<double> depth_mm;        // of the tissue along the bone's normal (smooth: the exact
                                       // one; like_people: the mesh's), one per skull vertex, > 0
  TriMesh face;                        // what lies over the smooth bone; the skull's triangles
  std::vector<PhantomSite> sites;      // all 32: midline from the forehead down, then pairs
  Vec3 centre = Vec3::Constant(kNaN);  // every ray from here meets the skull once
  double thickness = kNaN;             // by which all its depths exceed those of an average adult
};

// Of the rings: empty, or what is wrong and what to do. There are 8 to 1000 (16 at least in a
// configuration, whose runs need them), and at least 30 where the bone is rough: the mesh of fewer
// would miss the sites by more than 3 mm.
std::string RingsFault(const PhantomOptions& options);

// The same options give the same bytes. Throws InputError for a fault of the rings.
Phantom MakePhantom(const PhantomOptions& options);

}  // namespace semblance
