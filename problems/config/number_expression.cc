// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/config/number_expression.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <utility>

#include "surfaces/base/error.h"

namespace semblance::problems {

// kNumber and kName have no parts. An operation is '+', '-', '*', '/', or the name of a function.
struct NumberExpression::Node {
  enum class Kind { kNumber, kName, kOperation };
  Kind kind = Kind::kNumber;
  double number = 0;
  std::string word;
  std::vector<Node> parts = {};
};

namespace {

using ExpressionNode = NumberExpression::Node;

constexpr int kMaxNesting = 64;  // nested parts; a bound on recursion
constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

bool IsNameLetter(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '.';
}

// Reads an expression by recursive descent: Sum, Product, Factor, Operand.
class ExpressionParser {
 public:
  explicit ExpressionParser(std::string_view text) : text_(text) {}

  ExpressionNode Parse() {
    ExpressionNode node = Sum();
    if (Next() != '\0') {
      Fail("+, -, * or / is missing before it");
    }
    return node;
  }
  std::vector<std::string> TakeNames() { return std::move(names_); }

 private:
  // The next character that is no blank; 0 at the end.
  char Next() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t')) {
      ++at_;
    }
    return at_ < text_.size() ? text_[at_] : '\0';
  }
  bool Take(char c) {
    const bool is_there = Next() == c;
    at_ += is_there ? 1 : 0;
    return is_there;
  }

  [[noreturn]] void Fail(const std::string& what) {
    const std::string where =
        Next() == '\0' ? std::string("at its end") : fmt::format("at '{}'", text_.substr(at_));
    throw InputError(fmt::format(
        "'{}': {}: {}; an expression is e.g. \"face.rms_mm + 0.5 * abs(face.mean_signed_mm)\"",
        text_, where, what));
  }

  static ExpressionNode Operation(std::string word, std::vector<ExpressionNode> parts) {
    return {ExpressionNode::Kind::kOperation, 0, std::move(word), std::move(parts)};
  }

  // Reads operands joined by one of two signs, from left to right.
  template <class Part>
  ExpressionNode Joined(std::string_view signs, const Part& part) {
    ExpressionNode node = part();
    while (signs.find(Next()) != signs.npos) {
      std::string sign(1, text_[at_++]);
      std::vector<ExpressionNode> parts = {std::move(node)};
      parts.push_back(part());
      node = Operation(std::move(sign), std::move(parts));
    }
    return node;
  }
  ExpressionNode Sum() {
    return Joined("+-", [this] { return Product(); });
  }
  ExpressionNode Product() {
    return Joined("*/", [this] { return Factor(); });
  }

  ExpressionNode Factor() {
    if (++depth_ > kMaxNesting) {
      Fail(fmt::format("more than {} nested parts", kMaxNesting));
    }
    ExpressionNode node = Take('-') ? Operation("-", {Factor()}) : Operand();
    --depth_;
    return node;
  }

  ExpressionNode Operand() {
    const char c = Next();
    if (Take('(')) {
      ExpressionNode node = Sum();
      Close();
      return node;
    }
    if (std::isdigit(static_cast<unsigned char>(c)) != 0 || c == '.') {
      return Number();
    }
    if (!IsNameLetter(c)) {
      Fail("a number, a name or '(' is missing");
    }
    const std::size_t begin = at_;
    while (at_ < text_.size() && IsNameLetter(text_[at_])) {
      ++at_;
    }
    std::string word(text_.substr(begin, at_ - begin));
    return Take('(') ? Function(std::move(word)) : Name(std::move(word));
  }

  ExpressionNode Number() {
    double number = 0;
    const auto [rest, fault] =
        std::from_chars(text_.data() + at_, text_.data() + text_.size(), number);
    if (fault != std::errc() || !std::isfinite(number)) {
      Fail("this is not a finite number");
    }
    at_ = static_cast<std::size_t>(rest - text_.data());
    return {ExpressionNode::Kind::kNumber, number, {}};
  }

  ExpressionNode Name(std::string word) {
    if (std::ranges::find(names_, word) == names_.end()) {
      names_.push_back(word);
    }
    return {ExpressionNode::Kind::kName, 0, std::move(word)};
  }

  ExpressionNode Function(std::string word) {
    std::vector<ExpressionNode> parts;
    do {
      parts.push_back(Sum());
    } while (Take(','));
    Close();
    const bool takes_one = word == "abs" || word == "sqrt";
    if (!takes_one && word != "min" && word != "max") {
      Fail(fmt::format("'{}' is no function; there are abs, sqrt, min and max, before it", word));
    }
    if (takes_one && parts.size() != 1) {
      Fail(fmt::format("'{}' before it takes one value, not {}", word, parts.size()));
    }
    return Operation(std::move(word), std::move(parts));
  }

  void Close() {
    if (!Take(')')) {
      Fail("')' is missing");
    }
  }

  std::string_view text_;
  std::size_t at_ = 0;
  int depth_ = 0;
  std::vector<std::string> names_;
};

double ApplyOperation(const std::string& operation, const std::vector<double>& values) {
  const double a = values.front(), b = values.back();
  if (std::ranges::any_of(values, [](double v) { return std::isnan(v); })) {
    return kNoNumber;
  }
  return operation == "+"      ? a + b
         : operation == "-"    ? (values.size() == 1 ? -a : a - b)
         : operation == "*"    ? a * b
         : operation == "/"    ? a / b
         : operation == "abs"  ? std::abs(a)
         : operation == "sqrt" ? std::sqrt(a)
         : operation == "min"  ? std::ranges::min(values)
                               : std::ranges::max(values);
}

double EvaluateNode(const ExpressionNode& node,
                    const std::function<double(const std::string&)>& value_of) {
  if (node.kind == ExpressionNode::Kind::kNumber) {
    return node.number;
  }
  if (node.kind == ExpressionNode::Kind::kName) {
    return value_of(node.word);
  }
  std::vector<double> values;
  for (const ExpressionNode& part : node.parts) {
    values.push_back(EvaluateNode(part, value_of));
  }
  return ApplyOperation(node.word, values);
}

}  // namespace

NumberExpression::NumberExpression(std::string_view text) {
  ExpressionParser parser(text);
  root_ = std::make_unique<const Node>(parser.Parse());
  names_ = parser.TakeNames();
}
NumberExpression::~NumberExpression() = default;

bool NumberExpression::IsName() const { return root_->kind == ExpressionNode::Kind::kName; }

double NumberExpression::Value(const std::function<double(const std::string&)>& value_of) const {
  const double value = EvaluateNode(*root_, value_of);
  return std::isfinite(value) ? value : kNoNumber;
}

}  // namespace semblance::problems
