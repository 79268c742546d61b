// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face_template/template_source.h"

#include "problems/face_template/ict_face.h"

namespace semblance {

namespace {

TemplateFace Load(const FormulaTemplate& source) { return MakeTemplateFace(source); }
TemplateFace Load(const FileTemplate& source) { return ReadTemplate(source); }
TemplateFace Load(const IctTemplate&) {
  static const TemplateFace kFace = TemplateFrom(
      {"the ICT face", "the ICT face's sites", "the ICT face's features"},
      {std::string(IctSurface()), std::string(IctSites()), std::string(IctFeatures())});
  return kFace;
}

}  // namespace

TemplateFace LoadTemplate(const TemplateSource& source) {
  return std::visit([](const auto& given) { return Load(given); }, source);
}

std::vector<std::filesystem::path> TemplateFiles(const TemplateSource& source) {
  const auto* const in_files = std::get_if<FileTemplate>(&source);
  return in_files == nullptr ? std::vector<std::filesystem::path>() : FilesOf(*in_files);
}

}  // namespace semblance
