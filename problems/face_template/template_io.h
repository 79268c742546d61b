// SPDX-License-Identifier: GPL-3.0-or-later
// A template face as files, so that another generic face can take the place of the built-in one.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "problems/face_template/template_face.h"
#include "surfaces/base/fields.h"

namespace semblance {

// The files of a face.
struct FileTemplate {
  static constexpr std::string_view kName = "file";
  std::filesystem::path surface;   // H-spline (hspline_json.h)
  std::filesystem::path sites;     // CSV: site,u,v
  std::filesystem::path features;  // JSON; empty: the face has none
};
template <class Visitor>
void Fields(Visitor& visit, FileTemplate& o) {
  visit(FieldInfo{.name = "surface",
                  .doc = "H-spline of the face (.hspline.json), as `semblance template` writes it"},
        o.surface);
  visit(FieldInfo{.name = "sites",
                  .doc = "table (.csv) with the columns site,u,v: where the dowels of the 32 sites "
                         "meet the face"},
        o.sites);
  visit(FieldInfo{.name = "features",
                  .doc = "features of the face (.json): vertices that a fit may restore, and "
                         "regions without seeds; without the file the face has none"},
        o.features);
}

// Writes head.hspline.json, sites.csv and features.json into the folder, which must exist, and says
// where they are. What is read back is equal to the bit. Throws IoError if a file cannot be
// written, InputError if the face is not one that ReadTemplate would accept; no file is then
// written.
FileTemplate WriteTemplate(const std::filesystem::path& folder, const TemplateFace& face);

// Throws IoError if a file cannot be read or a table is none, InputError in one line that starts
// with the file and says what is wrong: no file named, an entry that is missing or of the wrong
// kind, one of the 32 sites missing or standing twice, a (u,v) outside [0,1] x [0,1], sites whose
// left and right have changed places, a feature's vertex outside the surface's levels, a radius
// that is not positive. Sites beyond the 32 are kept.
TemplateFace ReadTemplate(const FileTemplate& files);

// What the files say.
struct TemplateTexts {
  std::string surface, sites, features;  // features: empty where the face has none
};

// As ReadTemplate, of texts already read. names: what errors call them.
TemplateFace TemplateFrom(const FileTemplate& names, const TemplateTexts& texts);

// Those that are named.
std::vector<std::filesystem::path> FilesOf(const FileTemplate& files);

}  // namespace semblance
