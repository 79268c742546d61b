// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/inputs/input_files.h"

#include <algorithm>
#include <iterator>

#include "problems/prior/hspline_prior.h"

namespace semblance {

std::vector<NamedFile> NamedInputsOf(const Experiment& experiment) {
  std::vector<NamedFile> files = NamedFiles(experiment);
  if (TablesOf(experiment.tissue).empty()) {
    std::erase_if(files,
                  [](const NamedFile& named) { return named.option.starts_with("tissue."); });
  }
  return files;
}

std::vector<std::filesystem::path> InputFilesOf(const Experiment& experiment) {
  std::vector<std::filesystem::path> files;
  for (const NamedFile& named : NamedInputsOf(experiment)) {
    files.push_back(named.file);
  }
  return files;
}

GivenFiles GivenTo(const Experiment& experiment, const std::filesystem::path& config,
                   std::span<const std::string_view> outputs) {
  GivenFiles given{.files = InputFilesOf(experiment), .outputs = outputs};
  given.files.push_back(config);
  // Modes may be a folder, of which each mesh is read.
  std::ranges::copy(PriorFiles(experiment.prior), std::back_inserter(given.files));
  return given;
}

}  // namespace semblance
