// SPDX-License-Identifier: GPL-3.0-or-later
// A condition over named values, as people write it on a command line:
//
//     subject = a and (interp = kriging or interp = mean) and not rounds >= 3
//
// A comparison is NAME OP VALUE. OP is one of: = and != (compare numbers if both are numbers, else
// text), < <= > >= (numbers only), ~ (a pattern with * and ?). `not` binds closest, then `and`,
// then `or`; parentheses group. A value with blanks or signs must be in single or double quotes.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace semblance::problems {

// Reads a text as a number. Returns nothing unless the whole text is one finite number.
std::optional<double> NumberIn(std::string_view text);

// A name may have several values. A comparison holds if it holds for one of them; != holds if no
// value is equal.
using NamedValues = std::multimap<std::string, std::string>;

class ValueFilter {
 public:
  // A name may also be the last part of one of `names` ("resolution" for "implicit.resolution") if
  // only one of them ends so. Throws InputError, with the place in one line, for a text that is not
  // a condition, for an unknown or ambiguous name, and for more than 64 nested `not` and
  // parentheses.
  ValueFilter(std::string_view text, std::span<const std::string> names);
  ~ValueFilter();
  ValueFilter(ValueFilter&&) noexcept;

  // A comparison with a name that has no value is false, except for !=. Throws InputError if < <= >
  // or >= meets a value that is not a number.
  bool Holds(const NamedValues& values) const;

  struct Node;

 private:
  std::unique_ptr<const Node> root_;
};

}  // namespace semblance::problems
