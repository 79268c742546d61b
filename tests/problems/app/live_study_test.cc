// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/live_study.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>

#include "surfaces/base/atomic_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::ScratchFolder;

constexpr const char* kPlan =
    R"({"title": "a study", "hash": "h", "metric": "face.rms_mm", "axes": ["interp"], "notes": [],)"
    R"("trials": [{"id": "a1", "subject": "s", "values": ["mean"]}]})";

class LiveStudyTest : public ::testing::Test {
 protected:
  void WritePlan() {
    std::filesystem::create_directories(folder_ / "out");
    WriteFileAtomically(folder_ / "out" / "plan.json", kPlan);
  }
  PageReply Get(const std::string& path) { return live_.Answer({"GET", path, {}, {}}); }
  nlohmann::json State() { return nlohmann::json::parse(Get("api/state").body); }

  ScratchFolder folder_;
  LiveStudy live_{"a <study>", folder_ / "out"};
};

TEST_F(LiveStudyTest, ThePageLoadsItsFilesFromTheServer) {
  const PageReply page = Get("");
  EXPECT_EQ(page.status, 200);
  EXPECT_THAT(page.body, AllOf(HasSubstr("href=\"report.css\""), HasSubstr("src=\"study.js\"")));
  for (const char* file : {"report.css", "study.js"}) {
    EXPECT_EQ(Get(file).status, 200) << file;
    EXPECT_FALSE(Get(file).body.empty()) << file;
  }
  EXPECT_EQ(Get("trials/../../secret").status, 404);
  EXPECT_EQ(live_.Answer({"POST", "api/state", {}, {}}).status, 405);
}

TEST_F(LiveStudyTest, TheStateFollowsTheStudy) {
  EXPECT_EQ(State()["title"], "a <study>");
  EXPECT_EQ(State()["over"], false);
  live_.Update({.trials = 8, .finished = 3, .failed = 0}, "s | mean: done");
  live_.Update({.trials = 8, .finished = 4, .failed = 1}, "s | nearest: failed");
  const nlohmann::json state = State();
  EXPECT_EQ(state["finished"], 4);
  EXPECT_EQ(state["trials"], 8);
  EXPECT_THAT(state["failed"], ElementsAre("s | nearest: failed"));
  live_.End();
  EXPECT_EQ(State()["over"], true);
}

TEST_F(LiveStudyTest, TheReportIsThatOfTheFolderSoFar) {
  EXPECT_EQ(Get("run/report.html").status, 500) << "there is no plan yet";
  WritePlan();
  live_.Update({.trials = 1, .finished = 0, .failed = 0}, "");
  const PageReply report = Get("run/report.html");
  EXPECT_EQ(report.status, 200);
  EXPECT_THAT(report.body, HasSubstr("1 trial is not run yet"));
}

// A page that has asked gets its last report before the program ends; without a page there is
// nothing to wait for.
TEST_F(LiveStudyTest, TheEndWaitsForAnOpenPageAlone) {
  WritePlan();
  live_.End();
  auto start = steady_clock::now();
  live_.WaitForPage(milliseconds(60000));
  EXPECT_LT(steady_clock::now() - start, milliseconds(5000));
  start = steady_clock::now();
  Get("run/report.html");  // the study ended after the state that the page has: it will ask again
  std::jthread page([&] {
    std::this_thread::sleep_for(milliseconds(100));
    State();
    Get("run/report.html");
  });
  live_.WaitForPage(milliseconds(60000));
  EXPECT_GE(steady_clock::now() - start, milliseconds(90));
  EXPECT_LT(steady_clock::now() - start, milliseconds(30000));
}

}  // namespace
}  // namespace semblance::problems
