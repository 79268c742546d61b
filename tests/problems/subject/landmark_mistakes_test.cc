// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/landmark_mistakes.h"
#include "problems/subject/landmark_files/read_landmarks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <numbers>

#include "problems/subject/average_skull.h"
#include "problems/subject/mandible.h"
#include "problems/subject/phantom.h"

namespace semblance::problems {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Subject {
  LandmarkFile file;
  TriMesh skull;
};

InputMistakes Find(const Subject& s) {
  return FindLandmarkMistakes(s.file, s.skull, MeshQuery(s.skull), PlaceOptions{});
}

Subject PhantomSubject(std::uint64_t random_seed = 1) {
  const Phantom phantom = MakePhantom({.random_seed = random_seed, .rings = 40});
  Subject subject{.file = {}, .skull = phantom.skull};
  subject.file.subject = "P";
  for (const PhantomSite& s : phantom.sites) {
    Landmark& landmark = subject.file.landmarks.emplace_back();
    landmark.site = s.site;
    landmark.point = {s.base.x(), s.base.y(), s.base.z()};
  }
  return subject;
}

// The landmarks of a real head, and instead of its skull a speck of bone at each landmark.
Subject RealSubject(const std::string& name) {
  Subject subject;
  subject.file = ReadLandmarks(SEMBLANCE_SOURCE_DIR "/configs/landmarks/" + name + ".yaml").file;
  for (const Landmark& l : subject.file.landmarks) {
    const auto first = static_cast<std::int32_t>(subject.skull.points.size());
    const Vec3 p(l.point[0], l.point[1], l.point[2]);
    for (const Vec3& off : {Vec3(1, 0, 0), Vec3(-1, 1, 0), Vec3(0, -1, 1)}) {
      subject.skull.points.push_back(p + off);
    }
    subject.skull.triangles.push_back({first, first + 1, first + 2});
  }
  return subject;
}

std::vector<Subject> Sound() {
  return {PhantomSubject(), RealSubject("cthead"), RealSubject("vhm"), RealSubject("cranium")};
}

using Move = std::function<Vec3(const Vec3&)>;

void MoveSites(Subject& s, const Move& move) {
  for (Landmark& l : s.file.landmarks) {
    const Vec3 p = move({l.point[0], l.point[1], l.point[2]});
    l.point = {p.x(), p.y(), p.z()};
  }
}
void MoveSkull(Subject& s, const Move& move) {
  for (Vec3& p : s.skull.points) {
    p = move(p);
  }
}

Vec3 OtherAxes(const Vec3& p) { return {-p.x(), -p.y(), p.z()}; }
Vec3 MirroredX(const Vec3& p) { return {-p.x(), p.y(), p.z()}; }

void SwapSides(Subject& s) {
  for (Landmark& l : s.file.landmarks) {
    const bool left = l.site.ends_with("_l"), right = l.site.ends_with("_r");
    if (left || right) {
      l.site.back() = left ? 'r' : 'l';
    }
  }
}

Landmark& At(Subject& s, const std::string& site) {
  const auto found = std::ranges::find(s.file.landmarks, site, &Landmark::site);
  if (found == s.file.landmarks.end()) {
    throw std::out_of_range("the head lacks the site " + site);
  }
  return *found;
}

// Moves a site and lays it on the bone again.
void MoveAlongBone(Subject& s, const std::string& site, const Vec3& way) {
  const Vec3 p = MeshQuery(s.skull).Closest(Vec3(At(s, site).point.data()) + way).position;
  At(s, site).point = {p.x(), p.y(), p.z()};
}

TEST(LandmarkMistakes, ASoundSubjectHasNone) {
  for (const Subject& subject : Sound()) {
    EXPECT_THAT(Find(subject).errors, IsEmpty()) << subject.file.subject;
    EXPECT_THAT(Find(subject).notes, IsEmpty()) << subject.file.subject;
  }
}

struct Mistake {
  const char* name;
  std::function<void(Subject&)> make;
  std::vector<const char*> words;  // of the first error
  std::size_t lines;
};

const Mistake kMistakes[] = {
    {"sides swapped", SwapSides, {"left and right are swapped", "exchange _l and _r"}, 1},
    {"mirrored volume",
     [](Subject& s) {
       MoveSites(s, MirroredX);
       MoveSkull(s, MirroredX);
     },
     {"if the volume is a mirror image, negate x"},
     1},
    {"all in RAS",
     [](Subject& s) {
       MoveSites(s, OtherAxes);
       MoveSkull(s, OtherAxes);
     },
     {"the face looks to +y", "x and y negated", "are RAS; write `axes: RAS`"},
     1},
    {"landmarks in RAS",
     [](Subject& s) { MoveSites(s, OtherAxes); },
     {"farther than 3 mm from the skull", "x and y negated they fit within", "write `axes: RAS`"},
     1},
    {"skull in RAS",
     [](Subject& s) { MoveSkull(s, OtherAxes); },
     {"x and y negated they fit within", "write `axes: RAS`"},
     1},
    {"landmarks in metres",
     [](Subject& s) { MoveSites(s, [](const Vec3& p) { return Vec3(p / 1000); }); },
     {"multiplied by 1000 they fit within", "write `units: m`"},
     1},
    {"landmarks in inches",
     [](Subject& s) { MoveSites(s, [](const Vec3& p) { return Vec3(p / 25.4); }); },
     {"multiplied by 25.4 they fit within", "write `units: in`"},
     1},
    {"landmarks of the mirrored volume",
     [](Subject& s) {
       const double middle = Bounds(s.skull).center().x();
       MoveSites(s,
                 [middle](const Vec3& p) { return Vec3(2 * middle - p.x() + 0.01, p.y(), p.z()); });
     },
     {"swapped"},
     1},
    {"too large",
     [](Subject& s) {
       MoveSites(s, [](const Vec3& p) { return Vec3(1.7 * p); });
       MoveSkull(s, [](const Vec3& p) { return Vec3(1.7 * p); });
     },
     {"times as large as an average one"},
     1},
    {"face down",
     [](Subject& s) {
       const auto down = [](const Vec3& p) { return Vec3(p.x(), -p.z(), p.y()); };
       MoveSites(s, down);
       MoveSkull(s, down);
     },
     {"the face looks to", "looks to -y and its top to +z"},
     1},
    {"nowhere near",
     [](Subject& s) { MoveSites(s, [](const Vec3& p) { return Vec3(p + Vec3(400, 0, 90)); }); },
     {"share one frame and one unit"},
     1},
    {"a pair exchanged",
     [](Subject& s) { std::swap(At(s, "fe_l").site, At(s, "zy_l").site); },
     {"mm from where the other sites predict it", "max_misfit_mm", "the names may be exchanged"},
     2},
    {"the same point twice",
     [](Subject& s) { At(s, "g").point = At(s, "n").point; },
     {"have the same point"},
     1},
    {"all at one point",
     [](Subject& s) { MoveSites(s, [](const Vec3&) { return Vec3(1, 2, 3); }); },
     {"have the same point"},
     1},
    {"one in the air",
     [](Subject& s) { At(s, "g").point[1] -= 12; },
     {"site g (Glabella) is 1", "mm from the skull, and at most 3 mm are allowed"},
     1},
};

// Pairs of neighbours in the middle plane. Most of these exchanges leave each within max_misfit_mm.
TEST(LandmarkMistakes, NeighboursInExchangedOrderAreNoted) {
  for (const auto& [one, two] : {std::pair("sg", "g"), std::pair("pr", "id"), std::pair("id", "sm"),
                                 std::pair("sm", "pg"), std::pair("pg", "me")}) {
    for (const char* head : {"cthead", "vhm"}) {
      Subject subject = RealSubject(head);
      if (!subject.file.Find(one) || !subject.file.Find(two)) {
        continue;  // vhm lacks pg
      }
      std::swap(At(subject, one).point, At(subject, two).point);
      const InputMistakes found = Find(subject);
      const bool is_refused = !found.errors.empty();  // one is beyond max_misfit_mm
      EXPECT_TRUE(is_refused ||
                  std::ranges::any_of(found.notes,
                                      [&](const std::string& note) {
                                        return note.find(one) != note.npos &&
                                               note.find("the other way round than on other") !=
                                                   note.npos;
                                      }))
          << one << ", " << head;
    }
  }
}

// A site that was moved along the bone to one side, and along a cheek bone.
TEST(LandmarkMistakes, ASiteBesideItsPlaceOnOneSideIsNoted) {
  Subject chin = PhantomSubject(), cheek = PhantomSubject();
  MoveAlongBone(chin, "pg", {12, 0, 0});
  MoveAlongBone(cheek, "zy_l", {0, 16, 0});
  EXPECT_THAT(Find(chin).notes,
              ElementsAre(AllOf(HasSubstr("site pg"), HasSubstr("beside the middle of the head"))));
  EXPECT_THAT(Find(cheek).notes,
              ElementsAre(AllOf(HasSubstr("sites zy_l"), HasSubstr("from being mirror images"))));
}

// Gives each site the depth `rows` rows further on in the file, among sites that end so.
void ShiftDepths(Subject& subject, std::ptrdiff_t rows, const std::string& ending) {
  std::vector<std::optional<double>*> depths;
  std::vector<std::optional<double>> values;
  for (Landmark& landmark : subject.file.landmarks) {
    if (landmark.depth_along_normal_mm && landmark.site.ends_with(ending)) {
      depths.push_back(&landmark.depth_along_normal_mm);
      values.push_back(landmark.depth_along_normal_mm);
    }
  }
  for (std::size_t k = 0; k < depths.size(); ++k) {
    *depths[k] = values[(k + static_cast<std::size_t>(std::ssize(depths) + rows)) % depths.size()];
  }
}

TEST(LandmarkMistakes, DepthsInShiftedRowsAreNoted) {
  for (const char* head : {"cthead", "vhm", "cranium"}) {
    for (const std::ptrdiff_t rows : {1, -1, 2, 5}) {
      Subject subject = RealSubject(head);
      ShiftDepths(subject, rows, "");
      EXPECT_THAT(Find(subject).notes,
                  ElementsAre(HasSubstr("look whether each depth stands at its own site")))
          << head << ", " << rows;
    }
  }
}

TEST(LandmarkMistakes, DepthsInRowsOfOneSideThatWereShiftedAreNoted) {
  Subject subject = RealSubject("cthead");
  ShiftDepths(subject, 1, "_l");
  EXPECT_THAT(Find(subject).notes, ElementsAre(HasSubstr("depths of left and right differ")));
}

// Also at a site without a published depth, and for a depth that is too small.
TEST(LandmarkMistakes, OneDepthInAnotherUnitIsNoted) {
  for (const auto& [site, factor] : {std::pair("fe_l", 10.0), std::pair("zy_r", 0.1),
                                     std::pair("fe_l", 25.4), std::pair("go_l", 0.001)}) {
    Subject subject = RealSubject("vhm");
    auto& landmarks = subject.file.landmarks;
    const auto wrong = std::ranges::find(landmarks, site, &Landmark::site);
    ASSERT_NE(wrong, landmarks.end());
    *wrong->depth_along_normal_mm *= factor;
    EXPECT_THAT(Find(subject).notes,
                ElementsAre(AllOf(HasSubstr(site), HasSubstr("check both depths and their unit"))));
  }
}

TEST(LandmarkMistakes, DepthsThatAreAllScaledAreNoted) {
  for (const auto& [head, factor] : {std::pair("cthead", 0.5), std::pair("vhm", 2.0)}) {
    Subject subject = RealSubject(head);
    for (Landmark& landmark : subject.file.landmarks) {
      if (landmark.depth_along_normal_mm) {
        *landmark.depth_along_normal_mm *= factor;
      }
    }
    EXPECT_THAT(Find(subject).notes, ElementsAre(HasSubstr("times the published means")));
  }
}

TEST(LandmarkMistakes, EachHasItsMessage) {
  for (const Mistake& mistake : kMistakes) {
    for (Subject subject : Sound()) {
      if (std::string(mistake.name) == "landmarks of the mirrored volume" &&
          subject.file.subject != "P") {
        continue;  // specks of bone are not symmetric
      }
      mistake.make(subject);
      const InputMistakes found = Find(subject);
      ASSERT_EQ(found.errors.size(), mistake.lines)
          << mistake.name << ", " << subject.file.subject
          << (found.errors.empty() ? "" : ": " + found.errors.front());
      for (const char* words : mistake.words) {
        EXPECT_THAT(found.errors.front(), HasSubstr(words)) << subject.file.subject;
      }
    }
  }
}

// The mandible's sites, and the specks of bone at them, turned about the condyles.
void OpenMouth(Subject& s, double opening_deg) {
  std::vector<SitePoint> sites;
  for (const Landmark& l : s.file.landmarks) {
    sites.push_back({l.site, Vec3(l.point.data())});
  }
  const Similarity pose = FitAverageSkull(sites).skull_from_average;
  const Vec3 hinge = pose * Vec3((AverageCondyles()[0] + AverageCondyles()[1]) / 2);
  const Mat3 turn = Eigen::AngleAxisd(opening_deg * std::numbers::pi / 180, pose.rotation.col(0))
                        .toRotationMatrix();
  for (std::size_t k = 0; k < s.file.landmarks.size(); ++k) {
    Landmark& l = s.file.landmarks[k];
    if (IsOfMandible(l.site)) {
      const Vec3 p = hinge + turn * (Vec3(l.point.data()) - hinge);
      const Vec3 way = p - Vec3(l.point.data());
      l.point = {p.x(), p.y(), p.z()};
      for (std::size_t corner = 0; corner < 3; ++corner) {
        s.skull.points[3 * k + corner] += way;
      }
    }
  }
}

// A head of voxels whose spacing was wrong along one axis.
TEST(LandmarkMistakes, AStretchedHeadIsNoted) {
  for (const Subject& sound : Sound()) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double factor : {0.7, 1.4}) {
        Subject s = sound;
        const auto stretch = [&](Vec3 p) {
          p[axis] *= factor;
          return p;
        };
        MoveSites(s, stretch);
        MoveSkull(s, stretch);
        const InputMistakes mistakes = Find(s);
        const bool is_noted = std::ranges::any_of(mistakes.notes, [](const std::string& note) {
          return note.find("check the spacing of the voxels") != note.npos;
        });
        EXPECT_TRUE(is_noted || !mistakes.errors.empty())
            << sound.file.subject << " " << axis << " " << factor;
      }
    }
  }
}

TEST(LandmarkMistakes, SitesThatAreAllOffTheBoneAreNoted) {
  Subject s = PhantomSubject();
  const Vec3 middle = Bounds(s.skull).center();
  MoveSites(s, [&](const Vec3& p) { return Vec3(p + 2 * (middle - p).normalized()); });
  EXPECT_THAT(Find(s).errors, IsEmpty());
  EXPECT_THAT(Find(s).notes, ElementsAre(HasSubstr("half of the sites lie ")));
}

TEST(LandmarkMistakes, LandmarksOfAnotherSkullOfMuchTheSameShapeAreNoted) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Subject s = PhantomSubject(seed);
    s.file = PhantomSubject(seed + 1).file;
    const InputMistakes found = Find(s);
    EXPECT_GE(found.notes.size() + found.errors.size(), 1u) << seed;
  }
}

TEST(LandmarkMistakes, AnOpenMandibleIsReportedOnceWithItsAngle) {
  for (Subject subject : {RealSubject("cthead"), RealSubject("vhm")}) {
    OpenMouth(subject, 30);
    EXPECT_THAT(Find(subject).errors,
                ElementsAre(AllOf(HasSubstr("the mandible is open by "),
                                  HasSubstr("at most 15 are allowed (max_opening_deg)"),
                                  HasSubstr("close it (`subject: {mandible: {mesh: ..., "))))
        << subject.file.subject;
  }
}

// All bone within 26 mm of the mandible's sites is gone.
void RemoveMandible(Subject& s) {
  std::vector<Vec3> sites;
  for (const Landmark& l : s.file.landmarks) {
    if (l.site == "id" || l.site == "sm" || l.site == "pg" || l.site == "me" ||
        l.site.starts_with("go") || l.site.starts_with("mr") || l.site.starts_with("iM2")) {
      sites.emplace_back(l.point[0], l.point[1], l.point[2]);
    }
  }
  std::vector<bool> keep;
  for (const Triangle& t : s.skull.triangles) {
    const Vec3 c = TriangleCentroid(s.skull, t);
    keep.push_back(std::ranges::none_of(sites, [&](const Vec3& p) { return (c - p).norm() < 26; }));
  }
  s.skull = Submesh(s.skull, keep);
}

TEST(LandmarkMistakes, AMissingMandibleIsReportedOnce) {
  for (Subject subject : {RealSubject("cthead"), RealSubject("vhm")}) {
    RemoveMandible(subject);
    std::erase_if(subject.file.landmarks, [](const Landmark& l) {  // those near it
      return l.site == "pr" || l.site == "mp" || l.site.starts_with("sM2");
    });
    EXPECT_THAT(Find(subject).errors,
                ElementsAre(AllOf(HasSubstr("the mandible is missing from the skull's mesh"),
                                  HasSubstr("list its sites under `absent`"))));
    Subject without = subject;
    std::erase_if(without.file.landmarks, [](const Landmark& l) {
      return !(l.site.starts_with("fe") || l.site.starts_with("mso") || l.site.starts_with("mio") ||
               l.site.starts_with("lo") || l.site.starts_with("zy") || l.site == "g" ||
               l.site == "n");
    });
    EXPECT_THAT(Find(without).errors, IsEmpty());
    EXPECT_THAT(Find(without).notes, ElementsAre(HasSubstr("add the mandible")));
    without.file.absent = {{"pg", "not there"}};
    EXPECT_THAT(Find(without).notes, IsEmpty());
  }
}

}  // namespace
}  // namespace semblance::problems
