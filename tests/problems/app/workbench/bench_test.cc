// SPDX-License-Identifier: GPL-3.0-or-later
// A workbench from a phantom to a face, without a browser: the actions, the files in the folder,
// and that a run of the folder gives the same face.
#include "problems/app/workbench/bench.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <thread>

#include "problems/app/workbench/bench_actions.h"
#include "problems/experiment/experiment_config.h"
#include "problems/run.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline_files/hspline_json.h"
#include "surfaces/hspline_query/hspline_project.h"
#include "surfaces/hspline_query/tessellate.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::ScratchFolder;
using ::testing::SizeIs;

// Options that run quickly: a coarse head, whose face is the template bent to the tips.
class WorkbenchBench : public ::testing::Test {
 protected:
  BenchOptions Options() {
    const fs::path config = folder_ / "phantom.yaml";
    WriteFileAtomically(config, fmt::format("base: {}/configs/phantom.yaml\n"
                                            "subject: {{rings: 20}}\n"
                                            "implicit: {{resolution: 18}}\nface: thin_plate\n"
                                            "template: {{type: formula, max_level: 2}}\n",
                                            SEMBLANCE_SOURCE_DIR));
    BenchOptions options;
    options.source = config;
    options.folder = folder_ / "bench";
    return options;
  }
  BenchOptions Again() {
    BenchOptions options;
    options.folder = folder_ / "bench";
    return options;
  }
  // A run without a true skin has nothing to score, and fewer pictures.
  static void RemoveSkin(Bench& bench) {
    bench.Apply("no skin", [](BenchState s) { return ChangeSetting(s, "subject.skin", "\"\""); });
  }
  static void RunUntilEnd(Bench& bench) {
    bench.StartRun();
    AwaitEnd(bench);
  }
  static void AwaitEnd(Bench& bench) {
    while (bench.TakeSnapshot().job.state == JobState::kRunning) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    ASSERT_EQ(bench.TakeSnapshot().job.state, JobState::kFinished)
        << bench.TakeSnapshot().job.words;
  }

  ScratchFolder folder_;
};

double DistanceFrom(const HSplineSurface& surface, const Vec3& point) {
  return SurfaceProjector(surface).Project(point).distance_mm;
}

TEST_F(WorkbenchBench, AMissingReferenceIsRefusedBeforeTheFolderIsMade) {
  BenchOptions options = Options();
  options.references = {{folder_ / "skull.ply", folder_ / "sites.csv"}};
  EXPECT_THROW(Bench bench(options), IoError);
  EXPECT_FALSE(fs::exists(options.folder));
}

TEST_F(WorkbenchBench, ARayPlacesASiteAtItsFirstIntersectionWithTheBone) {
  Bench bench(Options());
  const Box3 box = Bounds(bench.TakeSnapshot().subject->skull.mesh);
  bench.PlaceByRay("g", {0, box.min().y() - 100, 0}, {0, 1, 0}, {0, 0, 0});
  const Bench::Snapshot shot = bench.TakeSnapshot();
  EXPECT_LT(shot.checks.sites.at("g").from_bone_mm, 1e-9);
  const BenchLandmark& g =
      *std::ranges::find(CurrentState(shot.history).landmarks, "g", &BenchLandmark::site);
  EXPECT_NEAR(g.point[0], 0, 1e-9);
  EXPECT_LT(g.point[1], box.center().y()) << "the front, not the back";
}

TEST_F(WorkbenchBench, TheHistorySurvivesACrash) {
  const BenchOptions begin = Options();
  int undone = 0;
  {
    Bench bench(begin);
    bench.Apply("set a depth",
                [](BenchState s) { return ChangeSetting(s, "tissue.set_mm.g", "9"); });
    bench.Apply("removed n", [](BenchState s) { return RemoveLandmark(s, "n"); });
    bench.Undo();
    undone = bench.TakeSnapshot().history.now;
  }
  Bench bench(Again());
  EXPECT_EQ(bench.TakeSnapshot().history.now, undone);
  EXPECT_EQ(bench.TakeSnapshot().experiment.tissue.set_mm.at("g"), 9);
  EXPECT_TRUE(CanRedo(bench.TakeSnapshot().history));
  EXPECT_THAT(CurrentState(bench.TakeSnapshot().history).landmarks, SizeIs(32));
}

TEST_F(WorkbenchBench, ARefusedActionChangesNothing) {
  Bench bench(Options());
  const std::string before = ReadFileBytes(bench.Folder() / "workbench.yaml");
  const auto set = [&bench](const char* path, const char* value) {
    bench.Apply("set", [&](BenchState s) { return ChangeSetting(s, path, value); });
  };
  EXPECT_THROW(set("tissue.build", "\"fat\""), ConfigError);
  EXPECT_THROW(set("subject.skull", "\"/no/such.ply\""), IoError);
  EXPECT_THROW(set("subject.type", "\"phantom\""), Error);
  EXPECT_EQ(ReadFileBytes(bench.Folder() / "workbench.yaml"), before);
  EXPECT_FALSE(CanUndo(bench.TakeSnapshot().history));
}

TEST_F(WorkbenchBench, AnotherUnitOrFrameChangesTheMeshesAtOnce) {
  Bench bench(Options());
  const Vec3 before = Bounds(bench.TakeSnapshot().subject->skull.mesh).center();
  bench.Apply("set", [](BenchState s) { return ChangeSetting(s, "subject.axes", "\"RAS\""); });
  EXPECT_NEAR(Bounds(bench.TakeSnapshot().subject->skull.mesh).center().y(), -before.y(), 1e-9);
  bench.Apply("set", [](BenchState s) { return ChangeSetting(s, "subject.units", "\"m\""); });
  EXPECT_THAT(bench.TakeSnapshot().subject->faults, SizeIs(2))
      << "neither skull nor skin has the size of a head in metres";
}

// A feature that is kept from a face and blended into the same face changes nothing.
void ExpectOwnFeatureChangesNothing(Bench& bench) {
  bench.Apply("no edits", [](BenchState s) { return ReplaceEdits(s, {}); });
  const std::map<VertexId, Vec3> before = bench.Full().surface.Offsets();
  bench.KeepFeature("nose", "mine");
  EXPECT_THROW(bench.KeepFeature("nose", "mine"), InputError);
  EXPECT_THROW(bench.KeepFeature("ear", "other"), InputError);
  bench.BlendFeature("mine", 0.5);
  const std::map<VertexId, Vec3> after = bench.Full().surface.Offsets();
  for (const auto& [vertex, offset] : after) {
    EXPECT_LT((offset - before.at(vertex)).norm(), 1e-12);
  }
  EXPECT_THROW(bench.BlendFeature("theirs", 0.5), InputError);
  bench.Undo();
}

// The test of the page (workbench_page.py) compares every byte of the folder.
TEST_F(WorkbenchBench, ARunOfTheFolderGivesTheSameFaceWithItsEditsThorough) {
  Bench bench(Options());
  RemoveSkin(bench);
  bench.Apply("set a depth", [](BenchState s) { return ChangeSetting(s, "tissue.set_mm.g", "9"); });
  bench.Apply("edited", [](BenchState s) {
    EditScript script;
    script.edits.push_back({2, 9, 9, std::array{0.0, 0.0, 4.0}});
    return ReplaceEdits(s, script);
  });
  const Pull pull{.level = 1, .by_mm = {0, -3, 0}, .reach = 2, .mirror = true};
  EXPECT_THROW(bench.PullAt({0, -100, 0}, pull), InputError) << "sculpting needs a full face";
  RunUntilEnd(bench);
  EXPECT_TRUE(bench.TakeSnapshot().run_saved);
  const auto experiment = ReadConfig<Experiment>(bench.Folder() / "config.yaml");
  const RunResult again = problems::Run(experiment, {});
  const HSplineSurface face = bench.Full().surface;
  EXPECT_EQ(face.Offsets(), again.fit.surface.Offsets());
  EXPECT_EQ(ReadHSpline(bench.Folder() / "run/face.hspline.json").Offsets(), face.Offsets());
  EXPECT_EQ(ReadFileBytes(bench.Folder() / "run/resolved.yaml"), WriteConfig(experiment));

  ExpectOwnFeatureChangesNothing(bench);
  const Vec3 nose = face.Point({0.5, 0.5});
  bench.PullAt(nose, pull);
  EXPECT_FALSE(bench.TakeSnapshot().run_saved);
  EXPECT_TRUE(bench.TakeSnapshot().face_fresh);
  EXPECT_GT((bench.Full().surface.Point({0.5, 0.5}) - nose).norm(), 1);
}

// Multiplies all points of a mesh file by a factor.
void Scale(const fs::path& file, double factor) {
  TriMesh mesh = ReadMesh(file);
  for (Vec3& p : mesh.points) {
    p *= factor;
  }
  WriteFileAtomically(file, EncodeMesh(mesh, ".ply"));
}

// Adds a comment, and so changes the content alone.
void Touch(const fs::path& file) { WriteFileAtomically(file, ReadFileBytes(file) + "# more\n"); }

// For each kind of input: changed while the workbench runs, changed back, and changed between two
// workbenches.
TEST_F(WorkbenchBench, NotesMakeTheReportStaleButNotTheFaceThorough) {
  Bench bench(Options());
  RemoveSkin(bench);
  RunUntilEnd(bench);
  bench.Apply("note", [](BenchState s) { return ChangeSetting(s, "record.notes", "\"found\""); });
  EXPECT_TRUE(bench.TakeSnapshot().face_fresh);
  EXPECT_FALSE(bench.TakeSnapshot().run_saved);
  bench.Undo();
  EXPECT_TRUE(bench.TakeSnapshot().run_saved);
  bench.Apply("name", [](BenchState s) { return NameCase(std::move(s), "Case <17>"); });
  EXPECT_TRUE(bench.TakeSnapshot().face_fresh);
  EXPECT_FALSE(bench.TakeSnapshot().run_saved);
  RunUntilEnd(bench);
  EXPECT_THAT(ReadFileBytes(bench.Folder() / "run" / "report.html"), HasSubstr("Case &lt;17&gt;"));
}

TEST_F(WorkbenchBench, AFileThatChangesOnTheDiskMakesTheFaceStale) {
  const fs::path root = folder_ / "bench", skull = root / "subject/skull.ply",
                 table = root / "tables/rhine_caucasoid.yaml";
  const auto set = [](const char* path, const char* value) {
    return [=](BenchState s) { return ChangeSetting(std::move(s), path, value); };
  };
  {
    Bench bench(Options());
    RemoveSkin(bench);
    bench.Apply("depths", set("tissue.depths", "\"table\""));
    bench.Apply("table", set("tissue.table", "\"tables/rhine_caucasoid.yaml\""));
    RunUntilEnd(bench);
    const std::string table_text = ReadFileBytes(table);
    EXPECT_TRUE(bench.TakeSnapshot().run_saved);
    Touch(table);
    EXPECT_TRUE(bench.TakeSnapshot().has_face);
    EXPECT_FALSE(bench.TakeSnapshot().face_fresh);
    EXPECT_FALSE(bench.TakeSnapshot().run_saved);
    WriteFileAtomically(table, table_text);
    EXPECT_TRUE(bench.TakeSnapshot().run_saved) << "the same content again";
    const std::string skull_bytes = ReadFileBytes(skull);
    const double width = Bounds(bench.TakeSnapshot().subject->skull.mesh).sizes().x();
    Scale(skull, 1.01);
    EXPECT_FALSE(bench.TakeSnapshot().face_fresh);
    EXPECT_NEAR(Bounds(bench.TakeSnapshot().subject->skull.mesh).sizes().x(), 1.01 * width, 1e-3)
        << "the page shows the skull as it is";
    WriteFileAtomically(skull, skull_bytes);
    EXPECT_TRUE(bench.TakeSnapshot().face_fresh);
  }
  EXPECT_TRUE(Bench(Again()).TakeSnapshot().run_saved);
  Touch(table);
  Bench again(Again());
  EXPECT_TRUE(again.TakeSnapshot().has_face);
  EXPECT_FALSE(again.TakeSnapshot().face_fresh);
  EXPECT_FALSE(again.TakeSnapshot().run_saved);
  RunUntilEnd(again);
  EXPECT_TRUE(again.TakeSnapshot().run_saved);
}

// The second run must not use intermediate results of the former contents.
TEST_F(WorkbenchBench, ARunAfterAChangeOfAFileIsThatOfTheChangedFileThorough) {
  Bench bench(Options());
  RemoveSkin(bench);
  RunUntilEnd(bench);
  const HSplineSurface before = bench.Full().surface;
  Scale(bench.Folder() / "subject/skull.ply", 1.003);
  RunUntilEnd(bench);
  EXPECT_TRUE(bench.TakeSnapshot().run_saved);
  const RunResult run = problems::Run(ReadConfig<Experiment>(bench.Folder() / "config.yaml"), {});
  EXPECT_EQ(bench.Full().surface.Offsets(), run.fit.surface.Offsets());
  EXPECT_NE(bench.Full().surface.Offsets(), before.Offsets());
}

// A person opens it to correct the points, or to repair the file.
TEST_F(WorkbenchBench, ASkullThatNoLongerFitsOrCannotBeReadStillOpensThorough) {
  const fs::path skull = folder_ / "bench/subject/skull.ply";
  {
    Bench bench(Options());
    RemoveSkin(bench);
    RunUntilEnd(bench);
  }
  Scale(skull, 1.1);
  {
    Bench bench(Again());
    const Bench::Snapshot shot = bench.TakeSnapshot();
    EXPECT_TRUE(shot.has_face);
    EXPECT_FALSE(shot.face_fresh);
    EXPECT_THAT(shot.checks.errors, ::testing::Not(::testing::IsEmpty()));
    bench.PlaceByRay("g", Bounds(shot.subject->skull.mesh).center() - Vec3(0, 500, 0), {0, 1, 0},
                     Vec3::Zero());
  }
  const std::string bytes = ReadFileBytes(skull);
  WriteFileAtomically(skull, bytes.substr(0, bytes.size() / 2));
  Bench bench(Again());
  EXPECT_FALSE(bench.TakeSnapshot().subject->bone);
  EXPECT_THAT(bench.TakeSnapshot().subject->faults, ::testing::ElementsAre(HasSubstr("skull.ply")));
  WriteFileAtomically(skull, bytes);
  EXPECT_TRUE(bench.TakeSnapshot().subject->bone) << "repaired while the workbench runs";
}

TEST_F(WorkbenchBench, AChangeDuringARunDiscardsItsResult) {
  Bench bench(Options());
  bench.StartRun();
  bench.Apply("set a depth", [](BenchState s) { return ChangeSetting(s, "tissue.set_mm.g", "9"); });
  while (bench.TakeSnapshot().job.state == JobState::kRunning) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_EQ(bench.TakeSnapshot().job.state, JobState::kStopped);
  EXPECT_FALSE(bench.TakeSnapshot().has_face);
  EXPECT_FALSE(fs::exists(bench.Folder() / "run/manifest.json"));
}

// As two pages do at the same moment.
TEST_F(WorkbenchBench, ManyThreadsMayStartAJobAtOnceThorough) {
  Bench bench(Options());
  RemoveSkin(bench);
  for (int round = 0; round < 2; ++round) {
    std::vector<std::jthread> pages;
    for (int k = 0; k < 3; ++k) {
      pages.emplace_back([&bench] { bench.StartRun(); });
      pages.emplace_back([&bench] { bench.StartVariants({BenchVariant::kThinner}); });
    }
  }
  RunUntilEnd(bench);
  EXPECT_TRUE(bench.TakeSnapshot().has_face);
}

TEST_F(WorkbenchBench, ProposalsLieOnABoneInRasToo) {
  const Phantom phantom = MakePhantom({.random_seed = 3, .rings = 40});
  TriMesh skull = phantom.skull;
  for (Vec3& p : skull.points) {
    p = Vec3(-p.x(), -p.y(), p.z());
  }
  WriteFileAtomically(folder_ / "ras.ply", EncodeMesh(skull, ".ply"));
  BenchOptions options;
  options.source = folder_ / "ras.ply";
  options.folder = folder_ / "bench";
  Bench bench(options);
  bench.StartProposal();
  AwaitEnd(bench);
  const auto farthest = [&bench] {
    double most_mm = 0;
    for (const auto& [site, check] : bench.TakeSnapshot().checks.sites) {
      most_mm = std::max(most_mm, check.from_bone_mm);
    }
    return most_mm;
  };
  EXPECT_THAT(bench.TakeSnapshot().job.words, HasSubstr("set its axes to RAS"));
  EXPECT_LT(farthest(), 3);
  bench.CorrectFrame("subject.axes", "\"RAS\"");
  EXPECT_LT(farthest(), 3);
}

TEST_F(WorkbenchBench, ACoarseFaceFollowsADepth) {
  Bench bench(Options());
  bench.Apply("set", [](BenchState s) { return ChangeSetting(s, "face.type", "\"fit\""); });
  const BenchFace before = bench.Coarse();
  const BenchFace after = bench.CoarseWith({"tissue.set_mm.g", "14"});
  const auto dowel = std::ranges::find(before.dowels, "g", &Dowel::site);
  ASSERT_NE(dowel, before.dowels.end());
  const Vec3 tip = dowel->base + 14 * dowel->direction;
  EXPECT_LT(DistanceFrom(after.surface, tip), DistanceFrom(before.surface, tip) - 3);
  EXPECT_FALSE(bench.TakeSnapshot().experiment.tissue.set_mm.contains("g")) << "only tried out";
}

// The cache of coarse faces distinguishes all that they depend on.
TEST_F(WorkbenchBench, ACoarseFaceBelongsToThePresentState) {
  const auto points = [](const BenchFace& face) {
    return Tessellate(face.surface, kShownQuadsPerPatch).mesh.points;
  };
  Bench bench(Options());
  const auto before = points(bench.Coarse()),
             tried = points(bench.CoarseWith({"tissue.set_mm.g", "14"}));
  bench.Apply("set", [](BenchState s) { return ChangeSetting(s, "tissue.set_mm.g", "14"); });
  EXPECT_EQ(points(bench.Coarse()), tried);
  bench.Apply("removed n", [](BenchState s) { return RemoveLandmark(std::move(s), "n"); });
  EXPECT_NE(points(bench.Coarse()), tried);
  bench.Undo();
  bench.Undo();
  EXPECT_EQ(points(bench.Coarse()), before);
}

TEST_F(WorkbenchBench, VariantsHaveDifferentDepths) {
  Bench bench(Options());
  const BenchFace thin = bench.Coarse(BenchVariant::kThinner);
  const BenchFace thick = bench.Coarse(BenchVariant::kThicker);
  for (std::size_t k = 0; k < thin.dowels.size(); ++k) {
    EXPECT_GT(thick.dowels[k].depth_mm, thin.dowels[k].depth_mm) << thin.dowels[k].site;
  }
}

TEST_F(WorkbenchBench, AFullVariantIsTheRunOfItsBuild) {
  const auto set = [](const char* path, const char* value) {
    return [=](BenchState s) { return ChangeSetting(std::move(s), path, value); };
  };
  {
    Bench bench(Options());
    RemoveSkin(bench);
    bench.Apply("depths", set("tissue.depths", "\"table\""));
    bench.Apply("table", set("tissue.table", "\"tables/rhine_caucasoid.yaml\""));
    EXPECT_THROW(bench.FullVariant(BenchVariant::kObese), InputError);
    bench.StartVariants({BenchVariant::kObese, BenchVariant::kThinner});
    AwaitEnd(bench);
    const std::vector<std::string> obese = {"tissue.build=obese"};
    const RunResult again =
        problems::Run(ReadConfig<Experiment>(bench.Folder() / "config.yaml", obese), {});
    EXPECT_EQ(bench.FullVariant(BenchVariant::kObese).surface.Offsets(),
              again.fit.surface.Offsets());
    EXPECT_FALSE(fs::exists(bench.Folder() / "run")) << "variants do not touch run/";
    bench.Apply("depth", set("tissue.set_mm.g", "9"));
    EXPECT_THAT(bench.TakeSnapshot().variants, SizeIs(0));
    bench.Undo();
  }
  Bench again(Again());
  EXPECT_THAT(again.TakeSnapshot().variants, SizeIs(2));
  for (const Dowel& dowel : again.FullVariant(BenchVariant::kThinner).dowels) {
    EXPECT_GT(dowel.depth_mm, 0);
  }
}

TEST_F(WorkbenchBench, ThePreviewOfAPullPredictsItsResultThorough) {
  Bench bench(Options());
  RemoveSkin(bench);
  Pull pull{.level = 1, .reach = 2, .mirror = true};
  EXPECT_THROW(bench.PullMovesAt({0, -100, 0}, pull), InputError);
  RunUntilEnd(bench);
  const auto shown = [&bench] {
    return Tessellate(bench.Full().surface, kShownQuadsPerPatch).mesh.points;
  };
  const std::vector<Vec3> before = shown();
  const Vec3 at = bench.Full().surface.Point({0.6, 0.4});
  const auto moves = bench.PullMovesAt(at, pull);
  pull.by_mm = {1, -2, 0.5};
  bench.PullAt(at, pull);
  const std::vector<Vec3> after = shown();
  double farthest = 0;
  for (std::size_t v = 0; v < before.size(); ++v) {
    const Vec3 predicted = moves[0][v] - 2 * moves[1][v] + 0.5 * moves[2][v];
    EXPECT_LT((after[v] - before[v] - predicted).norm(), 0.05);
    farthest = std::max(farthest, predicted.norm());
  }
  EXPECT_GT(farthest, 1.5);
}

TEST_F(WorkbenchBench, AFolderWithOtherFilesIsRefused) {
  const BenchOptions options = Options();
  fs::create_directories(options.folder);
  WriteFileAtomically(options.folder / "notes.txt", "mine");
  EXPECT_THROW(Bench{options}, IoError);
  EXPECT_FALSE(fs::exists(options.folder / "workbench.yaml"));
}

TEST_F(WorkbenchBench, ATurnedDowelIsSavedUndoneAndRunAsItIs) {
  Bench bench(Options());
  bench.TurnDowel("zy_l", std::nullopt);
  const Bench::DowelDirection own = bench.FindDirection("zy_l");
  EXPECT_NEAR((own.direction - own.own).norm(), 0, 1e-12);
  const Vec3 turned = Eigen::AngleAxisd(0.4, own.own.unitOrthogonal()) * own.own;
  bench.TurnDowel("zy_l", 2 * turned);
  EXPECT_NEAR((bench.FindDirection("zy_l").direction - turned).norm(), 0, 1e-12);
  EXPECT_NEAR((bench.FindDirection("zy_l").own - own.own).norm(), 0, 1e-12);
  const LandmarkFile file = ReadLandmarkFileAsWritten(folder_ / "bench/landmarks.yaml");
  ASSERT_TRUE(file.Find("zy_l")->normal);
  EXPECT_NEAR((Vec3(file.Find("zy_l")->normal->data()) - turned).norm(), 0, 1e-9);
  const auto experiment = ReadConfig<Experiment>(folder_ / "bench/config.yaml");
  const Case subject = MakeCase(LoadSubject(experiment.subject, {}), experiment, {});
  const Dowel& dowel = *std::ranges::find(subject.dowels_on_bone, "zy_l", &Dowel::site);
  EXPECT_NEAR((dowel.direction - turned).norm(), 0, 1e-9);
  EXPECT_NEAR(subject.turns_deg.at("zy_l"), 0.4 * 180 / 3.14159265358979, 1e-6);
  bench.Undo();
  EXPECT_NEAR((bench.FindDirection("zy_l").direction - own.own).norm(), 0, 1e-12);
  const int before = bench.TakeSnapshot().history.now;
  EXPECT_THROW(bench.TurnDowel("zy_l", -own.own), InputError);
  EXPECT_THROW(bench.TurnDowel("zy_l", own.own.unitOrthogonal()), InputError);
  EXPECT_THROW(bench.TurnDowel("zy_l", Vec3(0, 0, 0)), InputError);
  EXPECT_EQ(bench.TakeSnapshot().history.now, before);
}

}  // namespace
}  // namespace semblance::problems
