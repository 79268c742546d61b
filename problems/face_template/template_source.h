// SPDX-License-Identifier: GPL-3.0-or-later
// Where the generic face of an experiment comes from: the built-in formula, the model face that the
// program carries, or a file.
#pragma once

#include <filesystem>
#include <string_view>
#include <variant>
#include <vector>

#include "problems/face_template/template_face.h"
#include "problems/face_template/template_io.h"

namespace semblance {

// The mean of the ICT-FaceKit model, as configs/faces/ict has it.
struct IctTemplate {
  static constexpr std::string_view kName = "ict";
};
template <class Visitor>
void Fields(Visitor&, IctTemplate&) {}

using TemplateSource = std::variant<FormulaTemplate, IctTemplate, FileTemplate>;

// Throws as MakeTemplateFace or ReadTemplate.
TemplateFace LoadTemplate(const TemplateSource& source);

// The files that LoadTemplate reads, for the manifest.
std::vector<std::filesystem::path> TemplateFiles(const TemplateSource& source);

}  // namespace semblance
