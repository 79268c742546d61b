// SPDX-License-Identifier: GPL-3.0-or-later
// A statistical model of faces, with its points at the sites of the skull.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "problems/face/shape_model/shape_fit.h"
#include "surfaces/base/fields.h"

namespace semblance::problems {

struct NoPrior {
  static constexpr std::string_view kName = "none";
};
template <class Visitor>
void Fields(Visitor&, NoPrior&) {}

struct ModesPrior {
  static constexpr std::string_view kName = "modes";
  std::filesystem::path mean;
  std::filesystem::path modes;
  std::filesystem::path sites;
  std::filesystem::path features;
  double scale = 1;
  int count = 100;
};
template <class Visitor>
void Fields(Visitor& visit, ModesPrior& o) {
  visit(FieldInfo{.name = "mean",
                  .doc = "mesh of the mean face in mm, LPS: PLY, OBJ or OFF (an STL keeps no order "
                         "of points)"},
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
                         "z_mm; sites that are missing take no part"},
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
  visit(FieldInfo{.name = "count", .min = 1, .max = 10000, .doc = "largest number of modes used"},
        o.count);
}

// The modes of `template` as H-splines.
struct HSplinePrior {
  static constexpr std::string_view kName = "hspline";
  std::filesystem::path modes;
  int count = 100;
};
template <class Visitor>
void Fields(Visitor& visit, HSplinePrior& o) {
  visit(FieldInfo{.name = "modes",
                  .doc = "file (.json) of the modes, as `semblance prior` writes it; `template` "
                         "must be the face that it was made for"},
        o.modes);
  visit(FieldInfo{.name = "count", .min = 1, .max = 10000, .doc = "largest number of modes used"},
        o.count);
}

// The modes of configs/faces/ict, which the program carries, for `template: ict`.
struct IctPrior {
  static constexpr std::string_view kName = "ict";
  int count = 60;
};
template <class Visitor>
void Fields(Visitor& visit, IctPrior& o) {
  visit(FieldInfo{.name = "count", .min = 1, .max = 60, .doc = "largest number of modes used"},
        o.count);
}

using PriorSource = std::variant<NoPrior, IctPrior, ModesPrior, HSplinePrior>;

struct FacePrior {
  ShapeModel model;
  std::map<std::string, ModelPoint> sites;  // by site code
  std::vector<ShapeFeature> features;       // landmarks 28 to 68 of Multi-PIE, by number
};

// Throws InputError or IoError in one line for: a file that is not named or cannot be read, a mean
// that is an STL, modes that do not fit the mean, a mesh of a mode that equals the mean, a largest
// mode outside 0.05 to 50 mm RMS, an unknown site, a landmark that is unknown, repeated or missing,
// a site or landmark more than 5 mm from the mean. For a folder of modes it also throws as
// ModesPriorFiles does.
FacePrior LoadPrior(const ModesPrior& source);

// The files that LoadPrior reads. From a folder of modes these are the first source.count meshes,
// by name. Throws InputError for a folder without a mesh or with an STL, IoError if it cannot be
// read.
std::vector<std::filesystem::path> ModesPriorFiles(const ModesPrior& source);

}  // namespace semblance::problems
