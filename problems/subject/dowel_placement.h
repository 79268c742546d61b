// SPDX-License-Identifier: GPL-3.0-or-later
// Chooses the landmarks that an experiment uses and places dowels (depth markers) on them (thesis
// def. 2.1).
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "interp/dowels/dowel.h"
#include "problems/subject/landmarks.h"
#include "surfaces/base/fields.h"
#include "surfaces/mesh/mesh_query.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

struct KeepAll {
  static constexpr std::string_view kName = "all";
};
template <class Visitor>
void Fields(Visitor&, KeepAll&) {}

// Farthest points first: the landmark farthest from the mean of all, then always the landmark that
// is farthest from those already kept (Gonzalez 1985). The first 12 are among the first 16.
struct KeepSpread {
  static constexpr std::string_view kName = "spread";
  int n = 16;
};
template <class Visitor>
void Fields(Visitor& visit, KeepSpread& o) {
  visit(FieldInfo{.name = "n",
                  .min = 3,
                  .max = 1000,
                  .doc = "how many are kept, spread as widely as possible; all, if the subject has "
                         "no more"},
        o.n);
}

struct KeepNames {
  static constexpr std::string_view kName = "names";
  std::vector<std::string> sites;
};
template <class Visitor>
void Fields(Visitor& visit, KeepNames& o) {
  visit(FieldInfo{.name = "sites",
                  .doc = "codes of the sites that are kept; a code that the subject lacks is "
                         "skipped, with a note"},
        o.sites);
}
template <class Report>
void CheckValue(Report& report, const KeepNames& o) {
  if (o.sites.empty()) {
    report("sites", "the list is empty; name the sites to keep, as in [n, g, me, go_l, go_r]");
  }
}

struct KeepRandom {
  static constexpr std::string_view kName = "random";
  int n = 16;
  std::uint64_t random_seed = 1;
};
template <class Visitor>
void Fields(Visitor& visit, KeepRandom& o) {
  visit(FieldInfo{.name = "n",
                  .min = 3,
                  .max = 1000,
                  .doc = "how many are kept; all, if the subject has no more"},
        o.n);
  visit(FieldInfo{.name = "random_seed",
                  .doc = "chooses the landmarks; with one random_seed, the landmarks of a small n "
                         "are among those of a larger n"},
        o.random_seed);
}

using LandmarksKept = std::variant<KeepAll, KeepSpread, KeepNames, KeepRandom>;

// Returns for each site whether it is kept. `points` has one point per site. `names` keeps a site
// only by its full code. Ties of `spread` go to the site that comes first.
std::vector<bool> KeptSites(const LandmarksKept& kept, std::span<const std::string> sites,
                            std::span<const Vec3> points);

// The dowels of a person's skull at sites that its landmarks lack.
enum class CarriedSites { kNone, kPeople };
constexpr auto EnumNames(CarriedSites) {
  return std::to_array<std::string_view>({"none", "people"});
}

struct PlaceOptions {
  double max_distance_mm = 3;
  double normal_radius_mm = 3;
  double max_misfit_mm = 25;
  double max_opening_deg = 15;
  LandmarksKept keep = KeepAll{};
  CarriedSites carried = CarriedSites::kNone;
  double noise_mm = 0;
  std::uint64_t random_seed = 1;
};

template <class Visitor>
void Fields(Visitor& visit, PlaceOptions& o) {
  visit(FieldInfo{.name = "max_distance_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 50,
                  .doc = "a landmark farther from the skull than this is an error; a larger value "
                         "tolerates coarse skulls, and wrong frames"},
        o.max_distance_mm);
  visit(FieldInfo{.name = "normal_radius_mm",
                  .unit = "mm",
                  .min = 0.1,
                  .max = 30,
                  .doc = "a landmark without a normal gets the skull's mean normal within this "
                         "radius; a larger value smooths rough bone, and rounds rims"},
        o.normal_radius_mm);
  visit(FieldInfo{.name = "max_misfit_mm",
                  .unit = "mm",
                  .min = 5,
                  .max = 1000,
                  .doc = "a landmark farther than this from where the others and an average skull "
                         "predict it is an error; in mm of the average skull"},
        o.max_misfit_mm);
  visit(FieldInfo{.name = "max_opening_deg",
                  .unit = "deg",
                  .min = 0,
                  .max = 90,
                  .doc = "a mandible that is open by more than this is an error; estimated to some "
                         "degrees from the sites of both jaws and an average skull"},
        o.max_opening_deg);
  visit(FieldInfo{.name = "keep",
                  .doc = "which landmarks are used; the dowel network closes over the others. All "
                         "landmarks are checked for mistakes, and scores use all of them. As an "
                         "axis of a study: [all, {type: spread, n: 16}, {type: spread, n: 8}]"},
        o.keep);
  visit(FieldInfo{.name = "carried",
                  .doc = "dowels at sites of the temple that the landmarks lack (ut, tf), on a "
                         "person's skull; people: where the mean bone of the people behind "
                         "`interp: population` has them, laid on this skull, as deep as the table "
                         "states, or, where depths are measured, as interpolated with its "
                         "deviation, which changes no other depth; none: no such dowels"},
        o.carried);
  visit(FieldInfo{.name = "noise_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 20,
                  .doc = "standard deviation along each axis by which each landmark is moved at "
                         "random, as an unsure hand would; it is then laid on the nearest bone and "
                         "takes the direction there, while its depth stays that of its site"},
        o.noise_mm);
  visit(FieldInfo{.name = "random_seed", .doc = "seed of the noise"}, o.random_seed);
}

// The landmarks as an experiment uses them.
struct UsedLandmarks {
  LandmarkFile file;
  std::vector<std::string> notes;  // for people; none if all landmarks are used as they are
};

// Keeps the landmarks that options.keep chooses, moved by options.noise_mm and laid on `skull`. The
// noise of a landmark depends on its place in the file and on the seed, not on which others are
// kept. Throws InputError if fewer than three are left.
UsedLandmarks LandmarksInUse(const LandmarkFile& file, const MeshQuery& skull,
                             const PlaceOptions& options);

// Places one dowel per landmark, in the file's order; its depth is still NaN. The base is the
// skull's point nearest to the landmark. The direction is the landmark's normal, otherwise
// AveragedNormal within normal_radius_mm of the base. `query` must be that of the skull. Throws
// InputError if a landmark is too far from the skull, or if the skull has no area there.
std::vector<Dowel> PlaceDowels(const LandmarkFile& file, const TriMesh& skull,
                               const MeshQuery& query, const PlaceOptions& options);
std::vector<Dowel> PlaceDowels(const LandmarkFile& file, const TriMesh& skull,
                               const PlaceOptions& options);

// The angles, in degrees, between the normals that the file gives and AveragedNormal at the dowels'
// bases, by site: by how much a person, or another program, has turned each dowel. Sites without a
// normal, or on bone without area, are left out. Throws InputError for a normal that is more than
// kMaxTurn_deg off, because the dowel would run along the bone or into the head. Proposals that
// nobody has confirmed are kept: the nearest bone may be an inner wall, and their normal is that of
// the site.
inline constexpr double kMaxTurn_deg = 75;
std::map<std::string, double> TurnsOfDowels(const LandmarkFile& file, const TriMesh& skull,
                                            const MeshQuery& query, const PlaceOptions& options);

// The unit mean normal, weighted by area, of the mesh inside `ball`. Only triangles count that are
// connected there with the triangle `first` and face within 80 degrees of it, so that the inner
// side of a thin wall does not count (any direction counts if `first` has no area). A triangle's
// area counts as far as it lies inside the ball, to some percent. Zero if there is no such area.
// `query` must be that of the mesh.
Vec3 AveragedNormal(const TriMesh& mesh, const MeshQuery& query, int first, const Sphere& ball);

}  // namespace semblance::problems
