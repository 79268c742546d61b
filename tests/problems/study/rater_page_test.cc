// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/rater_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/csv.h"
#include "surfaces/base/error.h"
#include "tests/testing/scratch_folder.h"
#include "tests/testing/small_runs.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

class RaterPages : public ::testing::Test {
 protected:
  RaterPages() {
    for (const char* name : {"anna", "berta", "clara", "doris"}) {
      testing::WriteSmallRun(scratch_ / name, 60 + 5.0 * static_cast<double>(runs_.size()));
      runs_.push_back(scratch_ / name);
    }
  }

  RaterPageOptions Options() const {
    return {.runs = {runs_[0], runs_[1]}, .others = {runs_[2], runs_[3]}, .pool = 3};
  }

  std::string Write(const char* name, const std::string& text) {
    WriteFileAtomically(scratch_ / name, text);
    return (scratch_ / name).string();
  }

  testing::ScratchFolder scratch_;
  std::vector<fs::path> runs_;
};

nlohmann::json DataOf(const std::string& html) {
  const std::string start = "id=\"data\">";
  const std::size_t at = html.find(start) + start.size();
  return nlohmann::json::parse(html.substr(at, html.find("</script>", at) - at));
}

TEST_F(RaterPages, EachPoolHasTheRightPersonOnceAndOthers) {
  const RaterPage page = MakeRaterPage(Options(), {});
  const nlohmann::json data = DataOf(page.html);
  EXPECT_EQ(data["pictures"].size(), 4u + 2u);
  ASSERT_EQ(data["questions"].size(), 2u);
  std::map<std::string, std::set<std::string>> persons;
  std::map<std::string, int> own;
  std::set<std::string> asked;
  CsvReader key(page.key, "key");
  while (key.NextRow()) {
    const std::string question(key.Cell(0)), person(key.Cell(2));
    EXPECT_TRUE(persons[question].insert(person).second);
    if (key.Cell(3) == "1") {
      ++own[question];
      asked.insert(person);
    }
  }
  EXPECT_EQ(asked, (std::set<std::string>{"anna", "berta"}));
  for (const nlohmann::json& question : data["questions"]) {
    EXPECT_EQ(question["candidates"].size(), 3u);
    EXPECT_EQ(persons[question["id"]].size(), 3u);
    EXPECT_EQ(own[question["id"]], 1);
  }
}

// A person has one picture, in whatever pool.
TEST_F(RaterPages, TheKeyIsThatOfThePictures) {
  const RaterPage page = MakeRaterPage(Options(), {});
  const nlohmann::json data = DataOf(page.html);
  std::map<std::string, int> picture_of;
  std::map<std::pair<std::string, std::string>, int> shown;
  for (const nlohmann::json& question : data["questions"]) {
    for (const nlohmann::json& candidate : question["candidates"]) {
      shown[{question["id"], candidate["code"]}] = candidate["picture"];
    }
  }
  CsvReader key(page.key, "key");
  while (key.NextRow()) {
    const int picture = shown.at({std::string(key.Cell(0)), std::string(key.Cell(1))});
    const auto [known, is_new] = picture_of.try_emplace(std::string(key.Cell(2)), picture);
    EXPECT_EQ(known->second, picture);
  }
  std::set<int> different;
  for (const auto& [person, picture] : picture_of) {
    different.insert(picture);
  }
  EXPECT_EQ(different.size(), picture_of.size());
}

TEST_F(RaterPages, ThePageNamesNobodyAndIsTheSameForOneSeed) {
  const RaterPage page = MakeRaterPage(Options(), {});
  EXPECT_THAT(page.html, AllOf(Not(HasSubstr("anna")), Not(HasSubstr("berta")),
                               Not(HasSubstr("SEMBLANCE_RATER_DATA"))));
  RunContext threads;
  threads.threads = 3;
  const RaterPage again = MakeRaterPage(Options(), threads);
  EXPECT_EQ(again.html, page.html);
  EXPECT_EQ(again.key, page.key);
  RaterPageOptions other = Options();
  other.random_seed = 2;
  EXPECT_NE(MakeRaterPage(other, {}).key, page.key);
}

TEST_F(RaterPages, RefusesPoolsAndFoldersThatCannotBe) {
  RaterPageOptions options = Options();
  options.pool = 5;
  EXPECT_THAT([&] { MakeRaterPage(options, {}); },
              ThrowsMessage<InputError>(HasSubstr("there are 4")));
  options = Options();
  options.others[0] = runs_[0];
  EXPECT_THAT([&] { MakeRaterPage(options, {}); }, ThrowsMessage<InputError>(HasSubstr("'anna'")));
  options = Options();
  options.runs[0] = scratch_ / "none";
  EXPECT_THAT([&] { MakeRaterPage(options, {}); },
              ThrowsMessage<IoError>(HasSubstr("not the folder of a run")));
}

TEST_F(RaterPages, AnswersAreRead) {
  const std::string key =
      Write("key.csv",
            "question,candidate,person,is_own\nq1,a,anna,0\nq1,b,berta,1\nq2,a,anna,1\nq2,b,"
            "clara,0\n");
  const std::string one = Write("one.csv",
                                "rater,question,candidate,rank\nR,q1,b,1\nR,q1,a,2\nR,q2,b,1\nR,q2,"
                                "a,2\n");
  const std::string two =
      Write("two.csv", "rater,question,candidate,rank\n\"S, T\",q1,a,1\n\"S, T\",q1,b,2\n");
  const auto questions = ReadRaterAnswers(key, {one, two});
  ASSERT_EQ(questions.size(), 2u);
  EXPECT_EQ(questions[0].own, 1);
  EXPECT_EQ(questions[0].ranks, (std::vector<std::vector<int>>{{2, 1}, {1, 2}}));
  EXPECT_EQ(questions[1].own, 0);
  EXPECT_EQ(questions[1].ranks, (std::vector<std::vector<int>>{{2, 1}}));
  const RaterStatistics s = SummarizeRaters(questions);
  EXPECT_EQ(s.hits, 1);
  EXPECT_EQ(s.answers, 3);
  EXPECT_THAT(RaterStatisticsCsv(s), HasSubstr("hits,1\n"));
}

TEST_F(RaterPages, WrongAnswersNameTheirLine) {
  const std::string key =
      Write("key.csv", "question,candidate,person,is_own\nq1,a,anna,0\nq1,b,berta,1\n");
  const auto read = [&](const std::string& rows) {
    return [this, key, rows] {
      ReadRaterAnswers(key, {Write("x.csv", "rater,question,candidate,rank\n" + rows)});
    };
  };
  EXPECT_THAT(read("R,q1,a,1\nR,q9,a,2\n"),
              ThrowsMessage<IoError>(AllOf(HasSubstr("x.csv:3"), HasSubstr("'q9'"))));
  EXPECT_THAT(read("R,q1,z,1\n"), ThrowsMessage<IoError>(HasSubstr("no candidate 'z'")));
  EXPECT_THAT(read("R,q1,a,1\nR,q1,a,2\n"), ThrowsMessage<IoError>(HasSubstr("twice")));
  EXPECT_THAT(read("R,q1,a,1.5\n"), ThrowsMessage<IoError>(HasSubstr("whole number")));
  EXPECT_THAT(read("R,q1,a,1\n"), ThrowsMessage<InputError>(HasSubstr("only a part")));
}

}  // namespace
}  // namespace semblance::problems
