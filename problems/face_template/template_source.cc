// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face_template/template_source.h"

namespace semblance {

TemplateFace LoadTemplate(const TemplateSource& source) {
  const auto* const formula = std::get_if<FormulaTemplate>(&source);
  return formula != nullptr ? MakeTemplateFace(*formula)
                            : ReadTemplate(std::get<FileTemplate>(source));
}

std::vector<std::filesystem::path> TemplateFiles(const TemplateSource& source) {
  const auto* const in_files = std::get_if<FileTemplate>(&source);
  return in_files == nullptr ? std::vector<std::filesystem::path>() : FilesOf(*in_files);
}

}  // namespace semblance
