// SPDX-License-Identifier: GPL-3.0-or-later
// The landmarks placed on a skull, as a file, and the dowels that stand on them (thesis def. 2.1).
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "interp/dowels/dowel.h"
#include "problems/subject/length_unit.h"
#include "problems/thinning/kept_landmarks.h"
#include "surfaces/base/fields.h"
#include "surfaces/mesh/mesh_query.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// How sure the observer was of a landmark's position.
enum class Certainty { kHigh, kMedium, kLow };

constexpr auto EnumNames(Certainty) {
  return std::to_array<std::string_view>({"high", "medium", "low"});
}

struct Landmark {
  std::string site;                                  // e.g. "g", "go_l"
  std::array<double, 3> point = {kNaN, kNaN, kNaN};  // on the bone, mm
  std::optional<std::array<double, 3>> normal;       // unit, out of the bone
  std::optional<double> depth_along_normal_mm;       // measured on the subject, > 0
  std::optional<double> depth_closest_mm;            // from bone to the closest skin, > 0
  Certainty certainty = Certainty::kMedium;          // of the position
  std::string note;                                  // for people
};

// A site that was looked for and cannot be placed, e.g. because the bone is gone.
struct AbsentLandmark {
  std::string site;    // as Landmark's
  std::string reason;  // for people
};

struct LandmarkFile {
  std::string subject;       // whose they are, for people
  std::string units = "mm";  // of the points, as EnumNames(LengthUnit); depths are in mm
  std::string axes = "LPS";  // of points and normals, as EnumNames(Axes); "": the file does not say
  std::vector<Landmark> landmarks;     // each site once
  std::vector<AbsentLandmark> absent;  // none of the sites above
  bool proposed = false;               // by the program, and no person has confirmed it
};

struct PlaceOptions {
  double max_distance_mm = 3;   // of a landmark from the skull; more is an error
  double normal_radius_mm = 3;  // of the mean normal where a landmark has none
  double max_misfit_mm = 25;    // of a landmark from where the others predict it; more is an error
  double max_opening_deg = 15;  // of the mandible; more is an error
  LandmarksKept keep = KeepAll{};  // which of them are used
  double noise_mm = 0;             // by which each is moved at random, as an unsure hand would
  std::uint64_t random_seed = 1;   // of the noise
};

template <class Visitor>
void Fields(Visitor& visit, Landmark& o) {
  visit(
      FieldInfo{.name = "site", .doc = "code of the site, with _l or _r where it is one of a pair"},
      o.site);
  visit(FieldInfo{.name = "point", .unit = "mm", .doc = "on the bone"}, o.point);
  visit(FieldInfo{.name = "normal", .doc = "unit, out of the bone; else taken from the skull"},
        o.normal);
  visit(FieldInfo{.name = "depth_along_normal_mm",
                  .unit = "mm",
                  .min = 0.01,
                  .max = 100,
                  .doc = "measured tissue depth along the normal"},
        o.depth_along_normal_mm);
  visit(FieldInfo{.name = "depth_closest_mm",
                  .unit = "mm",
                  .min = 0.01,
                  .max = 100,
                  .doc = "measured distance to the closest skin"},
        o.depth_closest_mm);
  visit(FieldInfo{.name = "certainty", .doc = "of the position"}, o.certainty);
  visit(FieldInfo{.name = "note", .doc = "what the observer had to say"}, o.note);
}

template <class Visitor>
void Fields(Visitor& visit, AbsentLandmark& o) {
  visit(FieldInfo{.name = "site", .doc = "code of the site"}, o.site);
  visit(FieldInfo{.name = "reason", .doc = "why it cannot be placed"}, o.reason);
}

template <class Visitor>
void Fields(Visitor& visit, LandmarkFile& o) {
  visit(FieldInfo{.name = "subject", .doc = "whose skull it is; for messages"}, o.subject);
  visit(FieldInfo{.name = "units", .doc = "of the points; depths are in mm whatever it is"},
        o.units);
  visit(FieldInfo{.name = "axes",
                  .doc = "of points and normals; LPS: +x subject left, +y posterior, +z up; RAS: x "
                         "and y the other way"},
        o.axes);
  visit(FieldInfo{.name = "landmarks", .doc = "those that were placed"}, o.landmarks);
  visit(FieldInfo{.name = "absent", .doc = "those that cannot be placed, with the reason"},
        o.absent);
  visit(FieldInfo{.name = "proposed",
                  .doc = "the program proposed the points and no person has confirmed them; set it "
                         "to false once each was looked at"},
        o.proposed);
}

template <class Visitor>
void Fields(Visitor& visit, PlaceOptions& o) {
  visit(FieldInfo{.name = "max_distance_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 50,
                  .doc = "a landmark further from the skull than this is an error; more forgives "
                         "coarse skulls, and wrong frames"},
        o.max_distance_mm);
  visit(FieldInfo{.name = "normal_radius_mm",
                  .unit = "mm",
                  .min = 0.1,
                  .max = 30,
                  .doc = "where a landmark has no normal, the skull's mean normal within this "
                         "radius; more smooths rough bone, and rounds rims"},
        o.normal_radius_mm);
  visit(FieldInfo{.name = "max_misfit_mm",
                  .unit = "mm",
                  .min = 5,
                  .max = 1000,
                  .doc = "a landmark further than this from where the others and an average skull "
                         "predict it is an error; in mm of the average skull"},
        o.max_misfit_mm);
  visit(FieldInfo{.name = "max_opening_deg",
                  .unit = "deg",
                  .min = 0,
                  .max = 90,
                  .doc = "a mandible that is open further than this is an error; from the sites of "
                         "both jaws and an average skull, to some degrees"},
        o.max_opening_deg);
  visit(FieldInfo{.name = "keep",
                  .doc = "which landmarks are used; the dowel network closes over the others. All "
                         "are looked at for mistakes, and what is scored rests on all. As an axis "
                         "of a study: [all, {type: spread, n: 16}, {type: spread, n: 8}]"},
        o.keep);
  visit(FieldInfo{.name = "noise_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 20,
                  .doc = "standard deviation along each axis by which each landmark is moved at "
                         "random; it is then laid on the nearest bone and takes the direction "
                         "there, while its depth stays that of its site"},
        o.noise_mm);
  visit(FieldInfo{.name = "random_seed", .doc = "of the noise"}, o.random_seed);
}

// The landmarks as an experiment uses them, and what a reader should know of that.
struct UsedLandmarks {
  LandmarkFile file;
  std::vector<std::string> notes;  // none where all are used as they are
};

// Those that options.keep says, moved by options.noise_mm. A landmark's noise depends on its place
// in the file and on the seed, not on which others are kept. skull: on which they are laid.
// Throws InputError if fewer than three are left.
UsedLandmarks LandmarksInUse(const LandmarkFile& file, const MeshQuery& skull,
                             const PlaceOptions& options);

// A YAML file, in the units and axes that it says; ReadLandmarks (read_landmarks.h) reads every
// kind of file. Throws IoError if the file cannot be read; ConfigError, with a line for each fault,
// if it has no landmark, a site is neither standard nor further (sites.h) or appears twice (also
// once as absent), a point lacks, or a normal is not of length 1 within 1 %.
LandmarkFile ReadLandmarkFileAsWritten(const std::filesystem::path& path);

// Checks what other kinds of files say of landmarks as that checks YAML: the ranges of
// depths, the length of normals. file: its name, for messages. Throws ConfigError with a line for
// each fault, which names the site.
void CheckLandmarks(std::span<const Landmark> landmarks, const std::string& file);

// With points and normals in mm and LPS. Units and axes must be words of their enums.
LandmarkFile InLpsMm(LandmarkFile file);

// One dowel per landmark, in the file's order, its depth still NaN. The base is the skull's point
// nearest to the landmark; the direction the landmark's normal, else the area-weighted normal of
// the skull within the radius: of the bone that is connected with the base there and faces within
// 80 degrees of it, so that the inner side of a thin wall has no say. Throws InputError if a
// landmark is too far from the skull, or the skull has no area there.
// query: of the skull.
std::vector<Dowel> PlaceDowels(const LandmarkFile& file, const TriMesh& skull,
                               const MeshQuery& query, const PlaceOptions& options);
std::vector<Dowel> PlaceDowels(const LandmarkFile& file, const TriMesh& skull,
                               const PlaceOptions& options);

}  // namespace semblance
