// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/base/json_text.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "surfaces/base/error.h"
#include "tests/testing/scratch_file.h"

namespace semblance::surfaces {
namespace {

using ::testing::HasSubstr;
using testing::WordsOf;

std::string Nested(int levels, char open, char close) {
  return std::string(static_cast<std::size_t>(levels), open) +
         std::string(static_cast<std::size_t>(levels), close);
}

TEST(JsonText, IsReadToSixtyFourLevels) {
  EXPECT_NO_THROW(ParseJson(Nested(kDeepestJson, '[', ']'), "a"));
  for (const int levels : {kDeepestJson + 1, 1000, 1'000'000}) {
    EXPECT_THAT(WordsOf<IoError>([&] { ParseJson(Nested(levels, '[', ']'), "a.json"); }),
                HasSubstr("a.json: more than 64 levels"));
  }
  std::string objects = "0";
  for (int k = 0; k < kDeepestJson + 1; ++k) {
    objects = "{\"a\":" + objects + "}";
  }
  EXPECT_THROW(ParseJson(objects, "a"), IoError);
}

TEST(JsonText, BracketsInTextsAreNoLevels) {
  const std::string brackets(200, '[');
  EXPECT_EQ(ParseJson("\"" + brackets + "\"", "a"), brackets);
  EXPECT_EQ(ParseJson("[\"\\\"" + brackets + "\"]", "a")[0], "\"" + brackets);
  EXPECT_EQ(ParseJson("[\"\\\\\", []]", "a").size(), 2u);
  std::string wide = "[0";
  for (int k = 0; k < 1000; ++k) {
    wide += ",[]";
  }
  EXPECT_EQ(ParseJson(wide + "]", "a").size(), 1001u);
}

// The library compares each new entry with all others.
TEST(JsonText, AnObjectHasFourThousandEntriesAtMost) {
  const auto object = [](int entries) {
    std::string text = "{";
    for (int k = 0; k < entries; ++k) {
      text += fmt::format("{}\"a:{}\": [{{}}]", k > 0 ? "," : "", k);
    }
    return text + "}";
  };
  EXPECT_EQ(ParseJson("[" + object(4000) + "," + object(1) + "]", "a").size(), 2u);
  EXPECT_THAT(WordsOf<IoError>([&] { ParseJson(object(1'000'000), "a.json"); }),
              HasSubstr("a.json: an object of more than 4000 entries"));
}

TEST(JsonText, InvalidJsonIsReported) {
  for (const char* const text : {"", "{", "[1,]", "nan", "\"\xff\"", "]]}[", "::"}) {
    EXPECT_THAT(WordsOf<IoError>([&] { ParseJson(text, "a.json"); }),
                HasSubstr("a.json: this is not JSON"));
  }
  EXPECT_THAT(WordsOf<IoError>([] { ParseJson(std::string_view("{}\0{}", 5), "a.json"); }),
              HasSubstr("a.json: this is not JSON: byte 3 is zero"));
}

}  // namespace
}  // namespace semblance::surfaces
