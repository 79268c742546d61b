// SPDX-License-Identifier: GPL-3.0-or-later
// What a search found: how its best came down, and how it does on subjects that it never saw.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "problems/report/report_kit.h"
#include "problems/study/study_tables.h"

namespace semblance {

// A treatment that was asked for.
struct SearchedTreatment {
  std::string label;
  double cost = 1;                       // in full runs; below 1: a short run
  double spent = 0;                      // by it and all before it
  double value = kNaN;                   // the metric's mean over the subjects; NaN: none
  std::vector<std::string> values = {};  // one per axis
};

// A subject held out: the metric of the base as it stands, and of the best treatment.
struct HeldOutPair {
  std::string subject;
  double base = kNaN, best = kNaN;
};

struct SearchResults {
  std::string method;  // as in the study's file
  int budget = 0;
  bool ended = false;
  Preference preference = {};  // values here are as it compares them
  std::vector<SearchedTreatment> treatments;
  std::vector<std::size_t> improvements;  // runs in full that were better than all before
  double base = kNaN;                     // the base's mean over the subjects
  std::vector<HeldOutPair> held_out;
};

// Nothing where the study is no search. Throws IoError as ReadStudyResults.
std::optional<SearchResults> ReadSearchResults(const std::filesystem::path& folder,
                                               const StudyResults& results);

// The curve of the best so far, the improvements as a table, the subjects held out.
ReportSection SearchSection(const StudyResults& results, const SearchResults& search);

// The same for a terminal: a line for each improvement, and one for the subjects held out.
std::string SearchText(const StudyResults& results, const SearchResults& search);

}  // namespace semblance
