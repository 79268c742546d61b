// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/input_mistakes.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>

#include "problems/subject/landmark_files/read_landmarks.h"
#include "problems/subject/phantom.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance::problems {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Head {
  TriMesh skull, skin;
  LandmarkFile landmarks;
};

Head PhantomHead(std::uint64_t random_seed, int rings = 30) {
  const Phantom phantom = MakePhantom({.random_seed = random_seed, .rings = rings});
  return {phantom.skull, phantom.face, PhantomLandmarks(phantom.sites, random_seed)};
}

InputMistakes Find(const Head& head) {
  const MeshQuery skull(head.skull);
  return FindSkinMistakes({.skin = head.skin,
                           .skull = &skull,
                           .extent = Bounds(head.skull),
                           .landmarks = head.landmarks});
}

using Move = std::function<Vec3(const Vec3&)>;

TriMesh Moved(TriMesh mesh, const Move& move) {
  for (Vec3& p : mesh.points) {
    p = move(p);
  }
  return mesh;
}

TEST(SkinMistakes, PhantomsHaveNone) {
  for (const std::uint64_t seed : {1, 2, 3, 4, 5}) {
    for (const int rings : {16, 40}) {
      const InputMistakes found = Find(PhantomHead(seed, rings));
      EXPECT_THAT(found.errors, IsEmpty()) << seed;
      EXPECT_THAT(found.notes, IsEmpty()) << seed;
    }
  }
}

struct Mistake {
  const char* name;
  Move move;
  const char* words;  // of the error
};

TEST(SkinMistakes, ForgottenConversionsAreNamed) {
  const Head head = PhantomHead(1);
  const Mistake mistakes[] = {
      {"RAS", [](const Vec3& p) { return Vec3(-p.x(), -p.y(), p.z()); },
       "x and y negated it covers the bone"},
      {"y up", [](const Vec3& p) { return Vec3(p.x(), p.z(), -p.y()); },
       "is y up, as Blender writes OBJ"},
      {"inches", [](const Vec3& p) { return Vec3(p / 25.4); }, "multiplied by 25.4"},
      {"aside 40", [](const Vec3& p) { return Vec3(p + Vec3(40, 0, 0)); }, "moved by (-"},
      {"aside 10", [](const Vec3& p) { return Vec3(p + Vec3(10, 0, 0)); }, "moved by (-"},
      {"down 10", [](const Vec3& p) { return Vec3(p - Vec3(0, 0, 10)); }, "lies outside it"},
      {"back 10", [](const Vec3& p) { return Vec3(p + Vec3(0, 10, 0)); }, "lies outside it"},
      {"smaller", [](const Vec3& p) { return Vec3(0.9 * p); }, "lies outside it"},
  };
  for (const Mistake& mistake : mistakes) {
    Head wrong = head;
    wrong.skin = Moved(head.skin, mistake.move);
    const InputMistakes found = Find(wrong);
    ASSERT_EQ(found.errors.size(), 1u) << mistake.name;
    EXPECT_THAT(found.errors.front(), HasSubstr(mistake.words)) << mistake.name;
  }
}

TEST(SkinMistakes, TheSkullItselfIsNoSkin) {
  Head wrong = PhantomHead(1);
  wrong.skin = wrong.skull;
  EXPECT_THAT(Find(wrong).errors, ::testing::ElementsAre(HasSubstr("the same surface")));
}

TEST(SkinMistakes, SuspiciousSkinsAreNoted) {
  Head up = PhantomHead(1);
  up.skin = Moved(up.skin, [](const Vec3& p) { return Vec3(p + Vec3(0, 0, 10)); });
  Head other = PhantomHead(1);
  other.skin = PhantomHead(6).skin;
  for (const Head& head : {up, other}) {
    const InputMistakes found = Find(head);
    EXPECT_GE(found.notes.size() + found.errors.size(), 1u);
  }
}

// Each of these skins passes for one that lies right over the skull, but its depths are not those
// of the landmarks.
TEST(SkinMistakes, AnotherPersonsSkinIsNotedByItsDepths) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Head other = PhantomHead(seed);
    other.skin = PhantomHead(seed + 1).skin;
    const InputMistakes found = Find(other);
    EXPECT_GE(found.notes.size() + found.errors.size(), 1u) << seed;
  }
}

TEST(SkinMistakes, RealHeadsHaveNone) {
  for (const std::string name : {"vhm", "cthead", "cranium"}) {
    const std::filesystem::path folder =
        std::filesystem::path(SEMBLANCE_SOURCE_DIR "/../shared/data") / name;
    if (!std::filesystem::exists(folder / "skin.ply")) {
      GTEST_SKIP() << folder << " is not there";
    }
    Head head{ReadMesh(folder / "skull.ply"), ReadMesh(folder / "skin.ply"), {}};
    head.landmarks =
        ReadLandmarks(SEMBLANCE_SOURCE_DIR "/configs/landmarks/" + name + ".yaml").file;
    const InputMistakes found = Find(head);
    EXPECT_THAT(found.errors, IsEmpty()) << name;
    EXPECT_THAT(found.notes, IsEmpty()) << name;
  }
}

TEST(FaceMistakes, OnlyForgottenConversionsAreErrors) {
  const TriMesh truth = PhantomHead(1).skin;
  EXPECT_THAT(FindFaceMistakes(truth, truth).notes,
              ::testing::ElementsAre(HasSubstr("the face is the same surface as the true skin")));
  EXPECT_THAT(FindFaceMistakes(PhantomHead(2).skin, truth).notes, IsEmpty());
  const TriMesh ras = Moved(truth, [](const Vec3& p) { return Vec3(-p.x(), -p.y(), p.z()); });
  EXPECT_THAT(FindFaceMistakes(ras, truth).errors,
              ::testing::ElementsAre(HasSubstr("x and y negated it lies 0.0 mm from it")));
}

// A face of another size, or beside the truth, is noted with the change that would help.
TEST(FaceMistakes, AnotherSizeOrPlaceIsNamed) {
  const TriMesh truth = PhantomHead(1).skin;
  const Vec3 middle = Bounds(truth).center();
  for (const double factor : {0.9, 1.1}) {
    const TriMesh scaled =
        Moved(truth, [&](const Vec3& p) { return Vec3(middle + factor * (p - middle)); });
    EXPECT_THAT(FindFaceMistakes(scaled, truth).notes,
                ::testing::Contains(HasSubstr(fmt::format("scaled by {:.1f}", 1 / factor))));
  }
  const TriMesh shifted = Moved(truth, [](const Vec3& p) { return Vec3(p + Vec3(0, -10, 0)); });
  EXPECT_THAT(FindFaceMistakes(shifted, truth).notes,
              ::testing::Contains(HasSubstr("moved by (0, ")));
}

}  // namespace
}  // namespace semblance::problems
