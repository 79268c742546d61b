// SPDX-License-Identifier: GPL-3.0-or-later
// The output of a study, for tests that compare studies byte by byte.
#pragma once

#include <filesystem>
#include <map>
#include <regex>
#include <string>

#include "problems/study/report/study_report.h"
#include "surfaces/base/atomic_file.h"

namespace semblance::testing {
using namespace problems;

// The files of a study's folder by name, after its tables were rewritten, without the parts that
// differ from run to run: the trials' timing.json and the seconds in the report.
inline std::map<std::string, std::string> StudyFiles(const std::filesystem::path& root) {
  OutputFolder output(root, WhenNotEmpty::kReplaceFiles);
  WriteStudyTables(output);
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(root)) {
    if (entry.is_regular_file() && entry.path().filename() != "timing.json") {
      files[std::filesystem::relative(entry.path(), root).generic_string()] =
          ReadFileBytes(entry.path());
    }
  }
  static const std::regex kSeconds("(data-head=\"(mean )?seconds\">)[^<]*<");
  files["report.html"] = std::regex_replace(files["report.html"], kSeconds, "$1<");
  return files;
}

}  // namespace semblance::testing
