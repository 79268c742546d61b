// SPDX-License-Identifier: GPL-3.0-or-later
// A condition over named values, as people write it on a command line:
//
//     subject = a and (interp = kriging or interp = mean) and not rounds >= 3
//
// A comparison is NAME OP VALUE. OP: = and != (as numbers where both are, else as text), < <= > >=
// (numbers alone), ~ (a pattern with * and ?). `not` binds closest, then `and`, then `or`;
// parentheses group. A value with blanks or signs stands in single or double quotes.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace semblance {

// The text as a number, where all of it is one, and a finite one.
std::optional<double> NumberIn(std::string_view text);

// A name may have several values: = and the like hold if one of them does, != if none is equal.
using NamedValues = std::multimap<std::string, std::string>;

class ValueFilter {
 public:
  // A name may also be the last part of one of `names` ("resolution" of "implicit.resolution")
  // where it is of one alone. Throws InputError, in one line that shows where: what is no such
  // condition, a name that is unknown or could be several, more than 64 `not` and parentheses
  // inside each other.
  ValueFilter(std::string_view text, std::span<const std::string> names);
  ~ValueFilter();
  ValueFilter(ValueFilter&&) noexcept;

  // A comparison of a name that has no value does not hold, but for !=. Throws InputError where <
  // and the like meet a value that is not a number.
  bool Holds(const NamedValues& values) const;

  struct Node;

 private:
  std::unique_ptr<const Node> root_;
};

}  // namespace semblance
