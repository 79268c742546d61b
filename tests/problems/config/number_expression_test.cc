// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/config/number_expression.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "surfaces/base/error.h"
#include "surfaces/base/geometry.h"
#include "tests/testing/scratch_file.h"

namespace semblance::problems {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

double ValueIn(const std::map<std::string, double>& numbers, const std::string& text) {
  return NumberExpression(text).Value([&](const std::string& name) {
    const auto found = numbers.find(name);
    return found == numbers.end() ? kNaN : found->second;
  });
}

TEST(NumberExpression, EqualsTheSameArithmeticInCpp) {
  const double a = 1.7, b = -0.3, c = 12.5;
  const std::map<std::string, double> numbers = {{"a.mm", a}, {"b", b}, {"c_2.x", c}};
  EXPECT_DOUBLE_EQ(ValueIn(numbers, "a.mm + 0.5 * abs(b)"), a + 0.5 * std::abs(b));
  EXPECT_DOUBLE_EQ(ValueIn(numbers, "a.mm - b - c_2.x"), a - b - c);
  EXPECT_DOUBLE_EQ(ValueIn(numbers, "c_2.x / a.mm / 2"), c / a / 2);
  EXPECT_DOUBLE_EQ(ValueIn(numbers, "-(a.mm + b) * -2"), -(a + b) * -2);
  EXPECT_DOUBLE_EQ(ValueIn(numbers, "max(a.mm, b, min(c_2.x, 3)) - sqrt(c_2.x)"), 3 - std::sqrt(c));
  EXPECT_DOUBLE_EQ(ValueIn(numbers, "1e1*b"), 10 * b);
}

TEST(NumberExpression, ListsItsNamesOnceInOrder) {
  EXPECT_THAT(NumberExpression("b + a * b").names(), ElementsAre("b", "a"));
  EXPECT_TRUE(NumberExpression(" face.rms_mm ").IsName());
  EXPECT_FALSE(NumberExpression("-face.rms_mm").IsName());
}

TEST(NumberExpression, IsNoNumberWithoutAnOperandOrAFiniteResult) {
  for (const char* text : {"a + missing", "max(a, missing)", "1 / (a - a)", "sqrt(0 - a)"}) {
    EXPECT_TRUE(std::isnan(ValueIn({{"a", 2}}, text))) << text;
  }
}

TEST(NumberExpression, ShowsTheFaultAndItsPlace) {
  const auto words = [](const std::string& text) {
    return testing::WordsOf<InputError>([&] { NumberExpression{text}; });
  };
  EXPECT_THAT(words("a + "), HasSubstr("at its end: a number, a name or '(' is missing"));
  EXPECT_THAT(words("(a"), HasSubstr("at its end: ')' is missing"));
  EXPECT_THAT(words("a b"), HasSubstr("at 'b': +, -, * or / is missing"));
  EXPECT_THAT(words("log(a)"), HasSubstr("'log' is no function"));
  EXPECT_THAT(words("abs(a, b)"), HasSubstr("takes one value, not 2"));
  EXPECT_THAT(words(std::string(100, '(')), HasSubstr("nested"));
}

}  // namespace
}  // namespace semblance::problems
