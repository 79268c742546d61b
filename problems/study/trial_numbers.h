// SPDX-License-Identifier: GPL-3.0-or-later
// What the tables of a study need of a trial.json, taken from its text without a tree in between: a
// study has thousands of them, of hundreds of numbers each.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace semblance {

struct TrialNumbers {
  std::string id, status = "failed", reason;
  std::map<std::string, double> metrics;             // numbers of `result` by dotted path
  std::map<std::string, std::vector<double>> lists;  // numbers in lists of it, in their order, a
                                                     // list of objects as one list per member;
                                                     // NaN for null
};

// Nothing for what is no JSON, no object, nested deeper than kDeepestJson, or where id, status or
// reason is no text.
std::optional<TrialNumbers> ReadTrialNumbers(std::string_view text);

}  // namespace semblance
