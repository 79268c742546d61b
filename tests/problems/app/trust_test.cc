// SPDX-License-Identifier: GPL-3.0-or-later
// The program under adverse conditions: kills, signals, a second process, no memory, a full disk,
// strange names and files. No test may crash the program or lose a file.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "surfaces/base/atomic_file.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "tests/testing/ct_phantom.h"
#include "tests/testing/program_call.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::Outcome;
using testing::ScratchFolder;
using Clock = std::chrono::steady_clock;

const std::string kPhantom = SEMBLANCE_SOURCE_DIR "/configs/phantom.yaml";
// Runs a second or less.
const std::string kDepth = "depth " + kPhantom + " --set subject.rings=20 --quiet";

#ifdef SEMBLANCE_SANITIZED
constexpr bool kMemoryHasLimits = false;  // a sanitizer ignores the limits
#else
constexpr bool kMemoryHasLimits = true;
#endif

double SecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

class Trust : public ::testing::Test {
 protected:
  Outcome Call(const std::string& arguments, const std::string& before = "") {
    return testing::CallProgram(folder_, arguments, before);
  }

  // Expects one line of error, this exit code, and no folder `out`.
  void ExpectRefused(const std::string& arguments, const std::string& words, int code = 2,
                     const std::string& before = "") {
    const Outcome outcome = Call(arguments, before);
    EXPECT_EQ(outcome.code, code) << arguments << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(words));
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_LT(outcome.err.size(), 3000u);
    EXPECT_FALSE(fs::exists(folder_ / "out")) << arguments;
  }

  void Write(const std::string& name, const std::string& text) {
    fs::create_directories((folder_ / name).parent_path());
    WriteFileAtomically(folder_ / name, text);
  }

  // Starts the program in the folder with these arguments and does not wait for it.
  pid_t Start(const std::vector<std::string>& words) {
    const std::string folder = folder_.Path().string();
    std::vector<char*> argv = {const_cast<char*>("semblance")};
    for (const std::string& word : words) {
      argv.push_back(const_cast<char*>(word.c_str()));
    }
    argv.push_back(nullptr);
    const pid_t child = ::fork();
    if (child == 0) {
      const bool ready = ::chdir(folder.c_str()) == 0 && std::freopen("/dev/null", "w", stderr);
      ::execv(SEMBLANCE_PROGRAM, argv.data());
      ::_exit(ready ? 127 : 126);
    }
    return child;
  }

  void WaitFor(const fs::path& path) {
    const Clock::time_point start = Clock::now();
    while (!fs::exists(path) && SecondsSince(start) < 60) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    ASSERT_TRUE(fs::exists(path)) << path;
  }

  // Waits until the program has installed its handler. An earlier signal would end it at once.
  static void WaitUntilCaught(pid_t child, int signal) {
    const Clock::time_point start = Clock::now();
    while (!Catches(child, signal) && SecondsSince(start) < 60) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    ASSERT_TRUE(Catches(child, signal));
  }

  // Reads the kernel's bit mask of caught signals of the process; the lowest bit is signal 1.
  static bool Catches(pid_t child, int signal) {
    std::ifstream status(fmt::format("/proc/{}/status", child));
    for (std::string line; std::getline(status, line);) {
      if (line.starts_with("SigCgt:")) {
        return (std::stoull(line.substr(7), nullptr, 16) >> (signal - 1) & 1) != 0;
      }
    }
    return false;
  }

  static int ExitCode(pid_t child) {
    int status = 0;
    ::waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }

  ScratchFolder folder_;
};

// ------------------------------------------------------------------ no files are lost

TEST_F(Trust, ASecondProcessOnAFolderIsRefused) {
  const pid_t first = Start({"run", kPhantom, "--out", "out", "--quiet"});
  WaitFor(folder_ / ".out.semblance-part");
  for (const std::string force : {"", " --force"}) {
    const Outcome second = Call(kDepth + " --out out" + force);
    EXPECT_EQ(second.code, 2);
    EXPECT_THAT(second.err, HasSubstr("out: another process is writing it"));
  }
  ::kill(first, SIGKILL);
  ExitCode(first);
  EXPECT_EQ(Call(kDepth + " --out out").code, 0) << "a dead process holds nothing";
}

TEST_F(Trust, ARefusalLeavesNoFolder) {
  ExpectRefused(kDepth + " --out out/a/b --set landmarks.max_distance_mm=0", "max_distance_mm");
}

// An incomplete CT would be read as a shorter one.
TEST_F(Trust, EachCommandLeavesNothingAfterARefusal) {
  Write("bad.ply", "no mesh");
  Write("b.yaml",
        "base: " + kPhantom + "\nsubject: {type: files, skull: bad.ply, landmarks: none.yaml}\n");
  Write("study.yaml", "base: " + kPhantom + "\nset: {subject.rings: 16}\n");
  Write("full/a.txt", "mine");
  fs::create_directories(folder_ / "empty");
  Call("status none");  // makes the files of its output
  const auto names = [&] {
    std::vector<fs::path> all;
    for (const auto& entry : fs::recursive_directory_iterator(folder_.Path())) {
      all.push_back(entry.path());
    }
    std::ranges::sort(all);
    return all;
  };
  const std::vector<fs::path> before = names();
  for (const char* call :
       {"run b.yaml --out out/a --quiet", "depth b.yaml --out out/a --quiet",
        "study study.yaml --out out/a --cache bad.ply/c --quiet",
        "study study.yaml --out bad.ply --cache out/c --quiet", "fit bad.ply --out out/a --quiet",
        "import-ct bad.ply --out out/a", "import-ct empty --out out/a",
        "template bad.ply --out out/a --quiet", "phantom --out out/a --volume x.docx",
        "population empty --out out/a", "landmarks propose bad.ply --out out/a.yaml --quiet",
        "landmarks page bad.ply --out out/a", "merge out/a full", "merge out/a", "report full",
        "recentre b.yaml --out out/a", "workbench b.yaml --out out/a",
        "workbench bad.ply --out out/a", "workbench bad.ply --out empty"}) {
    const Outcome outcome = Call(call);
    EXPECT_EQ(outcome.code, 2) << call << outcome.err;
    EXPECT_EQ(names(), before) << call;
  }
}

// Somebody else has put links into a shared folder.
TEST_F(Trust, NoLinkInAFolderLeadsAFileElsewhere) {
  Write("elsewhere/precious", "mine");
  Write("study.yaml",
        "base: " + kPhantom + "\nset: {subject.rings: 16, implicit.resolution: 20}\n");
  fs::create_directories(folder_ / "s");
  fs::create_directory_symlink(folder_ / "elsewhere", folder_ / "s/trials");
  const Outcome study = Call("study study.yaml --out s --quiet");
  EXPECT_EQ(study.code, 2);
  EXPECT_THAT(study.err, HasSubstr("s/trials: it is a link"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "s"), {}), 1);
  fs::create_directories(folder_ / "d");
  fs::create_symlink(folder_ / "elsewhere/precious", folder_ / "d/depth.ply");
  EXPECT_EQ(Call(kDepth + " --out d --force").code, 0);
  EXPECT_FALSE(fs::is_symlink(folder_ / "d/depth.ply"));
  EXPECT_EQ(ReadFileBytes(folder_ / "elsewhere/precious"), "mine");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "elsewhere"), {}), 1);
}

TEST_F(Trust, AKilledPhantomLeavesNoPartOfAHead) {
  const pid_t child =
      Start({"phantom", "--head", "smooth", "--out", "out", "--pixel-mm", "2", "--slice-mm", "3"});
  WaitFor(folder_ / ".out.semblance-part");
  ::kill(child, SIGKILL);
  ExitCode(child);
  EXPECT_FALSE(fs::exists(folder_ / "out"));
  EXPECT_EQ(Call("phantom --head smooth --out out --pixel-mm 5 --slice-mm 10").code, 0);
  EXPECT_FALSE(fs::exists(folder_ / ".out.semblance-part"));
  EXPECT_TRUE(fs::exists(folder_ / "out/landmarks.yaml"));
}

TEST_F(Trust, AFullDiskLeavesNoFolderAndTheOldFiles) {
  const std::string small_disk = "ulimit -f 20;";  // in blocks of 512 or 1024 bytes
  ExpectRefused(kDepth + " --out out", "cannot be written: File too large", 2, small_disk);
  ASSERT_EQ(Call(kDepth + " --out old").code, 0);
  const std::string before = ReadFileBytes(folder_ / "old/result.json");
  EXPECT_EQ(Call(kDepth + " --set interp=nearest --out old --force", small_disk).code, 2);
  EXPECT_EQ(ReadFileBytes(folder_ / "old/result.json"), before);
  EXPECT_FALSE(fs::exists(folder_ / "old/.semblance-part"));
}

TEST_F(Trust, OneNameForTwoOutputsIsRefused) {
  Write("face.json", "{}");
  Write("script.yaml", "edits: []\n");
  ExpectRefused("edit face.json script.yaml --out out --inverse ./out", "name the same file");
}

// ------------------------------------------------------------------ no exception escapes

TEST_F(Trust, InvalidNamesGiveOneLineOfError) {
  const std::string name(300, 'a');
  fs::create_symlink("loop", folder_ / "loop");
  for (const std::string& bad : {name, std::string("loop"), std::string("''")}) {
    for (const std::string command :
         {"run {} --out out", "study {}", "check {}", "status {}", "merge {}", "merge new {}",
          "report {}", "evaluate {} {}", "edit {} {} --out out", "export {} --to out.ply",
          "feature list {}", "template {}", "import-ct {} --out out", "fit {} {} --out out",
          "landmarks convert {} out.yaml"}) {
      ExpectRefused(fmt::format(fmt::runtime(command), bad, bad), "");
    }
  }
}

TEST_F(Trust, AStudysFilesMayHoldAnythingThorough) {
  const std::vector<std::string> contents = {
      "",
      "{",
      "[]",
      "3",
      "\"x\"",
      std::string(100000, '['),
      R"({"hash": 7})",
      R"({"title": 1, "hash": 2, "metric": [], "axes": {}, "notes": 3, "trials": 7})",
      R"({"title": "t", "hash": "h", "metric": "m", "axes": [], "notes": [],
          "trials": [{"id": "a", "subject": "p", "values": ["more than axes"]}]})"};
  Write("study.yaml", fmt::format("base: {}\ngrid: {{rounds: [1, 2]}}\n", kPhantom));
  for (const std::string& content : contents) {
    Write("s/plan.json", content);
    for (const std::string command :
         {"status s", "merge s", "report s", "merge new s", "study study.yaml --out s"}) {
      ExpectRefused(command, "s", 2);
    }
  }
  Write("s/plan.json", R"({"title": "t", "hash": "h", "metric": "m", "axes": [], "notes": [],
      "trials": [{"id": "a", "subject": "p", "values": []}]})");
  for (const std::string& content :
       {std::string(R"({"id": 1})"), std::string(R"({"id": "a", "status": [], "reason": {}})"),
        std::string(R"({"id": "a", "status": "done", "result": {"fit": {"levels": [3]}}})"),
        std::string(R"({"id": "a", "status": "done", "result": [1]})"), contents[5]}) {
    Write("s/trials/a/trial.json", content);
    for (const std::string command : {"status s", "merge s", "report s", "merge new s"}) {
      EXPECT_THAT(Call(command).code, AnyOf(0, 1)) << command << content.substr(0, 80);
    }
    const auto told = Call("merge s"), quiet = Call("merge s --quiet");
    EXPECT_EQ(quiet.code, told.code);
    EXPECT_NE(told.out, "");
    EXPECT_EQ(quiet.out, "");
    fs::remove_all(folder_ / "new");
  }
}

TEST_F(Trust, LackOfMemoryIsReportedWithARemedy) {
  if (!kMemoryHasLimits) {
    GTEST_SKIP();
  }
  ExpectRefused("run " + kPhantom + " --out out --quiet --threads 1 --set subject.rings=1000",
                "not enough memory for the step 'load subject'; give meshes", 1,
                "ulimit -v 300000;");
}

// The constructors of the libraries run out of memory before the program's first line.
TEST_F(Trust, LackOfMemoryBeforeMainIsReportedToo) {
  if (!kMemoryHasLimits) {
    GTEST_SKIP();
  }
  const auto with = [&](int megabytes) {
    return Call("--version", fmt::format("ulimit -v {};", 1024 * megabytes));
  };
  int enough = 512, too_little = 64;
  while (enough - too_little > 1) {
    const int half = (enough + too_little) / 2;
    (with(half).code == 0 ? enough : too_little) = half;
  }
  for (int megabytes = enough - 1; megabytes > enough - 8; --megabytes) {
    const Outcome outcome = with(megabytes);
    EXPECT_THAT(outcome.code, AnyOf(1, 126, 127))
        << megabytes;  // 126 and 127 come from the system's loader
    // The second message comes from the Fortran runtime of some BLAS, which starts before main.
    if (outcome.code == 1) {
      EXPECT_THAT(outcome.err, AnyOf(HasSubstr("semblance: not enough memory"),
                                     HasSubstr("Cannot allocate memory")));
    }
  }
}

TEST_F(Trust, AStudyContinuesAfterATrialRunsOutOfMemoryThorough) {
  if (!kMemoryHasLimits) {
    GTEST_SKIP();
  }
  Write("study.yaml", fmt::format("base: {}\nset: {{implicit.resolution: 16, seeds.level: 0, "
                                  "template.max_level: 1, first_fit: []}}\n"
                                  "grid: {{fit.plan.schedule: [[{{level: 0, fraction: 1}}]], "
                                  "subject.rings: [1000, 24]}}\n",
                                  kPhantom));
  const Outcome outcome = Call("study study.yaml --out s --quiet", "ulimit -v 500000;");
  EXPECT_EQ(outcome.code, 1) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("1 of 2 trials done, 0 unusable, 1 failed"));
  EXPECT_THAT(outcome.out, HasSubstr("not enough memory"));
}

TEST_F(Trust, AFullStandardOutputIsAnError) {
  Write("stdout.txt", "");
  for (const std::string& command : {std::string("options"), std::string("--help"),
                                     std::string("--version"), kDepth + " --out full"}) {
    const Outcome outcome = Call("2> stderr.txt " + command + " > /dev/full #");
    EXPECT_EQ(outcome.code, 1) << command;
    EXPECT_THAT(outcome.err, HasSubstr("standard output")) << command;
  }
}

// ------------------------------------------------------------------ signals

TEST_F(Trust, ASignalEndsALongRunWithinASecondWithoutFiles) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const pid_t child = Start({"run", kPhantom, "--out", "out", "--quiet", "--threads", "1",
                               "--set", "implicit.resolution=300"});
    WaitFor(folder_ / ".out.semblance-part");
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    const Clock::time_point start = Clock::now();
    ::kill(child, signal);
    EXPECT_EQ(ExitCode(child), 1);
    EXPECT_LT(SecondsSince(start), 1.5);
    EXPECT_FALSE(fs::exists(folder_ / "out"));
  }
}

// Nobody writes into the pipe, so the reader never returns.
TEST_F(Trust, AHangingReaderEndsAfterASecondOrAtASecondSignal) {
  ASSERT_EQ(::mkfifo((folder_ / "pipe.yaml").c_str(), 0600), 0);
  const auto start_reader = [&] {
    const pid_t child = Start({"check", "pipe.yaml"});
    WaitUntilCaught(child, SIGINT);
    WaitUntilCaught(child, SIGTERM);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));  // until it waits for the pipe
    return child;
  };
  pid_t child = start_reader();
  Clock::time_point start = Clock::now();
  ::kill(child, SIGTERM);
  EXPECT_EQ(ExitCode(child), 1);
  EXPECT_LT(SecondsSince(start), 1.5);

  child = start_reader();
  start = Clock::now();
  ::kill(child, SIGINT);
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  ::kill(child, SIGTERM);
  EXPECT_EQ(ExitCode(child), 1);
  EXPECT_LT(SecondsSince(start), 0.6);
}

// ------------------------------------------------------------------ faults are reported

TEST_F(Trust, NumbersOfTheCommandLineAreFinite) {
  for (const std::string number : {"nan", "inf", "-inf", "NAN"}) {
    for (const std::string option :
         {"import-ct x.inv3 --bone-hu={}", "import-ct x.inv3 --skin-hu={}",
          "export f.json --to out.ply --chord_mm={}", "template a.ply b.csv --tolerance_mm={}",
          "feature extract f.json --name a --library l --u 0 {}",
          "feature blend a.json --name a --library l --weights {}"}) {
      ExpectRefused(fmt::format(fmt::runtime(option), number), "is not a finite number");
    }
  }
}

TEST_F(Trust, AShardIsTwoNumbersThatFit) {
  Write("study.yaml", fmt::format("base: {}\ngrid: {{rounds: [1, 2]}}\n", kPhantom));
  for (const std::string shard :
       {"0/99999999999", "4294967296/4294967297", "0/", "/2", "1", "0/2/3", "-1/2", "2/2", "a/b"}) {
    ExpectRefused("study study.yaml --out out --shard=" + shard, "write I/N with 0 <= I < N");
  }
}

// Faults without a place in the file name it too, because `check` may read many files.
TEST_F(Trust, AnImpossibleCacheFolderIsReported) {
  Write("study.yaml",
        fmt::format("base: {}\njob: depth\ngrid: {{interp: [nearest, mean]}}\nmetric: "
                    "depth_truth.along_direction.rms_mm\n",
                    kPhantom));
  ExpectRefused("study study.yaml --out out --cache study.yaml",
                "study.yaml: no folder for the cache");
}

TEST_F(Trust, CheckNamesTheFileOfEachFault) {
  Write("volume.yaml", "subject: {type: ct}\n");
  Write("fit.yaml", "patches_u: 4\n");
  const Outcome outcome = Call("check fit.yaml volume.yaml nosuch.yaml");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("volume.yaml: subject.volume: no file is named"));
  EXPECT_THAT(outcome.err, HasSubstr("\nnosuch.yaml: "));
  EXPECT_EQ(outcome.out, "fit.yaml: no fault found\n");
}

// The keys belong to experiments and to fits. The file is sound as a fit; faults of the experiment
// are printed as a warning.
TEST_F(Trust, CheckAcceptsAFitThatIsNotAnExperiment) {
  Write("either.yaml", "fit: {plan: {type: adaptive, finest: 4}}\n");
  const Outcome outcome = Call("check either.yaml");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out,
              HasSubstr("either.yaml: warning: it is a configuration of `semblance fit`"));
  EXPECT_THAT(outcome.out, HasSubstr("level 4 is finer than the surface"));
}

TEST_F(Trust, ALongMessageIsCut) {
  ExpectRefused("check " + kPhantom + " --set " + std::string(90'000, 'a') + "=1",
                "bytes left out");
  std::string deep = "a";
  for (int k = 0; k < 30'000; ++k) {
    deep += ".a";
  }
  ExpectRefused("check " + kPhantom + " --set " + deep + "=1", "more than 64 steps");
}

TEST_F(Trust, AResultThatIsNotANumberIsReportedAsNotUsable) {
  std::string csv = "x,y,z,weight\n";
  for (int k = 0; k < 100; ++k) {
    csv += fmt::format("{},{},{},1e308\n", k % 10, k / 10, (k * k) % 7);
  }
  Write("points.csv", csv);
  Write("fit.yaml",
        "parameters: plane\npatches_u: 4\npatches_v: 4\n"
        "fit: {terms: [points], plan: {type: adaptive, tolerance_mm: 0.1}}\n");
  ExpectRefused("fit points.csv --out auto --quiet", "weights add up to no finite number");
  const Outcome outcome = Call("fit points.csv fit.yaml --out out --quiet");
  EXPECT_EQ(outcome.code, 1) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("the result is not usable: the points' distances"));
  EXPECT_THAT(outcome.err, Not(HasSubstr("CHOLMOD")));
  EXPECT_THAT(ReadFileBytes(folder_ / "out/result.json"), HasSubstr("\"usable\": false"));
}

TEST_F(Trust, MeshesThatCannotBeMeasuredAreRefused) {
  TriMesh ball = testing::SphereMesh({0, 0, 0}, 80, 20), far = ball, flat = ball;
  for (Vec3& p : far.points) {
    p.x() += 1e9;
  }
  for (Vec3& p : flat.points) {
    p.x() = p.y() = 0;
  }
  Write("ball.ply", EncodeMesh(ball, ".ply"));
  Write("far.ply", EncodeMesh(far, ".ply"));
  Write("flat.ply", EncodeMesh(flat, ".ply"));
  ExpectRefused("evaluate far.ply ball.ply --quiet", "from the origin");
  ExpectRefused("evaluate flat.ply ball.ply --quiet", "have an area of 0 mm²");
}

// A volume whose voxels are ten times too large.
TEST_F(Trust, ImportRefusesMeshesThatARunWouldRefuse) {
  const CtVolume volume = testing::CtPhantom{}.Make();
  Write("matrix.dat", {reinterpret_cast<const char*>(volume.values.data()),
                       volume.values.size() * sizeof(volume.values[0])});
  Write("main.plist",
        "<?xml version=\"1.0\"?><plist version=\"1.0\"><dict><key>matrix</key><dict>"
        "<key>dtype</key><string>int16</string><key>filename</key><string>matrix.dat</string>"
        "<key>shape</key><array><integer>54</integer><integer>81</integer><integer>81</integer>"
        "</array></dict><key>orientation</key><integer>1</integer><key>spacing</key><array>"
        "<real>15</real><real>15</real><real>15</real></array></dict></plist>");
  ASSERT_EQ(std::system(fmt::format("cd '{}' && tar cf large.inv3 main.plist matrix.dat",
                                    folder_.Path().string())
                            .c_str()),
            0);
  ExpectRefused("import-ct large.inv3 --out out --quiet",
                "the head is 600 mm wide, and heads are 90 to 230 mm");
}

}  // namespace
}  // namespace semblance::problems
