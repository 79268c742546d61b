// SPDX-License-Identifier: GPL-3.0-or-later
// The sources of an experiment's generic face: the built-in formula, the model face that the
// program carries, or files, which are read and written here.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "problems/face/template_face.h"
#include "surfaces/base/fields.h"

namespace semblance::problems {

struct FileTemplate {
  static constexpr std::string_view kName = "file";
  std::filesystem::path surface;
  std::filesystem::path sites;
  std::filesystem::path features;  // may be empty
};
template <class Visitor>
void Fields(Visitor& visit, FileTemplate& o) {
  visit(FieldInfo{.name = "surface",
                  .doc = "H-spline of the face (.hspline.json), as `semblance template` writes it"},
        o.surface);
  visit(FieldInfo{.name = "sites",
                  .doc = "table (.csv) with the columns site,u,v: the points of the face that the "
                         "dowels of the 32 sites meet"},
        o.sites);
  visit(FieldInfo{.name = "features",
                  .doc = "features of the face (.json): vertices that a fit may restore, and "
                         "regions without seeds; without the file the face has none"},
        o.features);
}

// Writes head.hspline.json, sites.csv and features.json into the folder, which must exist. Returns
// their paths. Reading them gives the same face to the bit. Throws IoError if a file cannot be
// written. Throws InputError, without writing any file, if ReadTemplate would not accept the face.
FileTemplate WriteTemplate(const std::filesystem::path& folder, const TemplateFace& face);

// Sites beyond the 32 standard ones are kept. Throws IoError if a file cannot be read or is no
// table. Throws InputError in one line that starts with the file for: no file named, an entry that
// is missing or of the wrong kind, one of the 32 sites missing or repeated, a (u,v) outside [0,1] x
// [0,1], sites whose left and right have changed places, a feature's vertex outside the surface's
// levels, a radius that is not positive.
TemplateFace ReadTemplate(const FileTemplate& files);

enum class IctMean { kPeople, kModel };
constexpr auto EnumNames(IctMean) { return std::to_array<std::string_view>({"people", "model"}); }

// The mean of the ICT-FaceKit model, from configs/faces/ict, without its bias.
struct IctTemplate {
  static constexpr std::string_view kName = "ict";
  IctMean mean = IctMean::kPeople;
};
template <class Visitor>
void Fields(Visitor& visit, IctTemplate& o) {
  visit(FieldInfo{.name = "mean",
                  .doc = "people: corrected at the mean head of 54 people (configs/faces/people), "
                         "whose cheek bones, temples and lower lip are less full; model: the "
                         "model's own"},
        o.mean);
}

using TemplateSource = std::variant<FormulaTemplate, IctTemplate, FileTemplate>;

// Throws as MakeTemplateFace or ReadTemplate does.
TemplateFace LoadTemplate(const TemplateSource& source);

// The files that LoadTemplate reads, for the manifest.
std::vector<std::filesystem::path> TemplateFiles(const TemplateSource& source);

}  // namespace semblance::problems
