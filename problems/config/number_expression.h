// SPDX-License-Identifier: GPL-3.0-or-later
// Arithmetic over named numbers, as people write a metric of their own:
//
//     face.rms_mm + 0.5 * abs(face.regions.nose.mean_signed_mm)
//
// It has + - * /, parentheses, and the functions abs, sqrt, min and max. A name has letters,
// digits, `_` and dots. Multiplication and division bind before addition and subtraction, and
// equals are computed from left to right.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace semblance::problems {

class NumberExpression {
 public:
  // Throws InputError, with the place in one line, for a text that is not an expression or has more
  // than 64 nested parts.
  explicit NumberExpression(std::string_view text);
  ~NumberExpression();

  // The names in the expression, each once, in the order of their first occurrence.
  const std::vector<std::string>& names() const { return names_; }
  // Returns true if the expression is one name alone.
  bool IsName() const;

  // The value; NaN if value_of returns NaN for a name, or if the arithmetic has no finite result.
  double Value(const std::function<double(const std::string&)>& value_of) const;

  struct Node;

 private:
  std::unique_ptr<const Node> root_;
  std::vector<std::string> names_;
};

}  // namespace semblance::problems
