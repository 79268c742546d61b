// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/edit_script.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "problems/config/config.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"
#include "tests/testing/splines.h"

namespace semblance::problems {
namespace {

using ::testing::HasSubstr;
using testing::RandomSurface;
using testing::ScratchFolder;
using testing::WordsOf;

const HSplineShape kShape{.patches_u = 4, .patches_v = 5, .max_level = 3};

EditScript FromText(const std::string& text) {
  return ReadConfigText<EditScript>(text, "script.yaml");
}

// Some random edits of each level.
EditScript RandomScript(std::uint64_t random_seed, int first_level) {
  Random random(random_seed);
  EditScript script;
  for (int level = first_level; level <= 3; ++level) {
    for (int e = 0; e < 5; ++e) {
      const Vec3 o = random.InBox(-1, 1);
      script.edits.push_back({level, e, static_cast<int>(random.Uniform(0, kShape.Rows(level))),
                              std::array{o.x(), o.y(), o.z()}});
    }
  }
  return script;
}

TEST(EditScript, TheInverseTakesTheEditsBackToTheBit) {
  const HSplineSurface before = RandomSurface(kShape, 1);
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    HSplineSurface surface = before;
    EditScript script = RandomScript(seed, 1);
    script.resets.push_back({{0.2, 0.7}, {0, 0.6}, 2});
    const EditScript inverse = ApplyEdits(script, surface);
    EXPECT_NE(surface.Offsets(), before.Offsets());
    const EditScript again = ApplyEdits(inverse, surface);
    EXPECT_EQ(surface.Offsets(), before.Offsets());
    EXPECT_EQ(surface.Net(3).vertices, before.Net(3).vertices);
    ApplyEdits(again, surface);
    ApplyEdits(FromText(WriteConfig(inverse)), surface);  // also through the text of a file
    EXPECT_EQ(surface.Net(3).vertices, before.Net(3).vertices);
  }
}

TEST(EditScript, LevelZeroMovesInWorldAxesAndBack) {
  const HSplineSurface before = RandomSurface(kShape, 2);
  HSplineSurface surface = before;
  const EditScript inverse =
      ApplyEdits(FromText("edits:\n  - {level: 0, i: 2, j: 3, offset: [1, -2, 3]}\n"), surface);
  EXPECT_EQ(surface.Net(0).At(2, 3), before.Net(0).At(2, 3) + Vec3(1, -2, 3));
  EXPECT_EQ(surface.Offsets(), before.Offsets());
  ApplyEdits(inverse, surface);
  EXPECT_LT((surface.Net(0).At(2, 3) - before.Net(0).At(2, 3)).norm(), 1e-13);
}

TEST(EditScript, SetsAndRemovesOffsets) {
  HSplineSurface surface = testing::SmoothSurface(kShape, 3);
  ApplyEdits(FromText("edits:\n  - {level: 2, i: 5, j: 6, offset: [0.5, 0, -1]}\n"), surface);
  EXPECT_EQ(surface.Offset({2, 5, 6}), Vec3(0.5, 0, -1));
  ApplyEdits(FromText("edits:\n  - {level: 2, i: 5, j: 6, offset: null}\n"), surface);
  EXPECT_TRUE(surface.Offsets().empty());
}

TEST(EditScript, AResetTakesAwayWhatLiesInTheRegionAndNothingElse) {
  const HSplineSurface before = RandomSurface(kShape, 4, 40);
  HSplineSurface surface = before;
  ApplyEdits(FromText("resets:\n  - {u: [0.8, 0.3], v: [0, 0.5], first_level: 2}\n"), surface);
  for (const auto& [vertex, offset] : before.Offsets()) {
    const Vec2 uv = before.GrevillePoint(vertex);
    const bool inside = vertex.level >= 2 && (uv.x() >= 0.8 || uv.x() <= 0.3) && uv.y() <= 0.5;
    EXPECT_EQ(surface.Offset(vertex).has_value(), !inside);
  }
  EXPECT_LT(surface.Offsets().size(), before.Offsets().size());
}

TEST(EditScript, FaultsAreNamedAndNothingChanges) {
  HSplineSurface surface = RandomSurface(kShape, 5);
  const HSplineSurface before = surface;
  const auto complaint = [&](const std::string& edits) -> std::string {
    try {
      ApplyEdits(FromText("edits:\n" + edits), surface);
    } catch (const Error& e) {
      return e.what();
    }
    return "accepted";
  };
  const std::string good = "  - {level: 1, i: 5, j: 6, offset: [9, 9, 9]}\n";
  EXPECT_THAT(complaint(good + good), HasSubstr("appears twice"));
  EXPECT_THAT(complaint(good + "  - {level: 0, i: 99, j: 6, offset: [0, 0, 0]}\n"),
              HasSubstr("i is 0..6, j is 0..7"));
  EXPECT_THAT(complaint(good + "  - {level: 0, i: 1, j: 6}\n"), HasSubstr("give an offset"));
  EXPECT_THAT(complaint(good + "  - {level: 4, i: 1, j: 6, offset: [0, 0, 0]}\n"),
              HasSubstr("level 4"));
  EXPECT_THAT(complaint("  - {level: 1, i: 1, k: 6}\n"), HasSubstr("script.yaml:2"));
  EXPECT_THROW(FromText("resets:\n  - {v: [0.5, 0.2]}\n"), ConfigError);
  EXPECT_EQ(surface.Net(3).vertices, before.Net(3).vertices);
}

TEST(EditScript, ARepeatedVertexIsRefusedWhenTheFileIsRead) {
  const ScratchFolder folder;
  const std::string edit = "  - {level: 1, i: 5, j: 6, offset: [9, 9, 9]}\n";
  WriteFileAtomically(folder / "twice.yaml", "edits:\n" + edit + edit);
  EXPECT_THAT(WordsOf<InputError>([&] { ReadEditScript(folder / "twice.yaml"); }),
              HasSubstr("twice.yaml: vertex (5, 6) of level 1 appears twice"));
}

}  // namespace
}  // namespace semblance::problems
