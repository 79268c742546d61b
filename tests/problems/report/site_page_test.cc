// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/site_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <set>
#include <sstream>

#include "problems/subject/sites.h"
#include "surfaces/base/atomic_file.h"

namespace semblance::problems {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

const std::string kSource = SEMBLANCE_SOURCE_DIR;

// Every table that ships, in the order in which the shell lists configs/tables/*.yaml.
std::vector<TissueTable> Tables() {
  std::set<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(kSource + "/configs/tables")) {
    if (entry.path().extension() == ".yaml") {
      paths.insert(entry.path());
    }
  }
  std::vector<TissueTable> tables;
  std::ranges::transform(paths, std::back_inserter(tables), [](const std::filesystem::path& path) {
    return ReadTissueTable(path.string());
  });
  return tables;
}

std::string LineOf(const std::string& page, const std::string& begin) {
  std::istringstream lines(page);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(begin)) {
      return line;
    }
  }
  return "";
}

TEST(SitePage, ThePageInTheDocsIsTheOneThatTheProgramMakes) {
  EXPECT_EQ(ReadFileBytes(kSource + "/docs/reference/sites.md"), SitePage(Tables(), "sites.svg"))
      << "make it again: semblance landmarks page configs/tables/*.yaml --out docs/reference "
         "--force";
  EXPECT_GT(ReadFileBytes(kSource + "/docs/reference/sites.svg").size(), 10000u);
}

TEST(SitePage, EachSiteStandsThereOnceWithTheTablesThatHaveIt) {
  const std::vector<TissueTable> tables = Tables();
  const std::string page = SitePage(tables, "sites.svg");
  for (const auto* const list : {&StandardSites(), &FurtherSites()}) {
    for (const Site& site : *list) {
      const std::string line =
          LineOf(page, site.side == Side::kMidline ? "| `" + site.code + "` |"
                                                   : "| `" + site.landmark + "_l` `");
      ASSERT_NE(line, "") << site.code;
      EXPECT_THAT(line, HasSubstr(std::string(site.name)));
      for (const TissueTable& table : tables) {
        const bool has = std::ranges::count(table.rows, site.landmark, &TissueRow::site) > 0;
        EXPECT_EQ(line.find(table.id) != std::string::npos, has) << line;
      }
    }
  }
}

TEST(SitePage, EveryRowOfTheTablesIsASiteOfThePage) {
  const std::string page = SitePage(Tables(), "sites.svg");
  for (const TissueTable& table : Tables()) {
    for (const TissueRow& row : table.rows) {
      EXPECT_TRUE(page.find("`" + row.site + "`") != std::string::npos ||
                  page.find("`" + row.site + "_l`") != std::string::npos)
          << table.id << ": " << row.site;
    }
  }
}

}  // namespace
}  // namespace semblance::problems
