// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/config/value_filter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "surfaces/base/error.h"
#include "tests/testing/scratch_file.h"

namespace semblance::problems {
namespace {

using ::testing::HasSubstr;
using testing::WordsOf;

const std::vector<std::string> kNames = {
    "subject", "interp", "seeds.weight", "implicit.weight", "implicit.resolution", "tag"};

bool Holds(const std::string& condition, const NamedValues& values) {
  return ValueFilter(condition, kNames).Holds(values);
}

std::string Refusal(const std::string& condition) {
  return WordsOf<InputError>([&] { Holds(condition, {}); });
}

const NamedValues kTrial = {{"subject", "head 1"},    {"interp", "kriging"},
                            {"seeds.weight", "0.50"}, {"implicit.resolution", "60"},
                            {"tag", "odd"},           {"tag", "real"}};

TEST(ValueFilter, ComparesNumbersAsNumbersAndTextAsText) {
  EXPECT_TRUE(Holds("seeds.weight = 0.5", kTrial));
  EXPECT_TRUE(Holds("resolution<=60", kTrial));
  EXPECT_FALSE(Holds("resolution > 60", kTrial));
  EXPECT_TRUE(Holds("resolution < 1e2", kTrial));
  EXPECT_TRUE(Holds("subject = 'head 1'", kTrial));
  EXPECT_TRUE(Holds("subject ~ \"head*\"", kTrial));
  EXPECT_FALSE(Holds("interp = Kriging", kTrial));
}

TEST(ValueFilter, NotBindsCloserThanAndAndAndCloserThanOr) {
  for (const bool a : {false, true}) {
    for (const bool b : {false, true}) {
      for (const bool c : {false, true}) {
        const auto is = [](bool x) { return x ? "1" : "0"; };
        const NamedValues values = {{"subject", is(a)}, {"interp", is(b)}, {"tag", is(c)}};
        EXPECT_EQ(Holds("subject = 1 or interp = 1 and not tag = 1", values), a || (b && !c));
        EXPECT_EQ(Holds("(subject = 1 or interp = 1) and tag = 1", values), (a || b) && c);
        EXPECT_EQ(Holds("not (subject = 1 and interp = 1)", values), !(a && b));
        EXPECT_EQ(Holds("not not tag == 1", values), c);
      }
    }
  }
}

TEST(ValueFilter, ComparesWithEachOfSeveralValues) {
  EXPECT_TRUE(Holds("tag = real", kTrial));
  EXPECT_FALSE(Holds("tag != real", kTrial));
  EXPECT_TRUE(Holds("tag != broken", kTrial));
  EXPECT_FALSE(Holds("tag = odd", {}));
  EXPECT_TRUE(Holds("tag != odd", {}));
}

TEST(ValueFilter, ReportsThePlaceOfAFault) {
  EXPECT_THAT(Refusal("subjct = a"), HasSubstr("unknown name 'subjct'; did you mean 'subject'?"));
  EXPECT_THAT(Refusal("weight = 1"), HasSubstr("ambiguous name 'weight'"));
  EXPECT_THAT(Refusal("subject = a interp = b"), HasSubstr("at 'interp = b'"));
  EXPECT_THAT(Refusal("subject"), HasSubstr("at its end"));
  EXPECT_THAT(Refusal("subject ="), HasSubstr("a value is missing"));
  EXPECT_THAT(Refusal("(subject = a"), HasSubstr("')' is missing"));
  EXPECT_THAT(Refusal("subject = 'a"), HasSubstr("not closed"));
  EXPECT_THAT(Refusal(""), HasSubstr("a name is missing"));
  for (const char* part : {"(", "not "}) {
    std::string deep;
    for (int n = 0; n < 100000; ++n) {
      deep += part;
    }
    EXPECT_THAT(Refusal(deep + "subject = a"), HasSubstr("more than 64 nested parts"));
  }
  EXPECT_THAT(WordsOf<InputError>([] { Holds("interp < 3", kTrial); }),
              HasSubstr("'kriging' is not a number"));
}

}  // namespace
}  // namespace semblance::problems
