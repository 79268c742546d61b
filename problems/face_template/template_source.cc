// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face_template/template_source.h"

#include "problems/face_template/template_io.h"
#include "surfaces/base/error.h"

namespace semblance {

TemplateFace LoadTemplate(const TemplateSource& source) {
  if (const auto* formula = std::get_if<FormulaTemplate>(&source)) {
    return MakeTemplateFace(*formula);
  }
  const std::filesystem::path& file = std::get<FileTemplate>(source).file;
  if (file.empty()) {
    throw InputError(
        "template.file: no file is named; give the path of a template, or `template: formula`");
  }
  return ReadTemplate(file);
}

std::vector<std::filesystem::path> TemplateFiles(const TemplateSource& source) {
  const auto* const in_file = std::get_if<FileTemplate>(&source);
  return in_file == nullptr
             ? std::vector<std::filesystem::path>()
             : std::vector<std::filesystem::path>{in_file->file, SurfaceFileOf(in_file->file)};
}

}  // namespace semblance
