// SPDX-License-Identifier: GPL-3.0-or-later
// Where the generic face of an experiment comes from: the built-in formula, or a file.
#pragma once

#include <filesystem>
#include <string_view>
#include <variant>
#include <vector>

#include "problems/face_template/template_face.h"
#include "surfaces/base/fields.h"

namespace semblance {

struct FileTemplate {
  static constexpr std::string_view kName = "file";
  std::filesystem::path file;
};
template <class Visitor>
void Fields(Visitor& visit, FileTemplate& o) {
  visit(FieldInfo{.name = "file",
                  .doc = "template file (JSON), as `semblance template` writes it: the (u,v) of "
                         "the 32 sites, the features, and the name of the surface's file"},
        o.file);
}

using TemplateSource = std::variant<FormulaTemplate, FileTemplate>;

// Throws as MakeTemplateFace or ReadTemplate; InputError if no file is named.
TemplateFace LoadTemplate(const TemplateSource& source);

// The files that LoadTemplate reads, for the manifest. Throws as ReadTemplate.
std::vector<std::filesystem::path> TemplateFiles(const TemplateSource& source);

}  // namespace semblance
