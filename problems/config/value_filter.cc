// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/config/value_filter.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "problems/config/spelling_suggestion.h"
#include "problems/config/utf8_check.h"
#include "surfaces/base/error.h"

namespace semblance::problems {

// kAll holds if every part holds, kAny if one part does, kNot if its only part does not.
struct ValueFilter::Node {
  enum class Kind { kAll, kAny, kNot, kCompare };
  Kind kind = Kind::kCompare;
  std::vector<Node> parts;
  std::string name, sign, value;
};

std::optional<double> NumberIn(std::string_view text) {
  const char* const end = text.data() + text.size();
  double number = 0;
  const auto [rest, fault] = std::from_chars(text.data(), end, number);
  return fault == std::errc() && rest == end && std::isfinite(number) ? std::optional(number)
                                                                      : std::nullopt;
}

namespace {

constexpr int kMaxDepth = 64;  // nested parts; a bound on recursion, far above real conditions

using Node = ValueFilter::Node;

bool Equal(const std::string& a, const std::string& b) {
  const std::optional<double> x = NumberIn(a), y = NumberIn(b);
  return x && y ? *x == *y : a == b;
}

bool InOrder(const Node& node, const std::string& found) {
  const std::optional<double> a = NumberIn(found), b = NumberIn(node.value);
  if (!a || !b) {
    throw InputError(fmt::format("{} {} {}: '{}' is not a number; compare texts with =, != or ~",
                                 node.name, node.sign, node.value, a ? node.value : found));
  }
  return node.sign == "<"    ? *a < *b
         : node.sign == "<=" ? *a <= *b
         : node.sign == ">"  ? *a > *b
                             : *a >= *b;
}

bool HoldsFor(const Node& node, const std::string& given) {
  const std::string found = Normalized(given), value = Normalized(node.value);
  return node.sign == "=" || node.sign == "!=" ? Equal(found, value)
         : node.sign == "~"                    ? ::fnmatch(value.c_str(), found.c_str(), 0) == 0
                                               : InOrder(node, found);
}

bool Holds(const Node& node, const NamedValues& values) {
  const auto part_holds = [&](const Node& part) { return Holds(part, values); };
  switch (node.kind) {
    case Node::Kind::kAll:
      return std::ranges::all_of(node.parts, part_holds);
    case Node::Kind::kAny:
      return std::ranges::any_of(node.parts, part_holds);
    case Node::Kind::kNot:
      return !Holds(node.parts.front(), values);
    case Node::Kind::kCompare:
      break;
  }
  const auto [first, last] = values.equal_range(node.name);
  const bool one =
      std::any_of(first, last, [&](const auto& entry) { return HoldsFor(node, entry.second); });
  return node.sign == "!=" ? !one : one;
}

struct Token {
  std::string text;
  std::size_t at = 0;
  bool quoted = false;
};

constexpr std::string_view kSigns = "=!<>~()";

class Parser {
 public:
  Parser(std::string_view text, std::span<const std::string> names) : text_(text), names_(names) {
    for (std::size_t at = 0; at < text_.size();) {
      at = AddToken(at);
    }
  }

  Node Parse() {
    Node node = Any();
    if (next_ < tokens_.size()) {
      Fail("'and' or 'or' is missing before it");
    }
    return node;
  }

 private:
  // Adds the token at `at`, if there is one. Returns the place after it.
  std::size_t AddToken(std::size_t at) {
    const char c = text_[at];
    if (c == ' ' || c == '\t') {
      return at + 1;
    }
    if (c == '\'' || c == '"') {
      const std::size_t end = text_.find(c, at + 1);
      if (end == text_.npos) {
        throw InputError(
            fmt::format("{}: the quote at '{}' is not closed", text_, text_.substr(at)));
      }
      tokens_.push_back({std::string(text_.substr(at + 1, end - at - 1)), at, true});
      return end + 1;
    }
    std::size_t end = at;
    if (kSigns.find(c) != kSigns.npos) {
      const bool is_pair = c != '(' && c != ')' && at + 1 < text_.size() && text_[at + 1] == '=';
      end = at + (is_pair ? 2 : 1);
    } else {
      end = std::min(text_.find_first_of(" \t=!<>~()", at), text_.size());
    }
    tokens_.push_back({std::string(text_.substr(at, end - at)), at});
    return end;
  }

  bool Take(std::string_view word) {
    const bool there =
        next_ < tokens_.size() && !tokens_[next_].quoted && tokens_[next_].text == word;
    next_ += there ? 1 : 0;
    return there;
  }

  [[noreturn]] void Fail(const std::string& what) const {
    const std::string where = next_ < tokens_.size()
                                  ? fmt::format("at '{}'", text_.substr(tokens_[next_].at))
                                  : std::string("at its end");
    throw InputError(fmt::format("{}: {}: {}; a condition is e.g. \"subject = a and rounds >= 2\"",
                                 text_, where, what));
  }

  Node Any() {
    return Joined(Node::Kind::kAny, "or", [this] { return All(); });
  }
  Node All() {
    return Joined(Node::Kind::kAll, "and", [this] { return One(); });
  }

  template <class Part>
  Node Joined(Node::Kind kind, std::string_view word, const Part& part) {
    Node node{.kind = kind, .parts = {}, .name = {}, .sign = {}, .value = {}};
    do {
      node.parts.push_back(part());
    } while (Take(word));
    return node;
  }

  Node One() {
    const bool negated = Take("not");
    if (!negated && !Take("(")) {
      return Comparison();
    }
    if (++depth_ > kMaxDepth) {
      Fail(fmt::format("more than {} nested parts", kMaxDepth));
    }
    Node node = negated ? Negated(One()) : Any();
    --depth_;
    if (!negated && !Take(")")) {
      Fail("')' is missing");
    }
    return node;
  }

  static Node Negated(Node part) {
    Node node{.kind = Node::Kind::kNot, .parts = {}, .name = {}, .sign = {}, .value = {}};
    node.parts.push_back(std::move(part));
    return node;
  }

  Node Comparison() {
    Node node;
    node.name = FindName(Word("a name"));
    const std::vector<std::string> signs = {"=", "==", "!=", "<", "<=", ">", ">=", "~"};
    const auto sign = std::ranges::find_if(signs, [&](const std::string& s) { return Take(s); });
    if (sign == signs.end()) {
      Fail("one of = != < <= > >= ~ is missing");
    }
    node.sign = *sign == "==" ? "=" : *sign;
    node.value = Word("a value");
    return node;
  }

  std::string Word(const char* what) {
    if (next_ >= tokens_.size() ||
        (!tokens_[next_].quoted && kSigns.find(tokens_[next_].text[0]) != kSigns.npos)) {
      Fail(fmt::format("{} is missing", what));
    }
    return tokens_[next_++].text;
  }

  std::string FindName(const std::string& word) const {
    std::vector<std::string> matches;
    for (const std::string& name : names_) {
      if (name == word) {
        return name;
      }
      if (name.ends_with("." + word)) {
        matches.push_back(name);
      }
    }
    if (matches.size() != 1) {
      throw InputError(fmt::format("{}: {} '{}'{}", text_,
                                   matches.empty() ? "unknown name" : "ambiguous name", word,
                                   Suggestion(word, matches.empty() ? names_ : matches)));
    }
    return matches.front();
  }

  std::string_view text_;
  std::span<const std::string> names_;
  std::vector<Token> tokens_;
  std::size_t next_ = 0;
  int depth_ = 0;
};

}  // namespace

ValueFilter::ValueFilter(std::string_view text, std::span<const std::string> names)
    : root_(std::make_unique<const Node>(Parser(text, names).Parse())) {}
ValueFilter::~ValueFilter() = default;
ValueFilter::ValueFilter(ValueFilter&&) noexcept = default;

bool ValueFilter::Holds(const NamedValues& values) const { return problems::Holds(*root_, values); }

}  // namespace semblance::problems
