// SPDX-License-Identifier: GPL-3.0-or-later
// Where the generic face of an experiment comes from: the built-in formula, or a file.
#pragma once

#include <filesystem>
#include <variant>
#include <vector>

#include "problems/face_template/template_face.h"
#include "problems/face_template/template_io.h"

namespace semblance {

using TemplateSource = std::variant<FormulaTemplate, FileTemplate>;

// Throws as MakeTemplateFace or ReadTemplate.
TemplateFace LoadTemplate(const TemplateSource& source);

// The files that LoadTemplate reads, for the manifest.
std::vector<std::filesystem::path> TemplateFiles(const TemplateSource& source);

}  // namespace semblance
