// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/study_submit.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <thread>

#include "surfaces/base/atomic_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::ScratchFolder;

bool Has(const char* program) {
  return std::system(fmt::format("command -v {} > /dev/null", program).c_str()) == 0;
}

int Sh(const std::string& command) { return std::system(command.c_str()); }

std::string Output(const std::string& command, const fs::path& file) {
  Sh(fmt::format("{} > '{}' 2>&1", command, file.string()));
  return ReadFileBytes(file);
}

// A replacement of sbatch prints its arguments and returns a job number.
TEST(SubmitScript, GivesSbatchAnArrayAndAMergeThatWaitsForIt) {
  const ScratchFolder folder;
  WriteFileAtomically(
      folder / "sbatch",
      fmt::format("#!/bin/sh\nfor a in \"$@\"; do echo \"$a\"; done >> '{}'\necho '7;cluster'\n",
                  (folder / "given").string()));
  Sh(fmt::format("chmod +x '{}'", (folder / "sbatch").string()));
  const SubmitOptions options{.program = "/bin/echo",
                              .study = "/a b/it's.yaml",
                              .folder = folder / "out",
                              .shards = 4,
                              .jobs = 2,
                              .sbatch = {"--partition=long haul"}};
  WriteFileAtomically(folder / "submit.sh", SubmitScript(options));
  EXPECT_EQ(Output(fmt::format("PATH='{0}':\"$PATH\" sh '{0}/submit.sh'", folder.Path().string()),
                   folder / "said"),
            "shards: job 7;cluster; merge: job 7;cluster\n");
  const std::string given = ReadFileBytes(folder / "given");
  EXPECT_THAT(given, HasSubstr("--array=0-3\n--cpus-per-task=2\n"));
  EXPECT_THAT(given, HasSubstr("\n--partition=long haul\n--wrap='/bin/echo' study "));
  EXPECT_THAT(given, HasSubstr("\n--dependency=afterany:7\n"));
  // Runs the command of a node.
  const std::size_t at = given.find("--wrap=") + 7;
  WriteFileAtomically(folder / "wrapped.sh", given.substr(at, given.find('\n', at) - at));
  EXPECT_EQ(Output(fmt::format("SLURM_ARRAY_TASK_ID=3 sh '{}'", (folder / "wrapped.sh").string()),
                   folder / "said"),
            fmt::format("study /a b/it's.yaml --out {}/out --jobs 2 --quiet --shard 3/4\n",
                        folder.Path().string()));
}

class SlurmThorough : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const char* program : {"slurmctld", "slurmd", "sbatch", "munged"}) {
      if (!Has(program)) {
        GTEST_SKIP() << "there is no " << program
                     << " here (Debian: slurmctld slurmd slurm-client munge)";
      }
    }
    if (geteuid() != 0) {
      GTEST_SKIP() << "a Slurm of our own is started by root alone";
    }
    setenv("SLURM_CONF", (Slurm() / "slurm.conf").c_str(), 1);
    started_ = true;
    if (Sh(fmt::format("sh '{}' start '{}'", kScript, Slurm().string())) != 0) {
      GTEST_SKIP() << "Slurm's daemons cannot run here";
    }
  }
  void TearDown() override {
    if (started_) {
      Sh(fmt::format("sh '{}' stop '{}'", kScript, Slurm().string()));
    }
  }
  fs::path Slurm() const { return folder_ / "slurm"; }
  std::string Ask(const std::string& command) { return Output(command, folder_ / "answer"); }

  // Returns false if `done` does not return true within the patience of the test.
  bool Await(const std::function<bool()>& done) const {
    const Clock::time_point start = Clock::now();
    while (Clock::now() - start < patience_) {
      if (done()) {
        return true;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
    }
    return false;
  }

  using Clock = std::chrono::steady_clock;
  Clock::duration patience_ = std::chrono::minutes(4);

  static constexpr const char* kScript = SEMBLANCE_SOURCE_DIR "/tests/testing/slurm.sh";
  ScratchFolder folder_;
  bool started_ = false;
};

TEST_F(SlurmThorough, ALostNodeChangesNoByteOfTheMergedTable) {
  WriteFileAtomically(
      folder_ / "study.yaml",
      fmt::format("base: {}/configs/phantom.yaml\n"
                  "set: {{subject.rings: 40, implicit.resolution: 25, seeds.level: 0, "
                  "template.max_level: 1, fit.plan.schedule: [{{level: 0, fraction: 1}}]}}\n"
                  "subjects: [{{name: a}}, {{name: b, set: {{subject.random_seed: 2}}}}]\n"
                  "grid: {{interp: [nearest, mean], seeds.weight: [0.5, 1.0, 2.0]}}\n",
                  SEMBLANCE_SOURCE_DIR));
  const std::string run =
      fmt::format("cd '{}' && '{}' ", folder_.Path().string(), SEMBLANCE_PROGRAM);
  const Clock::time_point start = Clock::now();
  ASSERT_EQ(Sh(run + "study study.yaml --out one --quiet > one.log"), 0);
  patience_ += 8 * (Clock::now() - start);  // a sanitized build is many times slower
  ASSERT_EQ(Sh(run + "submit --slurm study.yaml --out many --shards 3 > submit.log"), 0);
  ASSERT_TRUE(
      Await([&] { return Ask("squeue -h -o '%T %N'").find("RUNNING n2") != std::string::npos; }));
  ASSERT_TRUE(Await([&] { return fs::exists(folder_ / "many" / "trials"); }));
  ASSERT_EQ(Sh(fmt::format("sh '{}' lose '{}' n2", kScript, Slurm().string())), 0);
  // Slurm delays a job of a lost node for minutes; this starts it at once.
  const auto is_done = [&] {
    Sh("scontrol update JobId=1 StartTime=now > /dev/null 2>&1");
    return fs::exists(folder_ / "many" / "report.html");
  };
  ASSERT_TRUE(Await(is_done)) << Ask("squeue; sinfo; scontrol show job");
  // The report has the seconds of each trial, so it differs from run to run.
  for (const char* file : {"trials.csv", "summary.csv", "results.sqlite"}) {
    EXPECT_TRUE(ReadFileBytes(folder_ / "one" / file) == ReadFileBytes(folder_ / "many" / file))
        << file;
  }
}

}  // namespace
}  // namespace semblance::problems
