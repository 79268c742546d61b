// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/rater_faces.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <vector>

#include "problems/report/pictures/lighting.h"
#include "problems/report/pictures/pictures.h"
#include "problems/report/scene_file.h"
#include "problems/subject/average_skull.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

// In front of, below and above nasion; the sides as far as the cheeks.
const Box3 kFaceBox(Vec3(-85, -80, -135), Vec3(85, 75, 65));

SkullSites SitesOf(const fs::path& run) {
  std::vector<SitePoint> sites;
  for (const Dowel& dowel : ReadRunDowels(run / "dowels.csv")) {
    if (IsStandardSite(dowel.site)) {
      sites.push_back({dowel.site, dowel.base});
    }
  }
  try {
    return CompleteSites(sites);
  } catch (const InputError& error) {
    throw IoError(fmt::format("{}: its depth markers define no pose: {}",
                              (run / "dowels.csv").string(), error.what()));
  }
}

const TriMesh& RequireLayer(const std::vector<SceneMesh>& meshes, const char* id,
                            const fs::path& run, const char* remedy) {
  const SceneMesh* const found = FindSceneMesh(meshes, id);
  if (found == nullptr) {
    throw IoError(
        fmt::format("{}: its scene.json has no layer '{}'; {}", run.string(), id, remedy));
  }
  return found->mesh;
}

// Moves nasion to the origin and the skull's axes to those of an average skull; keeps the size.
TriMesh InHeadFrame(TriMesh mesh, const SkullSites& sites) {
  const Mat3 turn = sites.skull_from_average.rotation.transpose();
  for (Vec3& p : mesh.points) {
    p = turn * (p - sites.points.at("n"));
  }
  return mesh;
}

TriMesh Shown(const TriMesh& face) {
  std::vector<bool> keep;
  for (const Triangle& t : face.triangles) {
    keep.push_back(kFaceBox.contains(TriangleCentroid(face, t)));
  }
  return Submesh(face, keep);
}

Mat3 SmallTurn(Random& random) {
  constexpr double kMost_rad = 4 * std::numbers::pi / 180;
  Mat3 turn = Mat3::Identity();
  for (const Vec3& axis : {Vec3(Vec3::UnitX()), Vec3(Vec3::UnitY()), Vec3(Vec3::UnitZ())}) {
    turn = Eigen::AngleAxisd(random.Uniform(-kMost_rad, kMost_rad), axis) * turn;
  }
  return turn;
}

}  // namespace

RaterFace ReadRaterFace(const fs::path& run) {
  CheckRunFolder(run);
  const std::vector<SceneMesh> meshes = ReadSceneMeshes(run / "scene.json");
  const SkullSites sites = SitesOf(run);
  return {.person = fs::weakly_canonical(run).filename().string(),
          .recovered = InHeadFrame(RequireLayer(meshes, "face", run, "run it again"), sites),
          .skin = InHeadFrame(
              RequireLayer(meshes, "skin", run,
                           "raters need persons whose true skin is known (subject.skin or a CT)"),
              sites)};
}

Image DrawRaterFace(const TriMesh& face, Random& random, int threads) {
  constexpr int kWidth = 300, kHeight = 340;
  constexpr double kAspect = static_cast<double>(kWidth) / kHeight;
  const Mat3 turn = SmallTurn(random);
  TriMesh mesh = Shown(face);
  for (Vec3& p : mesh.points) {
    p = turn * p;
  }
  const Vec3 around(20, 20, 10);  // three-quarter views reach beyond the box
  const Box3 framed(kFaceBox.min() - around, kFaceBox.max() + around);
  const auto cameras = CamerasFor(std::array{View::kFront, View::kThreeQuarter}, framed, kAspect);
  ShadowMaps shadows;
  const std::vector<Image> sides =
      RenderAll({{SkinObject(std::move(mesh))}}, cameras, {.width = kWidth, .height = kHeight},
                shadows, threads);
  return ContactSheet(sides);
}

}  // namespace semblance::problems
