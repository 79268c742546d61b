// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/template_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "problems/face/head_formula.h"
#include "problems/face/template_source.h"
#include "problems/report/pictures/template_summary.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline_files/hspline_json.h"
#include "surfaces/hspline_query/hspline_project.h"
#include "surfaces/hspline_query/tessellate.h"
#include "surfaces/mesh/mesh_query.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// Another person in another pose: larger, turned, with a crooked and longer nose and a full cheek.
Vec3 OfAnother(const Vec3& p) {
  const auto bell = [&](const Vec3& center, double sigma) {
    return std::exp(-0.5 * (p - center).squaredNorm() / (sigma * sigma));
  };
  const Vec3 other = p + bell({0, -22, -40}, 14) * Vec3(2, -6, -2) +
                     bell({50, 25, -50}, 18) * Vec3(4, -3, 0) +
                     bell({-30, 15, 10}, 12) * Vec3(0, 2.5, 0);
  const Mat3 turn = Eigen::AngleAxisd(0.2, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  return 1.08 * (turn * other) + Vec3(120, -40, 900);
}

// The mesh closed by a cone behind it.
TriMesh Closed(TriMesh mesh, const Vec3& apex) {
  std::set<std::pair<int, int>> edges;
  for (const Triangle& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      edges.emplace(t[k], t[(k + 1) % 3]);
    }
  }
  const auto tip = static_cast<std::int32_t>(mesh.points.size());
  mesh.points.push_back(apex);
  for (const auto& [a, b] : edges) {
    if (!edges.contains({b, a})) {
      mesh.triangles.push_back({b, a, tip});
    }
  }
  return mesh;
}

void Append(TriMesh& mesh, const TriMesh& part, const Vec3& shift, bool turned_over) {
  const auto first = static_cast<std::int32_t>(mesh.points.size());
  for (const Vec3& p : part.points) {
    mesh.points.push_back(p + shift);
  }
  for (const Triangle& t : part.triangles) {
    mesh.triangles.push_back(turned_over ? Triangle{t[0] + first, t[2] + first, t[1] + first}
                                         : Triangle{t[0] + first, t[1] + first, t[2] + first});
  }
}

const TriMesh& Head() {
  static const TriMesh head = [] {
    TriMesh mesh = Closed(Tessellate(MakeTemplateFace({}).surface, 2).mesh, {0, 150, -20});
    for (Vec3& p : mesh.points) {
      p = OfAnother(p);
    }
    return mesh;
  }();
  return head;
}

// Its landmarks: the sites, and those of the face.
SkinLandmarks LandmarksOf() {
  const HSplineSurface surface = MakeTemplateFace({}).surface;
  SkinLandmarks landmarks;
  for (const auto& places : {TemplateSites(), FacialLandmarks()}) {
    for (const auto& [code, uv] : places) {
      landmarks.points.push_back({code, OfAnother(surface.Point(uv))});
    }
  }
  return landmarks;
}

TemplateFit FitOf(const TriMesh& head, const SkinLandmarks& landmarks, int threads = 2) {
  const RunContext context{.on_event = {}, .stop_token = {}, .threads = threads};
  return FitTemplate(PrepareHead(head, landmarks, "head.ply", context), {.finest = 3}, context);
}

const TemplateFit& FitOfHead() {
  static const TemplateFit fit = FitOf(Head(), LandmarksOf());
  return fit;
}

std::string FaultOf(const TriMesh& head, const SkinLandmarks& landmarks) {
  try {
    PrepareHead(head, landmarks, "head.ply", {});
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), Not(HasSubstr("\n")));
    return error.what();
  }
  return "accepted";
}

TEST(TemplateFit, AnotherHeadIsMetWithItsSitesInTheirPlacesAndWithoutFoldsThorough) {
  const TemplateFit& fit = FitOfHead();
  EXPECT_TRUE(fit.usable);
  EXPECT_TRUE(fit.met);
  EXPECT_LT(fit.face_to_skin.rms_mm, 0.15);
  EXPECT_LT(fit.skin_to_face.rms_mm, 0.15);
  EXPECT_GT(fit.face_to_skin.covered, 0.99);
  EXPECT_EQ(fit.folds, 0);
  ASSERT_EQ(fit.sites.size(), 32);
  for (const auto& [code, site] : fit.sites) {
    EXPECT_LT(site.error_mm, 0.5) << code;
    // The truth is known here: the parametrisation is the formula's.
    EXPECT_LT(site.drift_mm, 3) << code;
  }
  for (std::size_t k = 1; k < fit.levels.size(); ++k) {
    EXPECT_LT(fit.levels[k].face_to_skin.rms_mm, fit.levels[k - 1].face_to_skin.rms_mm);
  }
}

TEST(TemplateFit, AnInnerWallAndAHoleDoNotMatterBeyondTheirPlaceThorough) {
  TriMesh head = Head();
  std::vector<bool> keep;
  const Vec3 cheek_point = MeshQuery(head).Closest(OfAnother({-50, 22, -50})).position;
  for (const Triangle& t : head.triangles) {
    keep.push_back((TriangleCentroid(head, t) - cheek_point).norm() > 9);
  }
  TriMesh broken = Submesh(head, keep);
  TriMesh wall = Head();
  const Vec3 middle = OfAnother({0, 90, -20});
  for (Vec3& p : wall.points) {
    p = middle + 0.9 * (p - middle);
  }
  Append(broken, wall, Vec3::Zero(), /*turned_over=*/true);
  const TemplateFit fit = FitOf(broken, LandmarksOf());
  EXPECT_LT(fit.face_to_skin.rms_mm, 0.2);
  EXPECT_LT(fit.face_to_skin.covered, 0.995);
  EXPECT_EQ(fit.folds, 0);
  // The hole is bridged near the place of the cheek.
  const SurfaceProjection bridge = SurfaceProjector(fit.face.surface).Project(cheek_point);
  EXPECT_LT(bridge.distance_mm, 1.5);
}

TEST(TemplateFit, TheThirtyTwoSitesAloneWillDoThorough) {
  SkinLandmarks sites = LandmarksOf();
  std::erase_if(sites.points,
                [](const SkinLandmark& l) { return !TemplateSites().contains(l.code); });
  const TemplateFit fit = FitOf(Head(), sites);
  EXPECT_LT(fit.face_to_skin.rms_mm, 0.2);
  EXPECT_EQ(fit.folds, 0);
}

TEST(TemplateFit, TheNumberOfThreadsDoesNotMatterAndTheFilesGiveTheSameFaceThorough) {
  const TemplateFit one = FitOf(Head(), LandmarksOf(), 1);
  const TemplateFit& two = FitOfHead();
  EXPECT_EQ(HSplineToJson(one.face.surface), HSplineToJson(two.face.surface));
  const testing::ScratchFolder folder;
  const TemplateFace read = ReadTemplate(WriteTemplate(folder.Path(), one.face));
  EXPECT_EQ(HSplineToJson(read.surface), HSplineToJson(one.face.surface));
  EXPECT_EQ(read.site_uv, one.face.site_uv);
  ASSERT_EQ(read.features.size(), 4);
  EXPECT_EQ(read.features[0].vertices, one.face.features[0].vertices);
  // The nose's region contains the nose.
  EXPECT_TRUE(read.features[0].region->Contains(read.surface.Point(UvOnGenericHead("prn"))));
}

TEST(TemplateFit, AHeadThatCannotBecomeATemplateIsRefusedInOneLine) {
  const SkinLandmarks good = LandmarksOf();
  EXPECT_EQ(FaultOf(Head(), good), "accepted");

  SkinLandmarks swapped = good;
  for (SkinLandmark& l : swapped.points) {
    if (l.code.ends_with("_l") || l.code.ends_with("_r")) {
      l.code.back() = l.code.back() == 'l' ? 'r' : 'l';
    }
  }
  EXPECT_THAT(FaultOf(Head(), swapped), AllOf(HasSubstr("head.ply"), HasSubstr("mirror image")));

  SkinLandmarks pair = good;
  for (SkinLandmark& l : pair.points) {
    l.code = l.code == "zy_l" ? "zy_r" : l.code == "zy_r" ? "zy_l" : l.code;
  }
  EXPECT_THAT(FaultOf(Head(), pair),
              AllOf(HasSubstr("head.ply: its landmarks: 'zy_l' lies"), HasSubstr("'zy_r'")));

  TriMesh two = Head();
  Append(two, Head(), {260, 0, 0}, /*turned_over=*/false);
  EXPECT_THAT(FaultOf(two, good), HasSubstr("two pieces of a head's size"));

  SkinLandmarks few;
  for (const SkinLandmark& l : good.points) {
    if (l.code == "g" || l.code == "n" || l.code == "zy_l" || l.code == "zy_r") {
      few.points.push_back(l);
    }
  }
  EXPECT_THAT(FaultOf(Head(), few), AllOf(HasSubstr("2 in the midline and 1 pairs"),
                                          HasSubstr("missing sites: sg, rhi")));

  SkinLandmarks metres = good;
  for (SkinLandmark& l : metres.points) {
    l.point *= 0.001;
  }
  EXPECT_THAT(FaultOf(Head(), metres), HasSubstr("look like metres; multiply by 1000"));
  TriMesh inches = Head();
  for (Vec3& p : inches.points) {
    p /= 25.4;
  }
  EXPECT_THAT(FaultOf(inches, good), HasSubstr("inches"));

  SkinLandmarks far = good;
  for (SkinLandmark& l : far.points) {
    l.point += l.code == "g" ? Vec3(0, -40, 0) : Vec3(0, 0, 0);
  }
  EXPECT_THAT(FaultOf(Head(), far), AllOf(HasSubstr("'g'"), HasSubstr("from the outer skin")));
}

TEST(TemplateFit, TheSummaryHasEveryLevelAndSite) {
  const OuterHead head{.skin = Head(), .points = LandmarksOf().points, .notes = {"a note"}};
  TemplateFit fit{.face = MakeTemplateFace({}), .levels = {{.level = 0}}, .sites = {}};
  for (const auto& [code, uv] : fit.face.site_uv) {
    fit.sites[code].uv = uv;
  }
  const std::string json = TemplateJson(fit, head, {});
  EXPECT_THAT(
      json, AllOf(HasSubstr("\"zy_l\""), HasSubstr("\"rms_mm\": null"), HasSubstr("\"met\": false"),
                  HasSubstr("a note"), HasSubstr("\"tolerance_mm\": 0.3")));
  EXPECT_THAT(TemplateText(fit, {}), HasSubstr("not met"));
}

// The generic model head with 68 landmarks and a rough map of the sites, if its data are installed.
TEST(TemplateFit, AModelHeadOfOtherTopologyIsMet) {
  const std::filesystem::path data = SEMBLANCE_SOURCE_DIR "/../shared/data";
  const std::filesystem::path mesh = data / "template/ict_head_lps_mm.ply";
  if (!std::filesystem::exists(mesh)) {
    GTEST_SKIP() << mesh << " is not there";
  }
  const std::vector<std::filesystem::path> landmarks = {data / "ict_face/sites_on_mean.csv",
                                                        data / "template/landmarks68_lps_mm.csv"};
  const TemplateFit fit = FitOf(ReadMesh(mesh), ReadSkinLandmarks(landmarks));
  EXPECT_TRUE(fit.met);
  EXPECT_EQ(fit.folds, 0);
  for (const auto& [code, site] : fit.sites) {
    EXPECT_FALSE(site.error_mm > 2) << code;
  }
}

}  // namespace
}  // namespace semblance::problems
