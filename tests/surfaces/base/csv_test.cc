// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/base/csv.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "surfaces/base/error.h"
#include "surfaces/base/geometry.h"

namespace semblance::surfaces {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// The error message of reading the whole text with all cells as numbers.
std::string CsvFault(std::string_view text) {
  try {
    CsvReader csv(text, "t.csv");
    while (csv.NextRow()) {
      for (std::size_t k = 0; k < csv.Columns().size(); ++k) {
        csv.Number(k);
      }
    }
  } catch (const IoError& error) {
    return error.what();
  }
  return "";
}

TEST(Csv, AWrittenTableIsReadBackExactly) {
  const std::vector<double> numbers = {0.1, 1.0 / 3, 1e-300, -1e23, 5e-324, 12345678.9, -0.0};
  const std::vector<std::string> texts = {"plain",    "a, b", "say \"x\"", "two\nlines",
                                          " padded ", "",     "\r"};
  CsvWriter writer({"text", "number", "count"});
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    writer.Row(texts[k], numbers[k], k);
  }
  CsvReader reader(writer.Text(), "t.csv");
  EXPECT_THAT(reader.Columns(), ElementsAre("text", "number", "count"));
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    ASSERT_TRUE(reader.NextRow());
    EXPECT_EQ(reader.Cell(0), texts[k]);
    EXPECT_EQ(reader.Number(1), numbers[k]);
    EXPECT_EQ(std::signbit(reader.Number(1)), std::signbit(numbers[k]));
    EXPECT_EQ(reader.Number(2), static_cast<double>(k));
  }
  EXPECT_FALSE(reader.NextRow());
}

TEST(Csv, AMissingNumberIsAnEmptyCell) {
  CsvWriter writer({"a", "b", "c", "d"});
  writer.Row(kNaN, std::numeric_limits<double>::infinity(), std::optional<double>(), true);
  EXPECT_EQ(writer.Text(), "a,b,c,d\n,,,1\n");
  CsvReader reader(writer.Text(), "t.csv");
  ASSERT_TRUE(reader.NextRow());
  EXPECT_TRUE(std::isnan(reader.NumberOrNan(0)));
  EXPECT_EQ(reader.NumberOrNan(3), 1);
}

TEST(Csv, ReadsTablesOfSpreadsheets) {
  CsvReader reader(
      "\xEF\xBB\xBF"
      "a, b\r\n 1 ,\"2\" \r\n+3,-4e1",
      "t.csv");
  ASSERT_TRUE(reader.NextRow());
  EXPECT_EQ(reader.Number(reader.RequireColumn("b")), 2);
  ASSERT_TRUE(reader.NextRow());
  EXPECT_EQ(reader.Number(0), 3);
  EXPECT_EQ(reader.Number(1), -40);
  EXPECT_FALSE(reader.NextRow());
}

TEST(Csv, FaultsNameTheirLine) {
  EXPECT_EQ(CsvFault("a,b\n1,2\n3\n"),
            "t.csv:3: 1 entries for 2 columns; give one entry per column");
  EXPECT_EQ(CsvFault("a,b\n\n"), "t.csv:2: the line is empty; leave it out");
  EXPECT_EQ(CsvFault("a,b,a\n"), "t.csv:1: the column 'a' appears twice; leave one out");
  EXPECT_THAT(CsvFault("a\n1\n\"2\n3"), HasSubstr("t.csv:3: a quote begins here"));
  EXPECT_THAT(CsvFault("a\n\"2\"3\n"), HasSubstr("t.csv:2: text follows a closing quote"));
  for (const char* bad : {"nan", "inf", "1e999", "x", "0x1", "1 2", "\"1\n2\""}) {
    EXPECT_THAT(CsvFault(std::string("a\n1\n") + bad + "\n"), HasSubstr("t.csv:3: column 'a'"));
  }
  EXPECT_THAT(CsvFault("a\n\"1\n\"\n"), HasSubstr("t.csv:2: column 'a'"));
  CsvReader reader("a,b\n", "t.csv");
  EXPECT_THROW(reader.RequireColumn("c"), IoError);
}

// Half a million names are compared by a set, not pair by pair.
TEST(Csv, ManyColumnNamesAreComparedQuickly) {
  std::string names = "c";
  for (int k = 0; k < 500'000; ++k) {
    names += ",c" + std::to_string(k);
  }
  EXPECT_EQ(CsvReader(names + "\n", "t.csv").Columns().size(), 500'001u);
  EXPECT_EQ(CsvFault(names + ",c7\n"), "t.csv:1: the column 'c7' appears twice; leave one out");
}

TEST(Csv, ALineAfterABreakInACellHasItsOwnNumber) {
  EXPECT_THAT(CsvFault("\"two\nlines\"\nx\n"), HasSubstr("t.csv:3: column 'two\nlines'"));
}

}  // namespace
}  // namespace semblance::surfaces
