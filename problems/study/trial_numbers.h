// SPDX-License-Identifier: GPL-3.0-or-later
// The parts of a trial.json that the tables of a study need, read without a JSON tree: a study has
// up to 100,000 trials with hundreds of numbers each.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "problems/study/named_numbers.h"
#include "surfaces/base/geometry.h"

namespace semblance::problems {

// A file of a trial, as trial.json lists it.
struct TrialFile {
  std::string name;
  double bytes = kNaN;  // NaN in a trial of an older version
  std::string sha256;
};

struct TrialNumbers {
  std::string id, subject, status = "failed", reason;
  std::string version, program;                           // that made it
  std::vector<std::pair<std::string, std::string>> axes;  // option path and value
  NamedNumbers metrics;                                   // numbers of `result` by dotted path
  // The numbers in lists of `result`, in their order; a list of objects gives one list per member;
  // null becomes NaN.
  std::map<std::string, std::vector<double>> lists;
  std::vector<TrialFile> files;
};

// The lists of names that trials share. One object serves all trials of a study, from any number of
// threads.
class SharedNames {
 public:
  // Decides by the name whether a number of `result` is kept.
  using Filter = std::function<bool(std::string_view)>;
  explicit SharedNames(Filter is_kept = {}) : is_kept_(std::move(is_kept)) {}

  // Takes the paths of numbers in the order of a file, each followed by a line feed, and the
  // values. The last of several values of one path counts.
  NamedNumbers Name(const std::string& paths, const std::vector<double>& values);

 private:
  // The destination of the numbers of one kind of file.
  struct Layout {
    std::shared_ptr<const std::vector<std::string>> names;
    std::vector<std::size_t> places;  // index in `names` per number; names->size() if not kept
  };
  Layout MakeLayout(std::string_view paths) const;
  std::shared_ptr<const Layout> FindLayout(const std::string& paths);

  Filter is_kept_;
  std::mutex mutex_;
  std::unordered_map<std::string, std::shared_ptr<const Layout>> layouts_;  // by the paths
};

// Returns nothing if the text is not a JSON object, is nested deeper than kDeepestJson, has an
// object of more than 4,000 entries, or has an id, status, reason or version that is not a text.
std::optional<TrialNumbers> ReadTrialNumbers(std::string_view text, SharedNames& names);

}  // namespace semblance::problems
