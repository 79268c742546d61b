// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/study_file.h"

#include "problems/config/config.h"
#include "surfaces/base/atomic_file.h"

namespace semblance {

StudyFile ReadStudyFile(const std::filesystem::path& file, ConfigNode& tree, ConfigErrors& errors) {
  const ConfigSource source{.name = file.string(),
                            .folder = std::filesystem::absolute(file).parent_path()};
  tree = ParseConfigText(ReadFileBytes(file), source, errors);
  if (tree.Find("search")) {
    errors.Add(LocationOf(tree, "search"), "search",
               "removed in 1.0; use Optuna, as docs/examples/search_with_optuna.py does");
    std::erase_if(tree.entries, [](const auto& entry) { return entry.key == "search"; });
  }
  return ReadConfigTree<StudyFile>(tree, errors);
}

}  // namespace semblance
