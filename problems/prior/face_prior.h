// SPDX-License-Identifier: GPL-3.0-or-later
// A statistical model of faces, and which of its points belong to the sites of the skull.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "fitting/shape_model/shape_fit.h"
#include "surfaces/base/fields.h"

namespace semblance {

struct NoPrior {
  static constexpr std::string_view kName = "none";
};
template <class Visitor>
void Fields(Visitor&, NoPrior&) {}

struct ModesPrior {
  static constexpr std::string_view kName = "modes";
  std::filesystem::path mean;      // mesh, LPS, mm
  std::filesystem::path modes;     // .npy, k x n x 3, or a folder of meshes
  std::filesystem::path sites;     // .csv: their points on the mean
  std::filesystem::path features;  // .csv: the 68 facial landmarks
  double scale = 1;                // mm per unit of an array's modes
  int count = 100;                 // of modes, at most
};
template <class Visitor>
void Fields(Visitor& visit, ModesPrior& o) {
  visit(FieldInfo{.name = "mean",
                  .doc = "mesh of the mean face: PLY, OBJ or OFF, for an STL has no order of "
                         "points; mm, LPS"},
        o.mean);
  visit(FieldInfo{.name = "modes",
                  .doc = "NumPy array (.npy) of the modes, k x n x 3, n the points of the mean in "
                         "their order: the face is mean + scale * sum of w_k mode_k, w_k "
                         "independent N(0,1). Or a folder of meshes (PLY, OBJ, OFF; by name, so "
                         "001.ply, 002.ply ...), each the mean moved by one standard deviation of "
                         "one mode, with the mean's points and triangles in their order"},
        o.modes);
  visit(FieldInfo{.name = "sites",
                  .doc = "CSV file of the sites' points on the mean: columns site, x_mm, y_mm, "
                         "z_mm; sites that are not there take no part"},
        o.sites);
  visit(
      FieldInfo{.name = "features",
                .doc = "CSV file of the 68 facial landmarks on the mean, numbered as in Multi-PIE: "
                       "columns i_multipie, x, y, z, rows in any order; 28 to 36 are the nose, 37 "
                       "to 48 the eyes, 49 to 68 the mouth, and must all be there; 1 to 27 are not "
                       "used"},
      o.features);
  visit(FieldInfo{.name = "scale",
                  .min = 1e-9,
                  .max = 1e9,
                  .doc = "mm per unit of the array of modes, e.g. 0.001 where they are in "
                         "micrometres; 1 for a folder of meshes, which are in mm"},
        o.scale);
  visit(FieldInfo{.name = "count", .min = 1, .max = 10000, .doc = "modes that are used, at most"},
        o.count);
}

// The modes of `template` as H-splines.
struct HSplinePrior {
  static constexpr std::string_view kName = "hspline";
  std::filesystem::path modes;  // .json of `semblance prior`
  int count = 100;              // of modes, at most
};
template <class Visitor>
void Fields(Visitor& visit, HSplinePrior& o) {
  visit(FieldInfo{.name = "modes",
                  .doc = "file (.json) of the modes, as `semblance prior` writes it; `template` is "
                         "the face that it was made for"},
        o.modes);
  visit(FieldInfo{.name = "count", .min = 1, .max = 10000, .doc = "modes that are used, at most"},
        o.count);
}

// The modes of configs/faces/ict, which the program carries, for `template: ict`.
struct IctPrior {
  static constexpr std::string_view kName = "ict";
  int count = 60;  // of modes, at most
};
template <class Visitor>
void Fields(Visitor& visit, IctPrior& o) {
  visit(FieldInfo{.name = "count", .min = 1, .max = 60, .doc = "modes that are used, at most"},
        o.count);
}

using PriorSource = std::variant<NoPrior, IctPrior, ModesPrior, HSplinePrior>;

struct FacePrior {
  ShapeModel model;
  std::map<std::string, ModelPoint> sites;  // by site code
  std::vector<ShapeFeature> features;       // of modes on a mesh: Multi-PIE's 28 to 68, by number
};

// Throws InputError or IoError in one line: a file that is not named or cannot be read, a mean
// that is an STL, a mean and modes that disagree, a mesh of a mode that is the mean itself, a
// largest mode that is not of 0.05 to 50 mm RMS, a site that is none, a landmark that is none,
// appears twice or is missing, and a site or landmark that lies farther than 5 mm from the mean.
// For a folder of modes as ModesPriorFiles.
FacePrior LoadPrior(const ModesPrior& source);

// The files that LoadPrior reads: of a folder of modes the first source.count meshes, by name.
// Throws InputError for a folder without a mesh or with an STL, IoError if it cannot be read.
std::vector<std::filesystem::path> ModesPriorFiles(const ModesPrior& source);

}  // namespace semblance
