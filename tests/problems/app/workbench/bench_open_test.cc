// SPDX-License-Identifier: GPL-3.0-or-later
// Opening files in a running workbench: the kind of each file, the resulting state, and that each
// opening is one step that can be undone.
#include "problems/app/workbench/bench_open.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <thread>
#include <tuple>

#include "problems/app/workbench/bench.h"
#include "problems/app/workbench/bench_actions.h"
#include "problems/subject/phantom.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::ScratchFolder;
using ::testing::SizeIs;
using testing::WordsOf;

constexpr const char* kLandmarks =
    "subject: other\nlandmarks:\n  - {site: g, point: [0, -90, 10]}\n"
    "  - {site: n, point: [0, -88, 0]}\n";

class WorkbenchOpening : public ::testing::Test {
 protected:
  WorkbenchOpening() {
    PhantomOptions coarse;
    coarse.rings = 16;
    phantom_ = MakePhantom(coarse);
    skull_ = Write("skull.ply", EncodeMesh(phantom_.skull, ".ply"));
    config_ =
        Write("phantom.yaml", fmt::format("base: {}/configs/phantom.yaml\nsubject: {{rings: 16}}\n"
                                          "tissue: {{set_mm: {{g: 9}}}}\n",
                                          SEMBLANCE_SOURCE_DIR));
    landmarks_ = Write("other.landmarks.yaml", kLandmarks);
  }

  fs::path Write(const fs::path& name, const std::string& text) {
    fs::create_directories((folder_ / name).parent_path());
    WriteFileAtomically(folder_ / name, text);
    return folder_ / name;
  }

  BenchOptions Options(const fs::path& source = {}) {
    BenchOptions options;
    options.source = source;
    options.folder = folder_ / "bench";
    return options;
  }

  // Opens the file as the page does and returns the status of the ended job.
  static JobStatus Open(Bench& bench, const fs::path& path, OpenAs as) {
    OpenRequest request;
    request.path = path;
    request.as = as;
    bench.StartOpening(request);
    while (bench.TakeSnapshot().job.state == JobState::kRunning) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return bench.TakeSnapshot().job;
  }

  static std::string OpeningFault(const fs::path& path) {
    try {
      IdentifyImport(path);
      return "no fault";
    } catch (const Error& error) {
      return error.what();
    }
  }

  static const BenchState& StateIn(const Bench::Snapshot& shot) {
    return CurrentState(shot.history);
  }

  ScratchFolder folder_;
  Phantom phantom_;
  fs::path skull_, config_, landmarks_;
};

TEST_F(WorkbenchOpening, TheKindOfAFileFollowsFromItsNameAndItsKeys) {
  EXPECT_EQ(IdentifyImport(skull_).kind, ImportKind::kMesh);
  EXPECT_EQ(IdentifyImport(Write("HEAD.STL", "")).kind, ImportKind::kMesh);
  EXPECT_EQ(IdentifyImport(Write("ct.nii.gz", "")).kind, ImportKind::kVolume);
  EXPECT_EQ(IdentifyImport(Write("points.fcsv", "")).kind, ImportKind::kLandmarks);
  EXPECT_EQ(IdentifyImport(landmarks_).kind, ImportKind::kLandmarks);
  EXPECT_EQ(IdentifyImport(config_).kind, ImportKind::kConfig);
}

TEST_F(WorkbenchOpening, AFolderCountsAsItsOnlyFileOrAsAVolume) {
  Write("both/a.ply", "");
  Write("both/head.yaml", "title: a head\nsubject: {type: files, skull: a.ply}\n");
  EXPECT_EQ(IdentifyImport(folder_ / "both").path, folder_ / "both/head.yaml");
  Write("raw/ct.mhd", "");
  Write("raw/ct.raw", "");
  EXPECT_EQ(IdentifyImport(folder_ / "raw").path, folder_ / "raw/ct.mhd");
  Write("slices/IM0001", "");
  Write("slices/IM0002", "");
  EXPECT_EQ(IdentifyImport(folder_ / "slices").kind, ImportKind::kVolume);
  EXPECT_EQ(IdentifyImport(folder_ / "slices").path, folder_ / "slices");
}

TEST_F(WorkbenchOpening, TheMessageForAnUnknownFileListsWhatCanBeOpened) {
  EXPECT_THAT(OpeningFault(folder_ / "none.ply"), HasSubstr("no such file"));
  EXPECT_THAT(OpeningFault(Write("a.zip", "")), HasSubstr("unpack it"));
  EXPECT_THAT(OpeningFault(Write("a.docx", "")), HasSubstr("these can be opened: a mesh"));
  EXPECT_THAT(OpeningFault(Write("a.dcm", std::string(128, '\0') + "DICM")),
              HasSubstr("one slice"));
  EXPECT_THAT(OpeningFault(Write("study.yaml", "base: phantom.yaml\ngrid: {interp: [mean]}\n")),
              HasSubstr("semblance study"));
  EXPECT_THAT(OpeningFault(fs::path(SEMBLANCE_SOURCE_DIR) / "configs/tables/rhine_caucasoid.yaml"),
              HasSubstr("tissue.table"));
  EXPECT_THAT(OpeningFault(Write("other.yaml", "colour: red\n")),
              HasSubstr("none of its top-level keys"));
  EXPECT_THAT(OpeningFault(Write("broken.yaml", "a: [1\n")), HasSubstr("broken.yaml:"));
  Write("two/a.ply", "");
  Write("two/b.ply", "");
  EXPECT_THAT(OpeningFault(folder_ / "two"),
              HasSubstr("2 files that cannot be opened together: a.ply"));
  const Bench bench(Options());
  EXPECT_THAT(OpeningFault(bench.Folder()), HasSubstr("semblance workbench"));
}

TEST_F(WorkbenchOpening, OpeningAFirstHeadIsOneStepThatCanBeUndone) {
  Bench bench(Options());
  ASSERT_EQ(Open(bench, skull_, OpenAs::kHead).state, JobState::kFinished);
  EXPECT_EQ(bench.TakeSnapshot().subject->skull.mesh.triangles.size(),
            phantom_.skull.triangles.size());
  EXPECT_EQ(bench.TakeSnapshot().history.now, 1);
  bench.Undo();
  EXPECT_FALSE(bench.TakeSnapshot().subject->bone);
  bench.Redo();
  EXPECT_TRUE(bench.TakeSnapshot().subject->bone);
}

TEST_F(WorkbenchOpening, AnotherHeadKeepsTheOptionsButNoLandmarksOrEdits) {
  Bench bench(Options(config_));
  bench.Apply("build", [](BenchState s) { return ChangeSetting(s, "tissue.build", "\"obese\""); });
  bench.Apply("axes", [](BenchState s) { return ChangeSetting(s, "subject.axes", "\"RAS\""); });
  bench.Apply("depth", [](BenchState s) { return ChangeSetting(s, "tissue.set_mm.n", "7"); });
  ASSERT_EQ(Open(bench, skull_, OpenAs::kHead).state, JobState::kFinished);
  const Bench::Snapshot shot = bench.TakeSnapshot();
  const auto& files = std::get<FileSubject>(shot.experiment.subject);
  EXPECT_EQ(files.skull, skull_);
  EXPECT_EQ(files.axes, Axes::kLps);
  EXPECT_TRUE(files.skin.empty());
  EXPECT_EQ(shot.experiment.tissue.build, Build::kObese);
  EXPECT_FALSE(shot.experiment.tissue.set_mm.contains("n"));
  EXPECT_THAT(StateIn(shot).landmarks, IsEmpty());
  EXPECT_EQ(StateIn(shot).subject, "skull");
  bench.Undo();
  EXPECT_THAT(StateIn(bench.TakeSnapshot()).landmarks, SizeIs(32));
  EXPECT_EQ(std::get<FileSubject>(bench.TakeSnapshot().experiment.subject).axes, Axes::kRas);
}

// 3D Slicer states the axes of a model; the workbench shows them as the subject's axes.
TEST_F(WorkbenchOpening, AHeadThatStatesItsAxesIsShownInLps) {
  TriMesh ras = phantom_.skull;
  for (Vec3& p : ras.points) {
    p = Vec3(-p.x(), -p.y(), p.z());
  }
  const fs::path file = Write("ras.obj", "# SPACE=RAS\n" + EncodeMesh(ras, ".obj"));
  Bench bench(Options());
  ASSERT_EQ(Open(bench, file, OpenAs::kHead).state, JobState::kFinished);
  const Bench::Snapshot shot = bench.TakeSnapshot();
  EXPECT_EQ(std::get<FileSubject>(shot.experiment.subject).axes, Axes::kRas);
  EXPECT_LT((shot.subject->skull.mesh.points[0] - phantom_.skull.points[0]).norm(), 1e-4);
  EXPECT_THAT(WordsOf<InputError>([&] { bench.CorrectFrame("subject.axes", "\"LPS\""); }),
              HasSubstr("the file states SPACE=RAS, and subject.axes is LPS"));
  EXPECT_EQ(std::get<FileSubject>(bench.TakeSnapshot().experiment.subject).axes, Axes::kRas);
}

TEST_F(WorkbenchOpening, AConfigurationWithItsHeadAndOptionsSurvivesACrash) {
  {
    Bench bench(Options(skull_));
    ASSERT_EQ(Open(bench, config_, OpenAs::kHead).state, JobState::kFinished);
    EXPECT_EQ(bench.TakeSnapshot().experiment.tissue.set_mm.at("g"), 9);
    EXPECT_THAT(StateIn(bench.TakeSnapshot()).landmarks, SizeIs(32));
    EXPECT_EQ(StateIn(bench.TakeSnapshot()).start, "start-2.yaml");
    bench.Undo();
    EXPECT_FALSE(bench.TakeSnapshot().experiment.tissue.set_mm.contains("g"));
    bench.Redo();
  }
  Bench again(Options());
  EXPECT_EQ(again.TakeSnapshot().experiment.tissue.set_mm.at("g"), 9);
  EXPECT_TRUE(again.TakeSnapshot().subject->skin.has_value());
}

TEST_F(WorkbenchOpening, OpeningOptionsKeepsTheHead) {
  Bench bench(Options(skull_));
  bench.PlaceByRay("g", {0, -500, 0}, {0, 1, 0}, {0, 0, 0});
  ASSERT_EQ(Open(bench, config_, OpenAs::kOptions).state, JobState::kFinished);
  EXPECT_EQ(std::get<FileSubject>(bench.TakeSnapshot().experiment.subject).skull, skull_);
  EXPECT_EQ(bench.TakeSnapshot().experiment.tissue.set_mm.at("g"), 9);
  EXPECT_THAT(StateIn(bench.TakeSnapshot()).landmarks, SizeIs(1));
}

TEST_F(WorkbenchOpening, AFailedOpeningChangesNothing) {
  Bench bench(Options(config_));
  const auto files = [&bench] {
    std::vector<std::string> names;
    for (const auto& entry : fs::recursive_directory_iterator(bench.Folder())) {
      names.push_back(entry.path().string());
    }
    std::ranges::sort(names);
    return names;
  };
  const auto before = files();
  const std::string history = ReadFileBytes(bench.Folder() / "workbench.yaml");
  const fs::path no_mesh = Write("none.ply", "ply\nnothing\n");
  const fs::path lost = Write("lost.yaml", "subject: {type: files, skull: gone.ply}\n");
  const fs::path faulty = Write("faulty.yaml", "tissue: {build: fat}\n");
  for (const auto& [path, as, words] :
       {std::tuple(no_mesh, OpenAs::kHead, "none.ply"),
        std::tuple(no_mesh, OpenAs::kSkin, "none.ply"), std::tuple(lost, OpenAs::kHead, "gone.ply"),
        std::tuple(faulty, OpenAs::kOptions, "tissue.build"),
        std::tuple(skull_, OpenAs::kLandmarks, "mesh cannot be opened as landmarks"),
        std::tuple(landmarks_, OpenAs::kHead, "landmarks cannot be opened as head")}) {
    const JobStatus end = Open(bench, path, as);
    EXPECT_EQ(end.state, JobState::kFailed) << path;
    EXPECT_THAT(end.words, HasSubstr(words));
  }
  EXPECT_EQ(files(), before);
  EXPECT_EQ(ReadFileBytes(bench.Folder() / "workbench.yaml"), history);
}

TEST_F(WorkbenchOpening, AnUploadMovesToTheSubjectFolderWhenOpened) {
  Bench bench(Options());
  const std::string mesh = EncodeMesh(phantom_.skull, ".ply");
  SaveIncoming(bench.Folder(), "b1", "head of \"x\" <b>.ply", mesh);
  const fs::path sent = IncomingBatch(bench.Folder(), "b1");
  ASSERT_EQ(Open(bench, sent, OpenAs::kHead).state, JobState::kFinished)
      << bench.TakeSnapshot().job.words;
  EXPECT_FALSE(fs::exists(sent));
  const fs::path kept = bench.Folder() / "subject" / "head of \"x\" <b>.ply";
  EXPECT_EQ(ReadFileBytes(kept), mesh);
  SaveIncoming(bench.Folder(), "b2", "head of \"x\" <b>.ply", mesh);
  ASSERT_EQ(Open(bench, IncomingBatch(bench.Folder(), "b2"), OpenAs::kHead).state,
            JobState::kFinished);
  EXPECT_NE(std::get<FileSubject>(bench.TakeSnapshot().experiment.subject).skull, kept)
      << "no file is replaced";
}

TEST_F(WorkbenchOpening, AConfigurationIsUploadedWithTheFilesThatItNames) {
  Bench bench(Options());
  const std::string config = "subject: {type: files, skull: meshes/skull.ply}\n";
  SaveIncoming(bench.Folder(), "b1", "head/head.yaml", config);
  const JobStatus alone = Open(bench, IncomingBatch(bench.Folder(), "b1"), OpenAs::kHead);
  EXPECT_THAT(alone.words, HasSubstr("Upload the files that it names"));
  SaveIncoming(bench.Folder(), "b1", "head/meshes/skull.ply", EncodeMesh(phantom_.skull, ".ply"));
  const JobStatus both = Open(bench, IncomingBatch(bench.Folder(), "b1"), OpenAs::kHead);
  ASSERT_EQ(both.state, JobState::kFinished) << both.words;
  EXPECT_TRUE(bench.TakeSnapshot().subject->bone);
}

TEST_F(WorkbenchOpening, LandmarksDoNotRenameTheCase) {
  Bench bench(Options(skull_));
  ASSERT_EQ(Open(bench, landmarks_, OpenAs::kLandmarks).state, JobState::kFinished);
  EXPECT_THAT(StateIn(bench.TakeSnapshot()).landmarks, SizeIs(2));
  EXPECT_EQ(StateIn(bench.TakeSnapshot()).subject, "skull");
}

TEST_F(WorkbenchOpening, APieceThatIsNoBoneIsRemovedAndTheSkullIsNot) {
  TriMesh mesh = phantom_.skull;
  const std::size_t bone = mesh.triangles.size();
  const int first = static_cast<int>(mesh.points.size());
  const Vec3 tube(0, Bounds(mesh).min().y() - 30, 0);
  for (const Vec3& corner : {Vec3(0, 0, 0), Vec3(4, 0, 0), Vec3(0, 4, 0), Vec3(0, 0, 4)}) {
    mesh.points.push_back(tube + corner);
  }
  for (const Triangle& t : {Triangle{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}) {
    mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
  Bench bench(Options(Write("tube.ply", EncodeMesh(mesh, ".ply"))));
  const auto triangles = [&] { return bench.TakeSnapshot().subject->skull.mesh.triangles.size(); };
  ASSERT_EQ(triangles(), bone + 4);
  bench.RemoveBone(tube, std::nullopt);
  EXPECT_EQ(triangles(), bone);
  EXPECT_THAT(WordsOf<InputError>([&] { bench.RemoveBone(tube, std::nullopt); }),
              HasSubstr("the skull itself"));
  EXPECT_THROW(bench.RemoveBone(tube, 31), InputError);
  bench.RemoveBone(tube, 8);
  EXPECT_LT(triangles(), bone);
  bench.Undo();
  bench.Undo();
  EXPECT_EQ(triangles(), bone + 4);
}

TEST_F(WorkbenchOpening, AnAddressThatOthersCanReadIsNotUsed) {
  const std::string token(64, 'a');
  EXPECT_EQ(ReadAddress(folder_.Path()).port, 0);
  StoreAddress(folder_.Path(), {4711, token});
  EXPECT_EQ(ReadAddress(folder_.Path()).port, 4711);
  EXPECT_EQ(ReadAddress(folder_.Path()).token, token);
  fs::permissions(folder_ / ".address", fs::perms::others_read, fs::perm_options::add);
  EXPECT_EQ(ReadAddress(folder_.Path()).token, "");
  StoreAddress(folder_.Path(), {4711, "short"});
  EXPECT_EQ(ReadAddress(folder_.Path()).port, 0);
}

TEST_F(WorkbenchOpening, NoNameLeadsOutOfTheFolder) {
  const std::string longest(200, 'a');
  EXPECT_NO_THROW(SaveIncoming(folder_.Path(), "b", longest, ""));
  for (const std::string& name :
       {std::string("../a.ply"), std::string("a/../../b"), std::string("/etc/x"), std::string(),
        std::string(".a"), std::string("a\nb"), std::string("a\0b", 3), std::string("a\\b"),
        std::string("a//b"), std::string("\xff.ply"), longest + "a"}) {
    EXPECT_THROW(SaveIncoming(folder_.Path(), "b", name, ""), InputError) << name;
  }
  EXPECT_THROW(IncomingBatch(folder_.Path(), ".."), InputError);
  EXPECT_THROW(IncomingBatch(folder_.Path(), ""), InputError);
}

TEST_F(WorkbenchOpening, LandmarksOnTheBoneMoveWithItsFrame) {
  Bench bench(Options(skull_));
  bench.PlaceByRay("g", {0, -500, 0}, {0, 1, 0}, {0, 0, 0});
  bench.Apply("placed", [](BenchState s) { return PlaceLandmark(s, "n", {0, -300, 0}); });
  const auto point = [&bench](std::size_t k) {
    return StateIn(bench.TakeSnapshot()).landmarks.at(k).point;
  };
  const auto before = point(0);
  bench.CorrectFrame("subject.axes", "\"RAS\"");
  EXPECT_NEAR(point(0)[1], -before[1], 1e-12);
  EXPECT_EQ(point(1)[1], -300) << "off the bone: its file may have had the right frame";
  bench.CorrectFrame("subject.units", "\"cm\"");
  EXPECT_NEAR(point(0)[1], -10 * before[1], 1e-9);
  EXPECT_LT(bench.TakeSnapshot().checks.sites.at("g").from_bone_mm, 1e-6);
  bench.Undo();
  bench.Undo();
  EXPECT_EQ(point(0), before);
}

}  // namespace
}  // namespace semblance::problems
